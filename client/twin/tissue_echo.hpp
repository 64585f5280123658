// SPDX-License-Identifier: GPL-3.0-or-later
// What tissue looks like to ultrasound and to MRI, for simulated surgeries.
//
// T1 intensity f, relative to white matter, tells cerebrospinal fluid (below about 0.5), cortex (about 0.73) and white
// matter (1). Echoes are no function of it, as in life:
//
//                 fluid in sulci, fissures   fluid in ventricles   cortex   white matter   tumour        outside
//   scatter       0.8                        0.006                 0.08     0.12           0.5, uneven   0.01
//   impedance     0                          0                     0.5      0.4            0.9           0
//
// Sulci and fissures, the falx among them, are bright for their vessels and membranes; ventricles are not, though
// both are equally dark in MRI. Jumps of the impedance make the bright lines of boundaries. Fluid belongs to a
// ventricle where most of what is within some millimetres is fluid. Relative amplitudes, set by eye once, after what
// is bright and what is dark in Unsgaard et al., Acta Neurochir. 148 (2006).
#pragma once

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::client {

struct TissueEcho {
  VoxelImage scatter;
  VoxelImage impedance;
  VoxelImage brain;  // 0 to 1, smoothed mask
};

// mri: T1, head or brain; brain: > 0 is brain, on the same voxels; tumour: closed. kInvalidArgument: other voxels;
// kEmptySet: no brain; errors of geometry::ClosestPointIndex.
Result<TissueEcho> tissue_echo(const VoxelImage& mri, const VoxelImage& brain,
                               const TriangleSurface& tumour);

// The MRI with the tumour in it: a rim `rim_mm` thick that takes up contrast agent, a darker core, and noise
// (standard deviations and intensities relative to white matter).
struct TumourAppearance {
  double rim = 1.4, core = 0.6;
  double rim_mm = 4.0;
  double noise = 0.03;
  std::uint64_t seed = 1;
};
Result<VoxelImage> mri_with_tumour(const VoxelImage& mri, const VoxelImage& brain,
                                   const TriangleSurface& tumour,
                                   const TumourAppearance& appearance = {});

}  // namespace brainshift::client
