// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/image_registration_input.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <utility>

namespace brainshift::registration {
namespace {

constexpr Eigen::Index kLeastSamples = 500;  // some thirty in each of half the bins

Status refuse(std::string text) { return fail(ErrorCode::kInvalidArgument, std::move(text)); }

}  // namespace

Status check_options(const ImageRegistrationOptions& options) {
  if (options.levels.empty()) return refuse("image registration: levels: none given");
  for (const ImageLevel& level : options.levels)
    if (!(level.smoothing_mm >= 0.0 && level.smoothing_mm <= 20.0) || level.samples < kLeastSamples)
      return refuse(
          fmt::format("image registration: level of smoothing_mm = {:g} and samples = {}: must be "
                      "0 to 20 and at least {}",
                      level.smoothing_mm, level.samples, kLeastSamples));
  if (options.bins < 8 || options.bins > 256)
    return refuse(fmt::format("image registration: bins = {}: must be 8 to 256", options.bins));
  if (!(options.low_quantile >= 0.0 && options.low_quantile < options.high_quantile &&
        options.high_quantile <= 1.0))
    return refuse(
        fmt::format("image registration: quantiles {:g} and {:g}: must be 0 <= low < "
                    "high <= 1",
                    options.low_quantile, options.high_quantile));
  struct Bound {
    const char* name;
    double value, low, high;
  };
  for (const Bound& bound : {Bound{"start_offset_mm", options.start_offset_mm, 0.0, 50.0},
                             Bound{"max_iterations", 1.0 * options.max_iterations, 1.0, 1e4},
                             Bound{"max_translation_mm", options.max_translation_mm, 0.1, 200.0},
                             Bound{"max_rotation_deg", options.max_rotation_deg, 0.1, 90.0},
                             Bound{"min_overlap", options.min_overlap, 0.05, 1.0},
                             Bound{"same_pose_mm", options.same_pose_mm, 1e-3, 50.0}})
    if (!(bound.value >= bound.low && bound.value <= bound.high))
      return refuse(fmt::format("image registration: {} = {:g}: must be {:g} to {:g}", bound.name,
                                bound.value, bound.low, bound.high));
  return {};
}

Status check_image(const char* what, const VoxelImage& image) {
  for (int length : image.dims)
    if (length < 2)
      return refuse(
          fmt::format("image registration: {} of {} x {} x {} voxels: at least 2 needed "
                      "along each axis",
                      what, image.dims[0], image.dims[1], image.dims[2]));
  if (image.values.size() != image.num_voxels())
    return refuse(fmt::format("image registration: {} holds {} values for {} voxels", what,
                              image.values.size(), image.num_voxels()));
  const double volume = image.T_ras_voxel.linear().determinant();
  if (!image.T_ras_voxel.matrix().allFinite() || !(std::abs(volume) > 1e-9))
    return refuse(fmt::format("image registration: {} with voxels of {:g} mm3: no usable affine",
                              what, volume));
  for (std::size_t i = 0; i < image.values.size(); ++i)
    if (!std::isfinite(image.values[i]))
      return fail(ErrorCode::kNotFinite,
                  fmt::format("image registration: {} voxel {} is not finite", what, i));
  return {};
}

Status check_samples(const IntensitySamples& samples) {
  const Eigen::Index count = samples.positions.cols();
  if (samples.intensities.size() != count)
    return refuse(fmt::format("image registration: {} positions and {} intensities", count,
                              samples.intensities.size()));
  if (count < kLeastSamples)
    return refuse(
        fmt::format("image registration: {} samples: at least {} needed", count, kLeastSamples));
  for (Eigen::Index i = 0; i < count; ++i)
    if (!samples.positions.col(i).allFinite() || !std::isfinite(samples.intensities[i]))
      return fail(ErrorCode::kNotFinite,
                  fmt::format("image registration: sample {} is not finite", i));
  return {};
}

}  // namespace brainshift::registration
