// SPDX-License-Identifier: GPL-3.0-or-later
// Case files.
#include "common/io/config/config_file.hpp"
#include "tests/fuzz/fuzz_target.hpp"

namespace brainshift::fuzz {

void run(std::string_view bytes) {
  const auto config = io::parse_case_config(std::string(bytes), "/cases/fuzz.yaml");
  if (!config) return;
  const std::string text = io::case_config_text(*config);
  require(io::parse_case_config(text, "/cases/fuzz.yaml").has_value(),
          "a case that was read and written can be read again");
}

}  // namespace brainshift::fuzz
