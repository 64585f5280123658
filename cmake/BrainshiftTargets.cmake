# brainshift_library(<folder> SOURCES ... [PUBLIC ...] [PRIVATE ...])
# One target per folder: brainshift_<folder>, alias brainshift::<folder>. PUBLIC and PRIVATE are what it
# links; the links are the dependency rule of docs/architecture.md. Heavy third-party headers belong in
# PRIVATE, so that only the folder's own .cpp files see them.
function(brainshift_library folder)
  cmake_parse_arguments(ARG "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(brainshift_${folder} STATIC ${ARG_SOURCES})
  add_library(brainshift::${folder} ALIAS brainshift_${folder})
  target_include_directories(brainshift_${folder} PUBLIC ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/..)
  target_link_libraries(brainshift_${folder} PUBLIC ${ARG_PUBLIC} PRIVATE brainshift_warnings ${ARG_PRIVATE})
endfunction()

# brainshift_test(<name> SOURCES ... LINKS ... [LABEL unit])
# A GoogleTest executable whose cases become CTest tests named <name>.<Suite>.<Case>.
function(brainshift_test name)
  cmake_parse_arguments(ARG "" "LABEL;TIMEOUT" "SOURCES;LINKS" ${ARGN})
  if(NOT ARG_LABEL)
    set(ARG_LABEL unit)
  endif()
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE brainshift_warnings ${ARG_LINKS} GTest::gmock GTest::gtest_main)
  gtest_discover_tests(${name} TEST_PREFIX "${name}." DISCOVERY_TIMEOUT 60
    PROPERTIES LABELS ${ARG_LABEL} TIMEOUT ${ARG_TIMEOUT})
endfunction()
