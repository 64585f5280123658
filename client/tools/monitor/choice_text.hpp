// SPDX-License-Identifier: GPL-3.0-or-later
// A viewer's choice as it is written on a command line.
//
//   length   40mm, 0.1mm                  a number with its unit; mm is the only one
//   region   brain                        everything
//            tumour:40mm                  the tumour and what lies within 40 mm of it
//            -30,12.5,44:40mm             a ball: centre (patient RAS, mm) and radius
#pragma once

#include <string>
#include <string_view>

#include "common/core/error.hpp"
#include "common/values/session_state.hpp"

namespace brainshift::client {

struct ChoiceText {
  std::string region = "brain";
  std::string spacing = "0mm";    // 0mm: every node
  std::string tolerance = "0mm";  // 0mm: every node of every update
  bool without_sd = false;
};

// kInvalidArgument or kNotFinite: the sentence names the option, its text and what it must be.
Result<FieldChoice> parse_choice(const ChoiceText& text);
// A length in mm. kInvalidArgument: the sentence names the option, its text and what it must be.
Result<double> parse_length(std::string_view option, std::string_view text);

}  // namespace brainshift::client
