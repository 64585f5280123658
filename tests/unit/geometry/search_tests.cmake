# Tests of surfaces, closest points and point location; included by this folder's CMakeLists.txt.
brainshift_test(geometry_surface_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/surface_test.cpp
  LINKS brainshift::geometry)
brainshift_test(geometry_closest_point_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/closest_point_test.cpp
  LINKS brainshift::geometry Threads::Threads)
brainshift_test(geometry_tet_locator_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/tet_locator_test.cpp
  LINKS brainshift::geometry)
brainshift_test(geometry_distance_volume_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/distance_volume_test.cpp ${CMAKE_CURRENT_LIST_DIR}/triangle_distance_test.cpp
  LINKS brainshift::geometry)
brainshift_test(geometry_oriented_cloud_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/oriented_cloud_test.cpp
  LINKS brainshift::geometry)
brainshift_test(geometry_surface_check_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/surface_check_test.cpp
  LINKS brainshift::geometry)
