brainshift_test(client_twin_test
  SOURCES twin_load_test.cpp twin_truth_test.cpp twin_surgery_test.cpp twin_ultrasound_test.cpp
  LINKS brainshift::twin brainshift::contact brainshift::fem brainshift::geometry brainshift::wire
        brainshift_test_support)
