// SPDX-License-Identifier: GPL-3.0-or-later
// The head and its field as arrays for the page: little-endian, x fastest, one behind the other.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "client/tools/volume/grid_sampler.hpp"
#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::client {

// The MRI on a grid of 1 mm around the brain: uint8, black at the 1st percentile of what is not
// zero, white at the 99.5th; trilinear, 0 outside of the image.
struct GreyVolume {
  FieldGrid grid;
  std::string voxels;
};
Result<GreyVolume> grey_volume(const VoxelImage& mri, const Points& nodes);

// Fields of one model on a grid of kSpacing_mm around the brain.
//   int16   3 per voxel   displacement, 1/512 mm; falls to zero outside of the brain
//   uint16  1 per voxel   standard deviation, um; 65535: none, as outside of the brain
//   uint8   1 per voxel   what the data know, 1/250; 255: none
class FieldVolume {
 public:
  static constexpr double kSpacing_mm = 2.0;

  static Result<FieldVolume> build(const BrainModel& model);
  const FieldGrid& grid() const { return sampler_.grid(); }
  // One byte per voxel: 1 in the brain.
  const std::string& inside() const { return inside_; }
  // sd_mm and known may be empty. Precondition: one column and entry per node, finite.
  struct Encoded {
    std::string bytes;
    double grid_error_mm = 0.0;  // of trilinear interpolation, at the nodes
  };
  Encoded encode(const Points& u, const VecX& sd_mm, const VecX& known) const;

 private:
  explicit FieldVolume(GridSampler sampler) : sampler_(std::move(sampler)) {}
  GridSampler sampler_;
  std::string inside_;
};

}  // namespace brainshift::client
