// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/ultrasound/frame_samples.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace brainshift::ultrasound {
namespace {

// A block of pixels that belongs to the image: its corner.
struct Block {
  Eigen::Index u, v;
};

std::vector<Block> blocks_in_sector(const Eigen::MatrixXf& largest, const PixelWindow& window,
                                    Eigen::Index size) {
  const auto right = std::min<Eigen::Index>(window.left + window.width, largest.cols());
  const auto bottom = std::min<Eigen::Index>(window.top + window.height, largest.rows());
  std::vector<Block> blocks;
  for (Eigen::Index v = std::max(window.top, 0); v + size <= bottom; v += size)
    for (Eigen::Index u = std::max(window.left, 0); u + size <= right; u += size)
      if ((largest.block(v, u, size, size).array() > 0.0f).all()) blocks.push_back({u, v});
  return blocks;
}

}  // namespace

Result<IntensitySamples> frame_samples(const tracking::Recording& recording,
                                       const ImagePoses& poses, const PixelWindow& window,
                                       int block_px) {
  const auto count = static_cast<std::size_t>(recording.num_frames());
  if (poses.size() != count)
    return invalid(fmt::format("samples of {} frames with {} poses", count, poses.size()));
  if (block_px < 1 || block_px > 100)
    return invalid(fmt::format("samples of frames: block_px = {}: must be 1 to 100", block_px));
  std::vector<int> used;
  Eigen::MatrixXf largest = Eigen::MatrixXf::Zero(recording.height, recording.width);
  for (std::size_t i = 0; i < count; ++i) {
    if (!poses[i] || !recording.image_ok[i]) continue;
    used.push_back(static_cast<int>(i));
    largest = largest.cwiseMax(recording.frame_values(used.back()));
  }
  if (used.empty())
    return fail(
        ErrorCode::kEmptySet,
        fmt::format("samples of frames: none of {} frames has a pose and a valid image", count));
  const std::vector<Block> blocks = blocks_in_sector(largest, window, block_px);
  if (blocks.empty())
    return fail(ErrorCode::kEmptySet,
                fmt::format("samples of frames: no block of {} x {} pixels in the window that is "
                            "not black in all {} frames",
                            block_px, block_px, used.size()));
  IntensitySamples samples;
  const auto total = static_cast<Eigen::Index>(used.size() * blocks.size());
  samples.positions.resize(3, total);
  samples.intensities.resize(total);
  Eigen::Index at = 0;
  for (const int frame : used) {
    const Eigen::MatrixXf values = recording.frame_values(frame);
    const double middle = 0.5 * (block_px - 1);
    for (const Block& block : blocks) {
      samples.positions.col(at) =
          *poses[static_cast<std::size_t>(frame)] *
          Vec3(static_cast<double>(block.u) + middle, static_cast<double>(block.v) + middle, 0.0);
      samples.intensities[at++] = values.block(block.v, block.u, block_px, block_px).mean();
    }
  }
  return samples;
}

}  // namespace brainshift::ultrasound
