// SPDX-License-Identifier: Apache-2.0
// How long work reports where it is.
#pragma once

#include <functional>
#include <string_view>

namespace brainshift {

// Called with the stage's name and the fraction done in [0, 1]; may be empty.
using Progress = std::function<void(std::string_view stage, double fraction)>;

inline void report(const Progress& progress, std::string_view stage, double fraction) {
  if (progress) progress(stage, fraction);
}

}  // namespace brainshift
