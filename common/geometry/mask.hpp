// SPDX-License-Identifier: GPL-3.0-or-later
// Brain masks: voxels, centre, threshold, largest component, closing, smoothing.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::geometry {

// Calls visit(v, x) for every voxel v whose value `is` takes, in the image's order; x: its centre,
// mm RAS.
template <typename Is, typename Visit>
void for_each_voxel(const VoxelImage& image, const Is& is, const Visit& visit) {
  std::size_t v = 0;
  for (int k = 0; k < image.dims[2]; ++k) {
    for (int j = 0; j < image.dims[1]; ++j) {
      for (int i = 0; i < image.dims[0]; ++i, ++v) {
        if (is(image.values[v])) visit(v, Vec3(image.T_ras_voxel * Vec3(i, j, k)));
      }
    }
  }
}

// Of the voxels > 0: the mean of their centres (mm RAS; 0 without any), between which places these
// lie (low above high without any), and their volume.
struct MaskCentre {
  Vec3 centre = Vec3::Zero();
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
  double volume_mm3 = 0.0;
};
MaskCentre mask_centre(const VoxelImage& mask);

// Whether the voxel at x, mm RAS, is > 0; false outside of the image. T_voxel_ras: the inverse of
// the mask's own transform.
bool mask_has(const VoxelImage& mask, const AffineTransform& T_voxel_ras, const Vec3& x);

// 1 where the voxel is > 0 and belongs to the largest 6-connected component, or to a cavity of
// it; else 0. A cavity is a 6-connected set of other voxels that does not reach the border of the
// image. Of components with the same size, the one with the lowest voxel index wins. NaN counts
// as not > 0. Linear time, by run-length union-find. kEmptySet when no voxel is > 0.
Result<VoxelImage> largest_component(const VoxelImage& image);

// The 6-connected components of the voxels that are > 0, largest first; of equal ones the one with
// the lowest voxel index.
struct MaskParts {
  std::vector<std::int32_t> part_of_voxel;  // -1: none
  std::vector<std::size_t> voxels;          // of each part
};
MaskParts mask_parts(const VoxelImage& image);

// Morphological closing (Serra 1982, Image Analysis and Mathematical Morphology) by a ball of
// radius_mm >= 0: 1 where the voxel is > 0, or where no ball that avoids all such voxels reaches;
// else 0. Gaps narrower than twice the radius are filled. Voxels beyond the image are 0.
VoxelImage close_gaps(const VoxelImage& image, double radius_mm);

// Gaussian smoothing with standard deviation sigma_mm >= 0 (per axis, mm). Voxels outside the
// image count as zero. Separable along the voxel axes, cut off at 3.5 sigma and normalised;
// isotropic when the columns of the affine are orthogonal. An axis whose sigma is less than a
// tenth of a voxel is left as it is.
VoxelImage gaussian_smooth(const VoxelImage& image, double sigma_mm);

// Trilinear interpolation at a point (mm RAS). Voxels beyond the image count as 0, so the value
// falls linearly to 0 within one voxel of the outermost centres. It is a class because it inverts
// the affine once. Precondition: the affine is invertible.
class Interpolator {
 public:
  explicit Interpolator(const VoxelImage& image);  // keeps a reference
  float operator()(const Vec3& x_ras) const;

 private:
  const VoxelImage& image_;
  AffineTransform T_voxel_ras_;
};

}  // namespace brainshift::geometry
