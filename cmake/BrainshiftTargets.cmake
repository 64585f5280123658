# A folder is a target. Its name follows from its path: common/io/config is brainshift_io_config
# (alias brainshift::io_config), server/session is brainshift_server_session, client/tools/twin is brainshift_tools_twin.
function(brainshift_folder_name result)
  file(RELATIVE_PATH path ${CMAKE_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  string(REGEX REPLACE "^(common|tests)/" "" name "${path}")
  string(REPLACE "client/tools" "tools" name "${name}")
  string(REPLACE "/" "_" name "${name}")
  set(${result} ${name} PARENT_SCOPE)
endfunction()

# brainshift_library(SOURCES ... [PUBLIC ...] [PRIVATE ...])
# PUBLIC and PRIVATE are what the folder links; the links are the dependency rule of docs/architecture.md,
# and the test layout.includes holds every #include to them. Heavy third-party headers belong in PRIVATE,
# so that only the folder's own .cpp files see them.
function(brainshift_library)
  cmake_parse_arguments(ARG "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  brainshift_folder_name(folder)
  add_library(brainshift_${folder} STATIC ${ARG_SOURCES})
  add_library(brainshift::${folder} ALIAS brainshift_${folder})
  target_include_directories(brainshift_${folder} PUBLIC
    $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}> $<INSTALL_INTERFACE:include/brainshift>)
  target_link_libraries(brainshift_${folder} PUBLIC ${ARG_PUBLIC}
    PRIVATE $<BUILD_INTERFACE:brainshift_warnings> ${ARG_PRIVATE})
  brainshift_precompile(brainshift_${folder} brainshift_headers)
  brainshift_record_links(brainshift_${folder} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
endfunction()

# brainshift_program(<name> SOURCES ... LINKS ...)
# Tests and benchmarks too; what it links is recorded like a folder's private links.
function(brainshift_program name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINKS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_include_directories(${name} PRIVATE ${CMAKE_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE brainshift_warnings ${ARG_LINKS})
  brainshift_precompile(${name} brainshift_headers)
endfunction()

# How many times longer a test may take: sanitizers slow programs down.
set(BRAINSHIFT_TIMEOUT_FACTOR 1)
if(BRAINSHIFT_SANITIZE)
  set(BRAINSHIFT_TIMEOUT_FACTOR 10)
endif()

# brainshift_test(<name> SOURCES ... LINKS ... [LABEL unit] [TIMEOUT 120])
# A GoogleTest program whose cases become CTest tests named <name>.<Suite>.<Case>.
# TIMEOUT: seconds, without sanitizers.
function(brainshift_test name)
  cmake_parse_arguments(ARG "" "LABEL;TIMEOUT" "SOURCES;LINKS" ${ARGN})
  if(NOT ARG_LABEL)
    set(ARG_LABEL unit)
  endif()
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  math(EXPR ARG_TIMEOUT "${ARG_TIMEOUT} * ${BRAINSHIFT_TIMEOUT_FACTOR}")
  add_executable(${name} ${ARG_SOURCES})
  target_include_directories(${name} PRIVATE ${CMAKE_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE brainshift_warnings ${ARG_LINKS} GTest::gmock GTest::gtest_main)
  target_compile_definitions(${name} PRIVATE BRAINSHIFT_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  brainshift_precompile(${name} brainshift_test_headers)
  # A parametrised case is called what its INSTANTIATE_TEST_SUITE_P names it. The value's bytes, which CMake would
  # add, hold addresses.
  gtest_discover_tests(${name} TEST_PREFIX "${name}." DISCOVERY_TIMEOUT 60 NO_PRETTY_VALUES
    PROPERTIES LABELS ${ARG_LABEL} TIMEOUT ${ARG_TIMEOUT})
endfunction()

# brainshift_describe_test(<name>... LABEL unit TIMEOUT 120 [ONE_THREAD])
# The same properties for tests that add_test made; ONE_THREAD keeps their linear algebra to one.
function(brainshift_describe_test)
  cmake_parse_arguments(ARG "ONE_THREAD" "LABEL;TIMEOUT" "" ${ARGN})
  math(EXPR timeout "${ARG_TIMEOUT} * ${BRAINSHIFT_TIMEOUT_FACTOR}")
  set_tests_properties(${ARG_UNPARSED_ARGUMENTS} PROPERTIES LABELS ${ARG_LABEL} TIMEOUT ${timeout})
  if(ARG_ONE_THREAD)
    set_tests_properties(${ARG_UNPARSED_ARGUMENTS} PROPERTIES ENVIRONMENT "OMP_NUM_THREADS=1;OPENBLAS_NUM_THREADS=1")
  endif()
endfunction()

# brainshift_unit_tests(SOURCES ... LINKS ...): the one test program of a folder of tests/unit, unit_<folder>.
function(brainshift_unit_tests)
  brainshift_folder_name(folder)
  brainshift_test(${folder} ${ARGN})
endfunction()

# Headers of other projects that most sources include, parsed once (BRAINSHIFT_PRECOMPILE). No header of
# ours is among them: an edit of ours rebuilds what includes it and no more.
option(BRAINSHIFT_PRECOMPILE "Precompile the headers of other projects" ON)
function(brainshift_precompile target donor)
  if(BRAINSHIFT_PRECOMPILE)
    target_precompile_headers(${target} REUSE_FROM ${donor})
  endif()
endfunction()
# The same for every target of the current folder that has none yet.
function(brainshift_precompile_folder)
  cmake_parse_arguments(ARG "" "" "EXCEPT" ${ARGN})
  get_property(targets DIRECTORY PROPERTY BUILDSYSTEM_TARGETS)
  foreach(target IN LISTS targets)
    get_target_property(type ${target} TYPE)
    get_target_property(donor ${target} PRECOMPILE_HEADERS_REUSE_FROM)
    if(type MATCHES "EXECUTABLE|STATIC_LIBRARY" AND NOT donor AND NOT target IN_LIST ARG_EXCEPT)
      brainshift_precompile(${target} brainshift_headers)
    endif()
  endforeach()
endfunction()
function(brainshift_precompiled_headers donor)
  cmake_parse_arguments(ARG "" "" "HEADERS;LINKS" ${ARGN})
  if(BRAINSHIFT_PRECOMPILE)
    file(WRITE ${CMAKE_BINARY_DIR}/precompiled/${donor}.cpp.new "// Only carries the precompiled headers.\n")
    file(COPY_FILE ${CMAKE_BINARY_DIR}/precompiled/${donor}.cpp.new
      ${CMAKE_BINARY_DIR}/precompiled/${donor}.cpp ONLY_IF_DIFFERENT)
    add_library(${donor} OBJECT ${CMAKE_BINARY_DIR}/precompiled/${donor}.cpp)
    target_link_libraries(${donor} PRIVATE brainshift_warnings ${ARG_LINKS})
    target_precompile_headers(${donor} PRIVATE ${ARG_HEADERS})
  endif()
endfunction()

# folder_links.txt: one line for each folder, "common/fem : common/geometry common/linalg common/io/files!",
# an exclamation mark for a private link. cmake/scripts/check-includes.sh reads it.
function(brainshift_record_links target)
  cmake_parse_arguments(ARG "" "" "PUBLIC;PRIVATE" ${ARGN})
  file(RELATIVE_PATH path ${CMAKE_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  set_property(GLOBAL APPEND PROPERTY BRAINSHIFT_FOLDERS ${path})
  set_property(GLOBAL PROPERTY BRAINSHIFT_FOLDER_OF_${target} ${path})
  set_property(GLOBAL PROPERTY BRAINSHIFT_PUBLIC_OF_${path} ${ARG_PUBLIC})
  set_property(GLOBAL PROPERTY BRAINSHIFT_PRIVATE_OF_${path} ${ARG_PRIVATE})
endfunction()
function(brainshift_write_folder_links)
  get_property(folders GLOBAL PROPERTY BRAINSHIFT_FOLDERS)
  set(text "")
  foreach(folder IN LISTS folders)
    string(APPEND text "${folder} :")
    foreach(kind IN ITEMS PUBLIC PRIVATE)
      get_property(links GLOBAL PROPERTY BRAINSHIFT_${kind}_OF_${folder})
      foreach(link IN LISTS links)
        string(REPLACE "brainshift::" "brainshift_" target "${link}")
        get_property(of_link GLOBAL PROPERTY BRAINSHIFT_FOLDER_OF_${target})
        if(of_link)
          string(APPEND text " ${of_link}")
          if(kind STREQUAL PRIVATE)
            string(APPEND text "!")
          endif()
        endif()
      endforeach()
    endforeach()
    string(APPEND text "\n")
  endforeach()
  file(WRITE ${CMAKE_BINARY_DIR}/folder_links.txt "${text}")
endfunction()
