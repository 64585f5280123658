// SPDX-License-Identifier: Apache-2.0
#include "common/values/case_config.hpp"

#include <algorithm>

#include "common/values/case_keys.hpp"

namespace brainshift {

Status validate(const CaseConfig& config) {
  KeyChecker checker;
  visit(checker, config);
  checker.require(!config.brain.empty() || !std::holds_alternative<MeshGeneration>(config.mesh),
                  "images.brain", "must name a brain mask to mesh");
  return checker.status();
}

double largest_poisson_ratio(const Material& material) {
  double largest = material.poisson_ratio;
  if (material.tumour) largest = std::max(largest, material.tumour->poisson_ratio);
  for (const auto& [label, tissue] : material.regions) {
    largest = std::max(largest, tissue.poisson_ratio);
  }
  return largest;
}

std::string_view to_string(SurfaceGuidance guidance) { return word_of(guidance, kGuidanceWords); }
std::string_view to_string(OutsideRegion outside) { return word_of(outside, kOutsideWords); }
std::string_view to_string(Carry carry) { return word_of(carry, kCarryWords); }

}  // namespace brainshift
