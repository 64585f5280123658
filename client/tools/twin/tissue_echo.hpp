// SPDX-License-Identifier: GPL-3.0-or-later
// What tissue looks like to ultrasound and to MRI, for simulated surgeries.
//
// The T1 intensity, relative to white matter, tells cerebrospinal fluid (below about 0.5), cortex
// (about 0.73) and white matter (1) apart. Echoes are no function of it, as in life:
//
//              sulci, fissures   ventricles   cortex   white matter   tumour        outside
//   scatter    0.8               0.006        0.08     0.12           0.5, uneven   0.01
//   impedance  0                 0            0.5      0.4            0.9           0
//
// Both kinds of fluid are dark in MRI. In ultrasound sulci and fissures, the falx
// among them, are bright for their vessels and membranes; ventricles are dark. Fluid
// counts as a ventricle where most of what lies within some millimetres is fluid.
// Jumps of the impedance make the bright lines of boundaries. The relative amplitudes
// were set by eye once, after Unsgaard et al., Acta Neurochir. 148 (2006).
#pragma once

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::client {

struct TissueEcho {
  VoxelImage scatter;
  VoxelImage impedance;
  VoxelImage brain;  // 0 to 1, smoothed mask
};

// mri: T1, of the head or the brain; brain: > 0 is brain, on the same
// voxels; tumour: closed surface.
// kInvalidArgument: brain has other voxels; kEmptySet: no brain;
// errors of geometry::ClosestPointIndex.
Result<TissueEcho> tissue_echo(const VoxelImage& mri, const VoxelImage& brain,
                               const TriangleSurface& tumour);

// How a tumour looks in MRI: a rim that takes up contrast agent, a darker core, and noise.
// Intensities and the noise's standard deviation are relative to white matter.
struct TumourAppearance {
  double rim = 1.4, core = 0.6;
  double rim_mm = 4.0;
  double noise = 0.03;
  std::uint64_t seed = 1;
};
// The MRI with the tumour drawn into it. Arguments and errors as above.
Result<VoxelImage> mri_with_tumour(const VoxelImage& mri, const VoxelImage& brain,
                                   const TriangleSurface& tumour,
                                   const TumourAppearance& appearance = {});

}  // namespace brainshift::client
