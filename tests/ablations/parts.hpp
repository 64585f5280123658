// SPDX-License-Identifier: GPL-3.0-or-later
// The parts of the estimate that `make ablations` asks after: what each buys. A variant differs
// from the default by one part alone: without it, or, where the default leaves it out, with it.
// tests/studies/ablations.py describes them.
#pragma once

#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "tests/evidence/estimate_session.hpp"

namespace brainshift::ablations {

struct Part {
  evidence::Variant variant;      // its name: "no-tumour-volume"; "default" for the default
  std::vector<std::string> keys;  // of the case that differ; none: something else differs
  bool slow = false;              // played for the first patient alone
};
inline constexpr const char* kDefault = "default";

// The default first. All of them are valid for every case that the default is valid for.
const std::vector<Part>& all_parts();
const Part* find_part(const std::string& variant);  // by the variant's name; nullptr when unknown
// The default and these, in the order of all_parts(). kNotFound names the one that is unknown and
// lists what is known.
Result<std::vector<Part>> parts_from(const std::vector<std::string>& variants);

}  // namespace brainshift::ablations
