// SPDX-License-Identifier: GPL-3.0-or-later
// Simulated ultrasound and MRI of a head: what its tissue looks like, and B-mode images of it.
//
// The T1 intensity, relative to white matter, tells cerebrospinal fluid (below about 0.5), cortex
// (about 0.73) and white matter (1) apart. Echoes are no function of it, as in life:
//
//              sulci, fissures   ventricles   cortex   white matter   tumour        outside
//   scatter    0.8               0.006        0.08     0.12           0.5, uneven   0.01
//   impedance  0                 0            0.5      0.4            0.9           0
//
// Both kinds of fluid are dark in MRI. In ultrasound sulci and fissures, the falx among them, are
// bright for their vessels and membranes; ventricles are dark. Fluid counts as a ventricle where
// most of what lies within some millimetres is fluid. Jumps of the impedance make the bright lines
// of boundaries. The relative amplitudes were set by eye once, after Unsgaard et al., Acta
// Neurochir. 148 (2006).
#pragma once

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/core/random.hpp"
#include "common/tracking/recording.hpp"

namespace brainshift::client {

struct TissueEcho {
  VoxelImage scatter, impedance;
  VoxelImage brain;  // 0 to 1, smoothed mask
};

// mri: T1, of the head or the brain; brain: > 0 is brain, on the same voxels; tumour: closed
// surface. kInvalidArgument: brain has other voxels; kEmptySet: no brain; errors of
// geometry::ClosestPointIndex.
Result<TissueEcho> tissue_echo(const VoxelImage& mri, const VoxelImage& brain,
                               const TriangleSurface& tumour);

// How a tumour looks in MRI: a rim that takes up contrast agent, a darker core, and noise.
// Intensities and the noise's standard deviation are relative to white matter.
struct TumourAppearance {
  double rim = 1.4, core = 0.6;
  double rim_mm = 4.0, noise = 0.03;
  std::uint64_t seed = 1;
};
// The MRI with the tumour drawn into it. Arguments and errors as above.
Result<VoxelImage> mri_with_tumour(const VoxelImage& mri, const VoxelImage& brain,
                                   const TriangleSurface& tumour,
                                   const TumourAppearance& appearance = {});

// Simulated B-mode ultrasound of a head whose MRI is known, through the craniotomy, dura closed.
//
// Along every beam, r mm from the array:
//   echo(r) = | t(r) (s(x) g(r) + q |dz/dr|) + noise |
//   t(r)    = 10^(-attenuation r / 20) prod(1 - loss |step of z|), over all steps before r
//   pixel   = 1 + 254 (1 + 20 log10(echo / brightest) / dynamic range), clamped to 1 .. 255;
//             0 outside the sector
// s: scatter of the tissue at x, z: its impedance, both averaged over the slice
// g: complex circular Gaussian noise of unit variance, smoothed by the point spread (Gaussian along
//    and across); |g| has the Rayleigh statistics of speckle
// A beam that enters the brain meets dura within the opening and bone beside it; a beam that leaves
// the brain meets bone. Bone is a bright line, and behind it there is only the receiver's noise.
//
// Made for judging registration, after no particular machine: no refraction, no side lobes, no
// reverberation, and the same speed of sound everywhere.
// Sources: Goodman, Speckle Phenomena in Optics (2007), ch. 3; Wagner et al., IEEE Trans. Sonics
// Ultrason. 30 (1983).
//
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
  double range_sd_mm = 0.35, lateral_sd_deg = 0.6, slice_sd_mm = 1.0;
  double attenuation_db_mm = 0.1;  // that remains after the gain by depth
  double dynamic_range_db = 60.0;
  // The echo that is drawn white, in the units of scatter
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
