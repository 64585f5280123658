// SPDX-License-Identifier: GPL-3.0-or-later
// What happens in each simulated surgery.
//
// A surgery is a series of moments, one observation of every instrument each. At every moment the brain is in equilibrium (drained,
// see common/fem/elasticity.hpp) under gravity with the fluid at that moment's level, plus one swelling that does
// not change; each moment has its own truth, its own choice of points and its own noise.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/twin/load.hpp"

namespace brainshift::client {

enum class Measurement {
  kDisplacements,  // 200 tumour surface points with noisy displacements (the paper's simulated data)
  kProbeSections,  // iUS-like boundary points on planar probe sections, to be registered by ICP
};

// What a stereo camera and a tracker of vessels see of the exposed cortex, some seconds after the ultrasound.
struct CortexView {
  double points_per_mm2 = 1.0;  // of the surface
  double noise_sd_mm = 0.5;     // of a surface point, per component
  double pose_sd_mm = 0.2;      // of the camera's pose, drawn anew for every view: shift per axis,
  double pose_sd_deg = 0.2;     // turn per axis about the craniotomy's centre
  int tracks = 0;               // points of the surface that are found again, e.g. forks of vessels
  double track_noise_sd_mm = 0.5;  // magnitude
};

struct Scenario {
  std::string name;
  std::string description;
  // Per moment: depth below the lowest craniotomy node to which the surrounding fluid has drained, along
  // gravity, mm. Not empty.
  std::vector<double> fluid_levels_mm;
  double interval_s = 30.0;  // between moments
  Swelling swelling;         // around the tumour's centroid
  // Unknown stiffness: ln of the shear modulus varies smoothly with this standard deviation over this length
  // (stiffness.hpp). Grey and white matter, and one patient and another, differ by some 30 %.
  double stiffness_sd = 0.0;
  double stiffness_length_mm = 20.0;
  // The head is turned about the axis of the craniotomy after its pose was told: gravity pulls that much beside the
  // direction the case knows.
  double gravity_tilt_deg = 0.0;
  // The scenario promises that no slave touches the skull; a case in which one does is refused.
  bool contact_free = false;
  Measurement measurement = Measurement::kDisplacements;
  int sparse_points = 200;           // kDisplacements
  double noise_sd_mm = 0.51;         // magnitude of the noise vector: half a pixel (paper 2.6)
  double section_spacing_mm = 3.0;   // kProbeSections: between parallel probe planes
  double point_spacing_mm = 0.2;     // kProbeSections: along a section (paper 2.5)
  std::optional<CortexView> cortex;  // cameras look at the exposed cortex, too
};

const std::vector<Scenario>& all_scenarios();
const Scenario* find_scenario(const std::string& name);  // nullptr when unknown

}  // namespace brainshift::client
