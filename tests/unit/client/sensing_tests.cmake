brainshift_test(client_sensing_test
  SOURCES sensing_files_test.cpp sensing_import_test.cpp
  LINKS brainshift::sensing brainshift::io brainshift::wire brainshift_sweep_support brainshift_test_support fmt::fmt)
