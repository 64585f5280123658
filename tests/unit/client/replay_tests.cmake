brainshift_test(client_replay_test
  SOURCES replay_play_test.cpp replay_run_report_test.cpp replay_score_test.cpp
  LINKS brainshift::replay nlohmann_json::nlohmann_json)
