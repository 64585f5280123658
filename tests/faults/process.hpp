// SPDX-License-Identifier: GPL-3.0-or-later
// The programs under test, and one of them run as a child, with what it prints.
#pragma once

#include <string>
#include <vector>

namespace brainshift::faults {

struct Finished {
  int exit_status = -1;  // -1: ended by a signal, or did not end in time and was killed
  std::string out;
  std::string err;
};

std::string brainshiftd();
std::string brainshift();

// argv[0] is the program. Kills it after limit_s, ten times that with sanitizers.
Finished run(const std::vector<std::string>& argv, double limit_s = 120.0);

}  // namespace brainshift::faults
