brainshift_test(io_surgery_file_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/surgery_file_test.cpp
  LINKS brainshift::io SQLite::SQLite3)
