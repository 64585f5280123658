// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/main/exit_status.hpp"

#include <algorithm>
#include <cstdio>

namespace brainshift::server {

int print_error(const Error& error) {
  std::string line = error.message;
  std::replace(line.begin(), line.end(), '\n', ' ');
  std::fprintf(stderr, "brainshiftd: %s\n", line.c_str());
  return exit_status(error.code);
}

}  // namespace brainshift::server
