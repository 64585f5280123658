// SPDX-License-Identifier: GPL-3.0-or-later
// brainshiftd health: whether a daemon answers; for containers and scripts.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "common/core/error.hpp"

namespace brainshift::server {

struct HealthArguments {
  std::filesystem::path config_file;    // of the daemon to ask
  std::optional<std::string> endpoint;  // instead of the configuration's
};

// Where a client on the daemon's own machine reaches it: 127.0.0.1 and ::1 stand for "all
// interfaces". kInvalidArgument for a port that the system chooses (*): only the daemon knows it.
Result<std::string> endpoint_to_ask(const std::string& endpoint);

// Asks the daemon for its status, with the daemon's own key where it asks for keys. Prints one
// line: "ok version=... case=... updates=...". Returns the exit status: 0 when it answers within
// 3 s, with or without a model; 1 when it does not.
int run_health(const HealthArguments& arguments);

}  // namespace brainshift::server
