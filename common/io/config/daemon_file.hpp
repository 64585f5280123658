// SPDX-License-Identifier: GPL-3.0-or-later
// The daemon's configuration file (YAML) to plain values. Unknown keys are errors. Every message
// is one line: file, line, key, value, constraint.
#pragma once

#include <filesystem>
#include <string>

#include "common/core/error.hpp"
#include "common/io/config/daemon_keys.hpp"

namespace brainshift::io {

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

}  // namespace brainshift::io
