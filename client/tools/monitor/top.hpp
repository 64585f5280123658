// SPDX-License-Identifier: GPL-3.0-or-later
// `brainshift top`: asks a daemon again and again, and shows its report.
//
// On a terminal the page is drawn in place, on the alternate screen, until q or Ctrl-C. Lines that
// need attention are red as well. On anything else one line is printed each time. While the daemon
// does not answer, the last page stays, and the first line says for how long: STALE.
#pragma once

#include <unistd.h>

#include <chrono>
#include <optional>
#include <string>

#include "client/lib/client_keys.hpp"
#include "common/core/error.hpp"

namespace brainshift::client {

struct TopOptions {
  std::string endpoint;
  std::chrono::milliseconds interval{1000};
  bool once = false;  // one whole page with the rates of one interval, wherever it goes
  int input = STDIN_FILENO;
  int output = STDOUT_FILENO;
  std::optional<ClientKeys> keys = std::nullopt;  // for a daemon that asks for keys
};

// Returns when it is told to end (q, SIGINT, SIGTERM), or when the output takes no more. Catches
// both signals meanwhile. Errors: as Client::connect; with `once` also as Client::report.
Status top(const TopOptions& options);

}  // namespace brainshift::client
