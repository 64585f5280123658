# Debian packages, made by `make packages`: brainshift (daemon and command line) and libbrainshift-client-dev (the client
# library, BrainshiftClientPackage.cmake). Which packages they need follows from the programs' libraries (dpkg-shlibdeps).
include(GNUInstallDirs)

file(READ ${CMAKE_SOURCE_DIR}/docker/brainshiftd.service unit)
string(REPLACE "/usr/local/bin/" "/usr/bin/" unit "${unit}")
string(REGEX REPLACE "# systemd unit for a bare machine.*\n\\[Unit\\]" "\n[Unit]" unit "${unit}")
file(WRITE ${CMAKE_BINARY_DIR}/brainshiftd.service "${unit}")
install(TARGETS brainshiftd brainshift RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT programs)
install(FILES ${CMAKE_BINARY_DIR}/brainshiftd.service DESTINATION lib/systemd/system COMPONENT programs)
foreach(program brainshift brainshiftd)
  install(FILES ${CMAKE_SOURCE_DIR}/cmake/completion.bash DESTINATION share/bash-completion/completions RENAME ${program}
    COMPONENT programs)
endforeach()
install(FILES ${CMAKE_SOURCE_DIR}/config/daemon.yaml DESTINATION share/doc/brainshift/examples COMPONENT programs)
install(DIRECTORY ${CMAKE_SOURCE_DIR}/config/cases DESTINATION share/doc/brainshift/examples COMPONENT programs)
install(FILES ${CMAKE_SOURCE_DIR}/LICENSE DESTINATION share/doc/brainshift RENAME copyright COMPONENT programs)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME brainshift)
set(CPACK_PACKAGE_CONTACT "the brainshift project")
set(CPACK_COMPONENTS_ALL programs client)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_NAME brainshift)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAMS_DESCRIPTION "brain-shift compensation service: daemon and command line
Estimates how a patient's brain has moved during surgery. Research software for
simulation, replay and laboratory use; no medical device.")
# Not any BLAS: the serial OpenBLAS corrupts results (docs/decisions/0007). The default case is Colin27.
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_DEPENDS libopenblas0-pthread)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_RECOMMENDS mricron-data)
set(CPACK_DEBIAN_CLIENT_PACKAGE_NAME libbrainshift-client-dev)
set(CPACK_DEBIAN_CLIENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_CLIENT_PACKAGE_DEPENDS
  "libeigen3-dev, libexpected-dev, libprotobuf-dev, libzmq3-dev, pkg-config, zlib1g-dev")
set(CPACK_DEBIAN_CLIENT_DESCRIPTION "client library of the brain-shift compensation service
For navigation systems: headers, static libraries and a CMake package. Apache-2.0,
links no solver. Research software; no medical device.")
include(CPack)
