// SPDX-License-Identifier: GPL-3.0-or-later
// The daemon's configuration file (YAML) to plain values. Unknown keys are errors. Every message
// is one line: file, line, key, value, constraint.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/configuration/key_table.hpp"
#include "common/core/error.hpp"

namespace brainshift::io {

// Where monitors scrape (docs/operations.md).
struct MetricsConfig {
  std::string endpoint;  // HOST:PORT; empty: nowhere
};

// Files of keys (key_file.hpp). Both or none.
struct SecurityConfig {
  std::filesystem::path secret_key;  // the daemon's
  std::filesystem::path allow_list;  // its clients'

  bool on() const { return !secret_key.empty() && !allow_list.empty(); }
};

// Per key of the allow-list; without keys, per connection.
struct LimitsConfig {
  int connections = 8;  // of keys only
  int observations_per_s = 2000;
  int session_starts_per_min = 60;
};

// What a daemon file says (config/daemon.yaml documents every key; the table is in the .cpp).
struct DaemonConfig {
  std::string endpoint = "tcp://127.0.0.1:5555";  // tcp://HOST:PORT or ipc://PATH
  bool allow_remote = false;                      // endpoints that other machines reach
  SecurityConfig security;
  // Model file. Empty: clients get model_not_ready until one is loaded.
  std::filesystem::path model;
  std::filesystem::path journal_dir;  // empty: no journal
  std::string log_level = "info";
  int max_clients = 32;
  int max_message_mib = 16;
  LimitsConfig limits;
  MetricsConfig metrics;
};

// Reads and validates; relative paths are taken from the file's folder.
Result<DaemonConfig> read_daemon_config(const std::filesystem::path& path);

// Ok for ipc://PATH, and for tcp://HOST:PORT where HOST is surely this machine alone (127.0.0.0/8,
// ::1, localhost, lo) or allow_remote is true. kInvalidArgument: "endpoint = ...: reason". Every
// other transport of ZeroMQ is refused.
Status check_endpoint(const std::string& endpoint, bool allow_remote);

// Ok for HOST:PORT where HOST is surely this machine alone or allow_remote is true, as above; HOST
// in numbers, or localhost. kInvalidArgument: "metrics.endpoint = ...: reason".
Status check_metrics_endpoint(const std::string& endpoint, bool allow_remote);

// Ok when the endpoint is this machine's alone or keys are configured: nobody unknown is served
// over a network. kInvalidArgument names the keys that are missing.
Status check_security(const DaemonConfig& config);

// The documentation of every key.
std::vector<KeyDocument> daemon_key_documents();

}  // namespace brainshift::io
