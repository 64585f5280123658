// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/view/volumes.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

namespace brainshift::client {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr double kMriSpacing_mm = 1.0;
constexpr double kMriMargin_mm = 4.0;
constexpr double kFieldMargin_mm = 10.0;
constexpr float kPerMm = 512.0F;     // of a displacement
constexpr float kSdPerMm = 1000.0F;  // of a standard deviation
constexpr float kKnownScale = 250.0F;

// The image between its voxels; 0 outside of it.
float value_between(const VoxelImage& image, const Vec3& voxel) {
  const Vec3 low = voxel.array().floor();
  const Vec3 part = voxel - low;
  double sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1.0;
    std::array<int, 3> at{};
    bool inside = true;
    for (int axis = 0; axis < 3; ++axis) {
      const int step = (corner >> axis) & 1;
      weight *= step == 1 ? part[axis] : 1.0 - part[axis];
      const double place = low[axis] + step;
      const auto i = static_cast<std::size_t>(axis);
      inside = inside && place >= 0.0 && place < image.dims[i];
      at[i] = inside ? static_cast<int>(place) : 0;
    }
    if (!inside || weight == 0.0) continue;
    const float value = image.at(at[0], at[1], at[2]);
    if (std::isfinite(value)) sum += weight * value;
  }
  return static_cast<float>(sum);
}

template <typename Number>
void append(std::string& bytes, const std::vector<Number>& numbers) {
  bytes.append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number));
}

}  // namespace

Result<GreyVolume> grey_volume(const VoxelImage& mri, const Points& nodes) {
  const auto grid = grid_around(nodes, kMriMargin_mm, kMriSpacing_mm);
  if (!grid) return tl::unexpected(grid.error());
  const AffineTransform T_voxel_ras = mri.T_ras_voxel.inverse();
  std::vector<float> values(grid->num_voxels());
  std::vector<float> seen;
  for (int k = 0; k < grid->dims[2]; ++k) {
    for (int j = 0; j < grid->dims[1]; ++j) {
      for (int i = 0; i < grid->dims[0]; ++i) {
        const float value = value_between(mri, T_voxel_ras * grid->voxel_mm(i, j, k));
        values[grid->index(i, j, k)] = value;
        if (value != 0.0F) seen.push_back(value);
      }
    }
  }
  if (seen.empty()) return fail(ErrorCode::kEmptySet, "the MRI is zero all over the brain");
  const auto percentile = [&](double share) {
    const auto place = static_cast<std::ptrdiff_t>(share * static_cast<double>(seen.size() - 1));
    std::nth_element(seen.begin(), seen.begin() + place, seen.end());
    return seen[static_cast<std::size_t>(place)];
  };
  const float black = percentile(0.01);
  const float white = std::max(percentile(0.995), std::nextafter(black, 2.0F * black + 1.0F));
  GreyVolume grey{*grid, std::string(values.size(), '\0')};
  for (std::size_t v = 0; v < values.size(); ++v) {
    const float level = std::clamp((values[v] - black) / (white - black), 0.0F, 1.0F);
    grey.voxels[v] = static_cast<char>(static_cast<unsigned char>(std::lround(255.0F * level)));
  }
  return grey;
}

Result<FieldVolume> FieldVolume::build(const BrainModel& model) {
  const auto grid = grid_around(model.mesh.nodes, kFieldMargin_mm, kSpacing_mm);
  if (!grid) return tl::unexpected(grid.error());
  const geometry::TetLocator locator(model.mesh);
  auto sampler = GridSampler::build(locator, *grid);
  if (!sampler) return tl::unexpected(sampler.error());
  FieldVolume volume(std::move(*sampler));
  std::vector<float> one(grid->num_voxels());
  volume.sampler_.sample_scalar(VecX::Ones(model.mesh.nodes.cols()), one.data());
  volume.inside_.resize(one.size());
  std::transform(one.begin(), one.end(), volume.inside_.begin(),
                 [](float value) { return value > 0.5F ? '\1' : '\0'; });
  return volume;
}

FieldVolume::Encoded FieldVolume::encode(const Points& u, const VecX& sd_mm,
                                         const VecX& known) const {
  const std::size_t count = grid().num_voxels();
  std::vector<float> values(3 * count);
  sampler_.sample(u, values.data());
  Encoded encoded;
  encoded.grid_error_mm = sampler_.interpolation_error_mm(u, values.data());
  encoded.bytes.reserve(9 * count);
  std::vector<std::int16_t> shorts(3 * count);
  std::transform(values.begin(), values.end(), shorts.begin(), [](float mm) {
    return static_cast<std::int16_t>(std::lround(std::clamp(kPerMm * mm, -32767.0F, 32767.0F)));
  });
  append(encoded.bytes, shorts);
  // What is not there, as outside of the brain, is the greatest number.
  const auto scalar = [&](const VecX& nodal, float scale, float most, auto none) {
    std::vector<decltype(none)> numbers(count, none);
    if (nodal.size() > 0) {
      sampler_.sample_scalar(nodal, values.data());
      for (std::size_t v = 0; v < count; ++v) {
        if (inside_[v] == 0) continue;
        numbers[v] =
            static_cast<decltype(none)>(std::lround(std::clamp(scale * values[v], 0.0F, most)));
      }
    }
    append(encoded.bytes, numbers);
  };
  scalar(sd_mm, kSdPerMm, 65534.0F, std::uint16_t{65535});
  scalar(known, kKnownScale, kKnownScale, std::uint8_t{255});
  return encoded;
}

}  // namespace brainshift::client
