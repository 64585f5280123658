// SPDX-License-Identifier: Apache-2.0
// Progress: the callback by which a long computation reports how far it is.
#pragma once

#include <functional>
#include <string_view>

namespace brainshift {

// Called with the name of the stage and the fraction done in [0, 1]. An empty function is
// allowed.
using Progress = std::function<void(std::string_view stage, double fraction)>;

inline void report(const Progress& progress, std::string_view stage, double fraction) {
  if (progress) progress(stage, fraction);
}

}  // namespace brainshift
