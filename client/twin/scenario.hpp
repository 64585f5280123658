// SPDX-License-Identifier: GPL-3.0-or-later
// What happens in each simulated surgery.
//
// A surgery is a series of moments, one observation each. At every moment the brain is in equilibrium (drained,
// see common/fem/elasticity.hpp) under gravity with the fluid at that moment's level, plus one swelling that does
// not change; each moment has its own truth, its own choice of points and its own noise.
#pragma once

#include <string>
#include <vector>

#include "client/twin/load.hpp"

namespace brainshift::twin {

enum class Measurement {
  kDisplacements,  // 200 tumour surface points with noisy displacements (the paper's simulated data)
  kProbeSections,  // iUS-like boundary points on planar probe sections, to be registered by ICP
};

struct Scenario {
  std::string name;
  std::string description;
  // Per moment: depth below the lowest craniotomy node to which the surrounding fluid has drained, along
  // gravity, mm. Not empty.
  std::vector<double> fluid_levels_mm;
  double interval_s = 30.0;  // between moments
  Swelling swelling;         // around the tumour's centroid
  // The scenario promises that no slave touches the skull; a case in which one does is refused.
  bool contact_free = false;
  Measurement measurement = Measurement::kDisplacements;
  int sparse_points = 200;          // kDisplacements
  double noise_sd_mm = 0.51;        // magnitude of the noise vector: half a pixel (paper 2.6)
  double section_spacing_mm = 3.0;  // kProbeSections: between parallel probe planes
  double point_spacing_mm = 0.2;    // kProbeSections: along a section (paper 2.5)
};

const std::vector<Scenario>& all_scenarios();
const Scenario* find_scenario(const std::string& name);  // nullptr when unknown

}  // namespace brainshift::twin
