// SPDX-License-Identifier: GPL-3.0-or-later
// What happens in each simulated surgery.
#pragma once

#include <string>
#include <vector>

namespace brainshift::twin {

enum class Measurement {
  kDisplacements,  // 200 tumour surface points with noisy displacements (the paper's simulated data)
  kProbeSections,  // iUS-like boundary points on planar probe sections, to be registered by ICP
};

struct Scenario {
  std::string name;
  std::string description;
  // Depth below the lowest craniotomy node to which the surrounding fluid has drained, along gravity, mm.
  double fluid_level_mm = 0.0;
  Measurement measurement = Measurement::kDisplacements;
  int sparse_points = 200;          // kDisplacements
  double noise_sd_mm = 0.51;        // magnitude of the noise vector: half a pixel (paper 2.6)
  double section_spacing_mm = 3.0;  // kProbeSections: between parallel probe planes
  double point_spacing_mm = 0.2;    // kProbeSections: along a section (paper 2.5)
};

const std::vector<Scenario>& all_scenarios();
const Scenario* find_scenario(const std::string& name);  // nullptr when unknown

}  // namespace brainshift::twin
