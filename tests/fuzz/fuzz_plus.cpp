// SPDX-License-Identifier: GPL-3.0-or-later
// PLUS device sets.
#include "common/io/config/plus_config.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/fuzz/scratch_file.hpp"

namespace brainshift::fuzz {

void run(std::string_view bytes) {
  const auto links = io::read_plus_config(scratch_file("device.xml", bytes));
  if (!links) return;
  for (const tracking::ConstantLink& link : *links) {
    require(link.T_to_from.matrix().allFinite(), "a transform goes somewhere");
  }
}

}  // namespace brainshift::fuzz
