// SPDX-License-Identifier: GPL-3.0-or-later
// Simulated B-mode ultrasound of a head whose MRI is known, through the craniotomy, dura closed.
//
// Along every beam, r mm from the array:
//   echo(r) = | t(r) (s(x) g(r) + q |dz/dr|) + noise |
//   t(r)    = 10^(-attenuation r / 20) prod(1 - loss |step of z|), over all steps before r
//   pixel   = 1 + 254 (1 + 20 log10(echo / brightest) / dynamic range), clamped to 1 .. 255;
//             0 outside the sector
// s: scatter of the tissue at x, z: its impedance (tissue_echo.hpp), both averaged over the slice
// g: complex circular Gaussian noise of unit variance, smoothed by the
// point spread (Gaussian along
//    and across); |g| has the Rayleigh statistics of speckle
// A beam that enters the brain meets dura within the opening and bone
// beside it; a beam that leaves the brain meets bone. Bone is a bright
// line, and behind it there is only the receiver's noise.
//
// Made for judging registration, after no particular machine: no refraction, no side lobes, no
// reverberation, and the same speed of sound everywhere.
// Sources: Goodman, Speckle Phenomena in Optics (2007), ch. 3; Wagner
// et al., IEEE Trans. Sonics Ultrason. 30 (1983).
#pragma once

#include "client/tools/twin/tissue_echo.hpp"
#include "common/configuration/case_config.hpp"
#include "common/core/random.hpp"
#include "common/tracking/recording.hpp"

namespace brainshift::client {

// The opening in the skull: an ellipse in the plane tangential to the brain.
struct ProbeWindow {
  Vec3 centre = Vec3::Zero();  // on the brain's surface
  Vec3 outward = Vec3::UnitX();
  Vec3 along = Vec3::UnitY();  // of the long axis; unit, at right angles to `outward`
  double half_long_mm = 22.5, half_short_mm = 12.0;
};

// From the brain's mask and the case's craniotomy. kEmptySet: the brain's surface is more than 30
// mm away from the craniotomy's centre.
Result<ProbeWindow> probe_window(const VoxelImage& brain, const Craniotomy& craniotomy);

// A curved array that is tilted about the middle of the window.
struct UltrasoundProbe {
  double array_radius_mm = 12.0;
  double half_angle_deg = 40.0;  // of the sector
  double standoff_mm = 3.0;      // dura and fluid between the array and the brain
  double depth_mm = 80.0;        // of the image, from the array; the paper's frames
  double pixel_mm = 0.5;
  int beams = 161;
  double sample_mm = 0.25;  // along a beam
  // The point spread: along the beam, across it, and out of the image plane.
  double range_sd_mm = 0.35;
  double lateral_sd_deg = 0.6;
  double slice_sd_mm = 1.0;
  double attenuation_db_mm = 0.1;  // that remains after the gain by depth
  double dynamic_range_db = 60.0;
  // The echo that is drawn white, in the units of scatter (tissue_echo.hpp)
  double brightest = 2.0;
  double noise = 1e-3;  // the receiver's floor, in the same units
};

// Two sweeps whose planes are at right angles, each a fan of tilted planes.
struct UltrasoundSweep {
  Vec3 target = Vec3::Zero();  // a point on both middle planes, e.g. the tumour's centroid
  int frames_per_sweep = 21;
  double tilt_deg = 22.0;  // of the outermost planes to either side
  double period_s = 0.1;
};

// 8-bit frames, each with its exact transform ImageToRas: x_ras = T (u, v, 0). All chance comes
// from `random`. Precondition: positive sizes, at least one frame, the target inside the head.
tracking::Recording simulate_ultrasound(const TissueEcho& tissue, const ProbeWindow& window,
                                        const UltrasoundProbe& probe, const UltrasoundSweep& sweep,
                                        Random& random);

}  // namespace brainshift::client
