# What `cmake --install BUILD --component client` installs: the C++ client library for find_package(brainshift_client), with
# its headers. All of it is Apache-2.0; an example is client/examples/send_boundary.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/brainshift_client)
foreach(name core values wire proto client_lib)
  set_target_properties(brainshift_${name} PROPERTIES EXPORT_NAME ${name})
  install(TARGETS brainshift_${name} EXPORT brainshift_client
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT client)
endforeach()
install(EXPORT brainshift_client NAMESPACE brainshift:: FILE brainshift_client_targets.cmake
  DESTINATION ${package_dir} COMPONENT client)

foreach(folder core values)
  install(DIRECTORY ${CMAKE_SOURCE_DIR}/common/${folder} DESTINATION include/brainshift/common COMPONENT client
    FILES_MATCHING PATTERN "*.hpp")
endforeach()
# Not those that only common/wire itself may include: they show Protobuf's generated code.
foreach(name convert frame names published_update report)
  install(FILES ${CMAKE_SOURCE_DIR}/common/wire/${name}.hpp DESTINATION include/brainshift/common/wire COMPONENT client)
endforeach()
install(FILES ${CMAKE_SOURCE_DIR}/client/lib/client.hpp ${CMAKE_SOURCE_DIR}/client/lib/client_keys.hpp
  ${CMAKE_SOURCE_DIR}/client/lib/field.hpp ${CMAKE_SOURCE_DIR}/client/lib/field_status.hpp
  DESTINATION include/brainshift/client/lib COMPONENT client)
# What is included as <brainshift/client.hpp>.
install(FILES ${CMAKE_SOURCE_DIR}/client/lib/brainshift/client.hpp DESTINATION include/brainshift COMPONENT client)
install(FILES ${CMAKE_SOURCE_DIR}/LICENSES/Apache-2.0.txt DESTINATION share/doc/libbrainshift-client-dev COMPONENT client)

# Not in the build's top folder: with its bin/ in PATH, find_package would take the files there for an installed package.
set(package_files ${CMAKE_BINARY_DIR}/for_installation)
configure_package_config_file(${CMAKE_SOURCE_DIR}/cmake/brainshift_client-config.cmake.in
  ${package_files}/brainshift_client-config.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${package_files}/brainshift_client-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${package_files}/brainshift_client-config.cmake ${package_files}/brainshift_client-config-version.cmake
  DESTINATION ${package_dir} COMPONENT client)
