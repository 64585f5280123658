// SPDX-License-Identifier: GPL-3.0-or-later
// Problem and calibration files.
#include "common/io/config/calibration_file.hpp"
#include "common/io/config/problem_file.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/fuzz/scratch_file.hpp"

namespace brainshift::fuzz {

void run(std::string_view bytes) {
  (void)io::parse_problem(std::string(bytes), "/problems/fuzz.yaml");
  (void)io::read_calibration(scratch_file("calibration.yaml", bytes));
}

}  // namespace brainshift::fuzz
