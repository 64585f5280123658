// SPDX-License-Identifier: GPL-3.0-or-later
// Daemon files.
#include "common/io/config/daemon_file.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/fuzz/scratch_file.hpp"

namespace brainshift::fuzz {

void run(std::string_view bytes) {
  const auto config = io::read_daemon_config(scratch_file("daemon.yaml", bytes));
  if (!config) return;
  require(io::check_endpoint(config->endpoint, config->allow_remote).has_value(),
          "an endpoint that was read may be served");
  require(io::check_security(*config).has_value(),
          "a daemon that was read is this machine's alone, or has keys");
}

}  // namespace brainshift::fuzz
