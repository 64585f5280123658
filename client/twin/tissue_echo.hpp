// SPDX-License-Identifier: GPL-3.0-or-later
// What tissue looks like to ultrasound and to MRI, for simulated surgeries.
//
// T1 intensity f, relative to white matter, tells cerebrospinal fluid (f < 0.5), cortex (about 0.73) and white matter (1);
// echoes are no function of it, as in life:
//   scatter s   white matter 0.5, cortex 0.3; fluid in sulci and fissures 1.6 (vessels and pia; among them the falx), fluid in
//               ventricles 0.02, though both are equally dark in MRI; tumour 1.3, uneven; outside of the brain 0.05
//   impedance z its jumps make the bright lines of boundaries: fluid 0, cortex 0.5, white matter 0.4, tumour 0.9
// Fluid belongs to a ventricle where most of what is within some millimetres is fluid. Relative numbers, chosen by eye
// after Unsgaard et al., Acta Neurochir. 148 (2006): what is bright and what is dark in ultrasound of the brain.
#pragma once

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::twin {

struct TissueEcho {
  VoxelImage scatter;
  VoxelImage impedance;
  VoxelImage brain;  // 0 to 1, smoothed mask
};

// mri: T1, head or brain; brain: > 0 is brain, on the same voxels; tumour: closed. kInvalidArgument: other voxels;
// kEmptySet: no brain; errors of geometry::ClosestPointIndex.
Result<TissueEcho> tissue_echo(const VoxelImage& mri, const VoxelImage& brain,
                               const TriangleSurface& tumour);

// The MRI with the tumour in it: a rim `rim_mm` thick that takes up contrast agent, a darker core, and noise (standard
// deviations and intensities relative to white matter).
struct TumourAppearance {
  double rim = 1.4, core = 0.6;
  double rim_mm = 4.0;
  double noise = 0.03;
  std::uint64_t seed = 1;
};
Result<VoxelImage> mri_with_tumour(const VoxelImage& mri, const VoxelImage& brain,
                                   const TriangleSurface& tumour,
                                   const TumourAppearance& appearance = {});

}  // namespace brainshift::twin
