// SPDX-License-Identifier: GPL-3.0-or-later
// brainshiftd serve: the daemon, during surgery.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace brainshift::server {

struct ServeArguments {
  std::filesystem::path config_file;
  std::optional<std::filesystem::path> model;  // instead of the configuration's
  std::optional<std::string> endpoint;         // instead of the configuration's
};

// Prints "listening on <endpoint>" to stdout once clients can connect; serves until SIGINT or
// SIGTERM. Returns the exit status.
int run_serve(const ServeArguments& arguments);

}  // namespace brainshift::server
