// SPDX-License-Identifier: GPL-3.0-or-later
// What happens in each simulated surgery.
//
// A surgery is a series of moments. Every instrument makes one observation at
// each of them. The brain is in equilibrium (drained, common/fem/elasticity.hpp)
// under gravity, with the fluid at the moment's level, and under one swelling, one volume change
// and one spatula (load.hpp) that do not change. Part of the tumour may be gone
// (resection.hpp). Each moment has its own truth, points and noise.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/tools/twin/load.hpp"
#include "client/tools/twin/resection.hpp"

namespace brainshift::client {

enum class Measurement {
  kDisplacements,  // points of the tumour's surface with noisy displacements, as in the paper
  kProbeSections,  // boundary points on planar ultrasound sections, to be registered by ICP
};

// What a stereo camera and a tracker of vessels see of the exposed
// cortex, seconds after the ultrasound.
struct CortexView {
  double points_per_mm2 = 1.0;  // of the surface
  double noise_sd_mm = 0.5;     // of a surface point, per component
  // Error of the camera's pose, drawn anew for every view: shift per
  // axis, and turn per axis about the craniotomy's centre.
  double pose_sd_mm = 0.2;
  double pose_sd_deg = 0.2;
  // Points of the surface that are found again, e.g. forks of vessels.
  int tracks = 0;
  double track_noise_sd_mm = 0.5;  // of the noise's magnitude
};

// Errors of the ultrasound probe that no estimate is told of. 0: none.
struct ProbeErrors {
  // Drawn for every section: shift per axis, and turn per axis about the tumour's centre.
  double tracker_sd_mm = 0.0, tracker_sd_deg = 0.0;
  // Drawn once for a surgery: the same, and that of distances from the probe, no unit.
  double calibration_sd_mm = 0.0, calibration_sd_deg = 0.0, scale_sd = 0.0;
  // Of the tumour's extent across the sections, from a side that is drawn for each of the two
  // sweeps. Above 0, at most 1.
  double swept_part = 1.0;
  std::uint64_t tracker_seed = 0, calibration_seed = 0, sweep_seed = 0;
};

// What else differs from what the case says; adverse.hpp tells what and how much.
struct Adversity {
  bool other_mesh = false;
  std::optional<std::uint64_t> gap_seed;     // absent: the case's gap
  double penalty_factor = 1.0;               // of the case's contact penalty
  std::optional<std::uint64_t> tissue_seed;  // absent: no tissue differs from the others
  double level_error_mm = 0.0;               // added to every fluid level
  Vec3 gravity_error_deg = Vec3::Zero();     // gravity turns about this axis by its length
  double segmentation_sd_mm = 0.0;           // of the outline, along its normal
  std::uint64_t segmentation_seed = 0;
  ProbeErrors probe;
};

struct Scenario {
  std::string name;
  std::string description;
  // For each moment: how far the fluid has drained, as a depth along gravity below the lowest
  // craniotomy node, mm. Not empty.
  std::vector<double> fluid_levels_mm;
  double interval_s = 30.0;  // between moments
  Swelling swelling;         // around the tumour's centroid
  VolumeChange volume;       // of the brain or a half of it
  // Largest volume strain by which a variation (variation.hpp) lets the brain shrink.
  double largest_shrinkage = 0.0;
  std::optional<Resection> resection;    // absent: all tissue is there
  std::optional<Retraction> retraction;  // absent: nothing touches the cortex
  // Unknown stiffness: ln of the shear modulus varies smoothly, with this standard deviation over
  // this length (stiffness.hpp). Grey and white matter differ by some 30 %, and so do patients.
  double stiffness_sd = 0.0;
  double stiffness_length_mm = 20.0;
  // Error of the known pose: gravity pulls at this angle to the direction that the case states.
  // The head is turned about the axis from the tumour to the craniotomy.
  double gravity_tilt_deg = 0.0;
  // A further error of the pose, after that one: gravity turns about this axis (RAS) by the
  // vector's length.
  Vec3 gravity_turn_deg = Vec3::Zero();
  // Mean displacement of the tumour's surface. The load is multiplied by what makes it so large: a
  // brain that is softer by this factor under the same load. Absent: the load as it is.
  std::optional<double> tumour_displacement_mm;
  Adversity adverse;
  // The scenario promises that no slave touches the skull. Where one does, playing it is an error.
  bool contact_free = false;
  Measurement measurement = Measurement::kDisplacements;
  int sparse_points = 200;           // kDisplacements
  double noise_sd_mm = 0.51;         // of the noise's magnitude: half a pixel (paper 2.6)
  double section_spacing_mm = 3.0;   // kProbeSections: between parallel probe planes
  double point_spacing_mm = 0.2;     // kProbeSections: along a section (paper 2.5)
  std::optional<CortexView> cortex;  // absent: nothing looks at the exposed cortex
};

const std::vector<Scenario>& all_scenarios();
const Scenario* find_scenario(const std::string& name);  // nullptr when unknown

}  // namespace brainshift::client
