// SPDX-License-Identifier: Apache-2.0
#include "common/configuration/case_config.hpp"

#include <algorithm>

namespace brainshift {

double largest_poisson_ratio(const Material& material) {
  double largest = material.poisson_ratio;
  if (material.tumour) largest = std::max(largest, material.tumour->poisson_ratio);
  for (const auto& [label, tissue] : material.regions) {
    largest = std::max(largest, tissue.poisson_ratio);
  }
  return largest;
}

}  // namespace brainshift
