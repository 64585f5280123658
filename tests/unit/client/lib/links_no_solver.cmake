# Fails if BINARY, a program that links the client library and nothing
# else of ours, loads or contains a solver, a mesher, an image or a
# model-file library. CGAL is headers only; its symbols and GMP show it.
execute_process(COMMAND ldd ${BINARY} OUTPUT_VARIABLE libraries RESULT_VARIABLE rc)
if(NOT rc EQUAL 0 OR NOT libraries MATCHES "libzmq")
  message(FATAL_ERROR "ldd ${BINARY} told nothing: ${libraries}")
endif()
if(libraries MATCHES "lib(cholmod|amd|colamd|metis|suitesparse|openblas|blas|lapack|gmp|mpfr|opencv|hdf5|sqlite)[^ ]*")
  message(FATAL_ERROR "the client library loads ${CMAKE_MATCH_0}")
endif()

execute_process(COMMAND ${NM} -C ${BINARY} OUTPUT_VARIABLE symbols RESULT_VARIABLE rc)
if(NOT rc EQUAL 0 OR NOT symbols MATCHES "brainshift::client::Client::connect")
  message(FATAL_ERROR "nm ${BINARY} told nothing")
endif()
if(symbols MATCHES "(CGAL::|cholmod_|dgemm_|cv::)[^ ]*")
  message(FATAL_ERROR "the client library contains ${CMAKE_MATCH_0}")
endif()
