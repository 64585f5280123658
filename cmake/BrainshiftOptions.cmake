# Language level, warnings, sanitizers.
option(BRAINSHIFT_BUILD_TESTS "Build tests and benchmarks" ON)
option(BRAINSHIFT_CLIENT_ONLY "Build and install the C++ client library alone: no solver, nothing under the GPL" OFF)
option(BRAINSHIFT_MPI "Build brainshiftd-mpi, which prepares a model by several processes" OFF)
set(BRAINSHIFT_SANITIZE "" CACHE STRING "Sanitizers, e.g. address,undefined or thread")

# See brainshift_archives in BrainshiftTargets.cmake.
option(BRAINSHIFT_TEST_LIBRARY "Tests link the product as one shared library, and are themselves compiled with -O1" OFF)

option(BRAINSHIFT_FUZZ "Build the fuzz targets with libFuzzer (clang)" OFF)

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
# Programs as libraries, so that both can read the same precompiled headers.
set(CMAKE_CXX_COMPILE_OPTIONS_PIE -fPIC)

if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()

# With debug symbols GNU ld needs nine seconds for a test program of 200 MB, lld two.
find_program(BRAINSHIFT_LLD ld.lld DOC "Linker of debug builds; empty: the compiler's own")
if(BRAINSHIFT_LLD AND CMAKE_BUILD_TYPE STREQUAL "Debug")
  add_link_options(-fuse-ld=lld)
endif()

add_library(brainshift_warnings INTERFACE)
target_compile_options(brainshift_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Wnon-virtual-dtor -Werror)
# GCC 12 reports copies inside std::string that no code makes (GCC bugs 105329, 105651), also in precompiled
# headers, where it does not see that they are the system's. The sanitizer presets look at real ones.
target_compile_options(brainshift_warnings INTERFACE -Wno-array-bounds -Wno-restrict
  -Wno-stringop-overflow -Wno-stringop-overread)

# Several files of a folder are compiled as one: templates are instantiated and headers read once for all of them.
# An edit compiles its whole batch, so the preset dev leaves it off. layout.names keeps names of a folder apart.
option(BRAINSHIFT_UNITY "Compile the files of a folder together (unity builds)" OFF)
set(CMAKE_UNITY_BUILD ${BRAINSHIFT_UNITY})
set(CMAKE_UNITY_BUILD_BATCH_SIZE 12)
if(BRAINSHIFT_UNITY)
  # GCC takes the files of a unit for headers, whose types must not have members of unnamed namespaces.
  target_compile_options(brainshift_warnings INTERFACE -Wno-subobject-linkage)
endif()

# GCC looks for memory to free whenever its heap has doubled, from 128 MiB on, which precompiled headers alone fill. From
# 512 MiB on it is a tenth faster, and uses no more than the largest files need anyway.
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
  add_compile_options("SHELL:--param ggc-min-heapsize=524288")
endif()

if(CMAKE_CXX_COMPILER_ID MATCHES Clang)
  # GCC is the compiler whose warnings are errors.
  target_compile_options(brainshift_warnings INTERFACE -Wno-error -Wno-unknown-warning-option)
endif()

if(BRAINSHIFT_FUZZ)
  if(NOT CMAKE_CXX_COMPILER_ID MATCHES Clang)
    message(FATAL_ERROR "BRAINSHIFT_FUZZ needs clang: use the preset fuzz")
  endif()
  add_compile_options(-fsanitize=fuzzer-no-link)
endif()
if(BRAINSHIFT_SANITIZE)
  # With a sanitizer GCC 12 takes parts of std::regex (GCC bug 105562) and CGAL for uninitialised. Builds without one
  # keep the warning.
  target_compile_options(brainshift_warnings INTERFACE -Wno-maybe-uninitialized)
  add_compile_options(-fsanitize=${BRAINSHIFT_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${BRAINSHIFT_SANITIZE})
endif()

# A compiler cache, where one is installed. Precompiled headers need both settings to be cached.
find_program(BRAINSHIFT_CCACHE ccache DOC "Compiler cache; empty: none")
if(BRAINSHIFT_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER
    ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros ${BRAINSHIFT_CCACHE})
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    add_compile_options($<$<COMPILE_LANGUAGE:CXX>:-fpch-preprocess>)
  endif()
endif()
