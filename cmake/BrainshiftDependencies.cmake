# Every third-party library, found once. The Debian packages are listed in docker/packages-build.txt.
find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(tl-expected REQUIRED)
find_package(ZLIB REQUIRED)
find_package(Protobuf REQUIRED)
pkg_check_modules(ZMQ REQUIRED IMPORTED_TARGET libzmq)
if(BRAINSHIFT_CLIENT_ONLY)
  return()
endif()

find_package(spdlog REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(CLI11 REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(SQLite3 REQUIRED)
find_package(HDF5 REQUIRED COMPONENTS C)
find_package(pugixml REQUIRED)
find_package(nanoflann REQUIRED)
find_package(CGAL REQUIRED)
pkg_check_modules(SYSTEMD REQUIRED IMPORTED_TARGET libsystemd)
pkg_check_modules(PROMETHEUS REQUIRED IMPORTED_TARGET prometheus-cpp-core)
pkg_check_modules(MICROHTTPD REQUIRED IMPORTED_TARGET libmicrohttpd)

# SuiteSparse ships no CMake package in Debian 12.
find_path(CHOLMOD_INCLUDE_DIR cholmod.h PATH_SUFFIXES suitesparse REQUIRED)
find_library(CHOLMOD_LIBRARY cholmod REQUIRED)
add_library(brainshift_cholmod INTERFACE)
target_include_directories(brainshift_cholmod SYSTEM INTERFACE ${CHOLMOD_INCLUDE_DIR})
target_link_libraries(brainshift_cholmod INTERFACE ${CHOLMOD_LIBRARY})

# The sequential MUMPS: its own stub of MPI, no message passing. Debian has the headers beside those of the parallel one.
find_path(MUMPS_INCLUDE_DIR dmumps_c.h REQUIRED)
find_library(MUMPS_LIBRARY dmumps_seq REQUIRED)
find_library(MUMPS_COMMON_LIBRARY mumps_common_seq REQUIRED)
find_library(MUMPS_MPI_STUB_LIBRARY mpiseq_seq REQUIRED)
add_library(brainshift_mumps INTERFACE)
target_include_directories(brainshift_mumps SYSTEM INTERFACE ${MUMPS_INCLUDE_DIR})
target_link_libraries(brainshift_mumps INTERFACE
  ${MUMPS_LIBRARY} ${MUMPS_COMMON_LIBRARY} ${MUMPS_MPI_STUB_LIBRARY})

# The parallel MUMPS, for brainshiftd-mpi alone. It and the sequential one with its stub of MPI have the same names: what a program
# lists first wins, MPI's Fortran names and ScaLAPACK included.
if(BRAINSHIFT_MPI)
  find_package(MPI REQUIRED COMPONENTS C)
  find_library(MUMPS_MPI_LIBRARY dmumps REQUIRED)
  find_library(MUMPS_MPI_COMMON_LIBRARY mumps_common REQUIRED)
  find_library(SCALAPACK_LIBRARY scalapack-openmpi REQUIRED)
  find_library(MPI_FORTRAN_LIBRARY mpi_mpifh REQUIRED HINTS ${MPI_C_LIBRARY_DIRS} /usr/lib/x86_64-linux-gnu/openmpi/lib)
  add_library(brainshift_mpi_libraries INTERFACE)
  target_include_directories(brainshift_mpi_libraries SYSTEM INTERFACE ${MUMPS_INCLUDE_DIR} ${MPI_C_INCLUDE_DIRS})
  target_link_libraries(brainshift_mpi_libraries INTERFACE
    "-Wl,--push-state,--no-as-needed,${MUMPS_MPI_LIBRARY},${MUMPS_MPI_COMMON_LIBRARY},${SCALAPACK_LIBRARY},${MPI_FORTRAN_LIBRARY},--pop-state" ${MPI_C_LIBRARIES})
endif()

# BLAS and LAPACK by their standard names, as CHOLMOD links them.
find_path(CBLAS_INCLUDE_DIR cblas.h PATH_SUFFIXES openblas-pthread REQUIRED)
find_library(BLAS_LIBRARY blas REQUIRED)
find_library(LAPACK_LIBRARY lapack REQUIRED)
add_library(brainshift_blas INTERFACE)
target_include_directories(brainshift_blas SYSTEM INTERFACE ${CBLAS_INCLUDE_DIR})
target_link_libraries(brainshift_blas INTERFACE ${LAPACK_LIBRARY} ${BLAS_LIBRARY})

# OpenCV's CMake package lives in the meta-package only; the split packages hold headers and libraries.
find_path(OPENCV_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)
add_library(brainshift_opencv INTERFACE)
target_include_directories(brainshift_opencv SYSTEM INTERFACE ${OPENCV_INCLUDE_DIR})
foreach(module core imgproc imgcodecs)
  find_library(OPENCV_${module}_LIBRARY opencv_${module} REQUIRED)
  target_link_libraries(brainshift_opencv INTERFACE ${OPENCV_${module}_LIBRARY})
endforeach()

# For the one folder that sees with two cameras.
find_library(OPENCV_calib3d_LIBRARY opencv_calib3d REQUIRED)
add_library(brainshift_opencv_calib3d INTERFACE)
target_link_libraries(brainshift_opencv_calib3d INTERFACE ${OPENCV_calib3d_LIBRARY} brainshift_opencv)

# libnifti's own CMake package names targets that Debian does not install. libnifti2 reads NIfTI-1 and -2;
# libniftiio has the same symbols for NIfTI-1 alone, so only one is linked.
find_path(NIFTI_INCLUDE_DIR nifti2_io.h PATH_SUFFIXES nifti REQUIRED)
find_library(NIFTI_LIBRARY nifti2 REQUIRED)
find_library(ZNZ_LIBRARY znz REQUIRED)
add_library(brainshift_nifti INTERFACE)
target_include_directories(brainshift_nifti SYSTEM INTERFACE ${NIFTI_INCLUDE_DIR})
target_link_libraries(brainshift_nifti INTERFACE ${NIFTI_LIBRARY} ${ZNZ_LIBRARY} ZLIB::ZLIB)

# DCMTK's own CMake package asks for every library that any of its modules links.
find_path(DCMTK_INCLUDE_DIR dcmtk/dcmdata/dctk.h REQUIRED)
add_library(brainshift_dcmtk INTERFACE)
target_include_directories(brainshift_dcmtk SYSTEM INTERFACE ${DCMTK_INCLUDE_DIR})
foreach(name dcmjpeg dcmjpls dcmdata oflog ofstd)
  find_library(DCMTK_${name}_LIBRARY ${name} REQUIRED)
  target_link_libraries(brainshift_dcmtk INTERFACE ${DCMTK_${name}_LIBRARY})
endforeach()

if(BRAINSHIFT_BUILD_TESTS)
  find_package(GTest REQUIRED)
  find_package(benchmark REQUIRED)
endif()
