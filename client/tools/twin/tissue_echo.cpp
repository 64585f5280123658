// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/tissue_echo.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/random.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/geometry/distance_volume.hpp"
#include "common/geometry/mask.hpp"

namespace brainshift::client {
namespace {

constexpr double kWhiteMatterQuantile = 0.9;  // of the intensities in the brain
constexpr double kFluid = 0.5, kCortex = 0.73;
constexpr double kWhiteScatter = 0.12, kCortexScatter = 0.08, kSulcus = 0.8, kVentricle = 0.006;
constexpr double kTumourScatter = 0.5;
constexpr float kOutsideScatter = 0.01f;

double ramp(double x, double low, double high) {
  return std::clamp((x - low) / (high - low), 0.0, 1.0);
}
double mix(double a, double b, double t) { return a + (b - a) * t; }

Status check_grids(const VoxelImage& mri, const VoxelImage& brain) {
  if (mri.dims == brain.dims && mri.T_ras_voxel.isApprox(brain.T_ras_voxel, 1e-4)) return {};
  return fail(
      ErrorCode::kInvalidArgument,
      fmt::format("simulated ultrasound: MRI of {} x {} x {} and brain mask of {} x {} x {} "
                  "voxels: must be the same ones",
                  mri.dims[0], mri.dims[1], mri.dims[2], brain.dims[0], brain.dims[1],
                  brain.dims[2]));
}

// What all maps are made from.
struct Anatomy {
  float white = 0.0f;  // intensity of white matter
  geometry::DistanceVolume tumour;
};

Result<Anatomy> anatomy(const VoxelImage& mri, const VoxelImage& brain,
                        const TriangleSurface& tumour) {
  if (Status ok = check_grids(mri, brain); !ok) return tl::unexpected(ok.error());
  std::vector<float> inside;
  for (std::size_t i = 0; i < mri.values.size(); ++i)
    if (brain.values[i] > 0.0f) inside.push_back(mri.values[i]);
  if (inside.empty())
    return fail(ErrorCode::kEmptySet, "simulated ultrasound: no brain in the mask");
  const auto rank =
      static_cast<std::ptrdiff_t>(kWhiteMatterQuantile * static_cast<double>(inside.size() - 1));
  std::nth_element(inside.begin(), inside.begin() + rank, inside.end());
  const auto index = geometry::ClosestPointIndex::build(tumour);
  if (!index) return tl::unexpected(index.error());
  geometry::DistanceGridOptions options;
  options.spacing_mm = 1.0;
  auto grid = geometry::signed_distance_grid(*index, options);
  if (!grid) return tl::unexpected(grid.error());
  auto volume = geometry::DistanceVolume::create(std::move(*grid));
  if (!volume) return tl::unexpected(volume.error());
  return Anatomy{inside[static_cast<std::size_t>(rank)], std::move(*volume)};
}

VoxelImage like(const VoxelImage& image) {
  return {image.dims, image.T_ras_voxel, std::vector<float>(image.values.size(), 0.0f)};
}

// Calls visit(voxel, its place).
template <typename Visit>
void for_each_voxel(const VoxelImage& image, const Visit& visit) {
  std::size_t voxel = 0;
  for (int k = 0; k < image.dims[2]; ++k)
    for (int j = 0; j < image.dims[1]; ++j)
      for (int i = 0; i < image.dims[0]; ++i, ++voxel)
        visit(voxel, Vec3(image.T_ras_voxel * Vec3(i, j, k)));
}

// Noise of unit variance with a grain of about `grain_mm`.
VoxelImage uneven(const VoxelImage& image, double grain_mm, std::uint64_t seed) {
  Random random(seed);
  VoxelImage noise = like(image);
  for (float& value : noise.values) value = static_cast<float>(random.normal());
  noise = geometry::gaussian_smooth(noise, grain_mm);
  Eigen::Map<Eigen::ArrayXf> all(noise.values.data(),
                                 static_cast<Eigen::Index>(noise.values.size()));
  const float sd = std::sqrt(all.square().mean());
  if (sd > 0.0f) all /= sd;
  return noise;
}

struct Echo {
  double scatter, impedance;
};

// f: intensity relative to white matter; ventricle: 0 to 1, how much of the surroundings is fluid.
Echo healthy_echo(double f, double ventricle) {
  const double fluid = 1.0 - ramp(f, kFluid - 0.1, kFluid + 0.15);
  const double white = ramp(f, kCortex + 0.05, 0.98);
  const double of_fluid = mix(kSulcus, kVentricle, ramp(ventricle, 0.55, 0.8));
  return {mix(mix(kCortexScatter, kWhiteScatter, white), of_fluid, fluid),
          mix(mix(0.5, 0.4, white), 0.0, fluid)};
}

}  // namespace

Result<TissueEcho> tissue_echo(const VoxelImage& mri, const VoxelImage& brain,
                               const TriangleSurface& tumour) {
  const auto head = anatomy(mri, brain, tumour);
  if (!head) return tl::unexpected(head.error());
  TissueEcho tissue{like(mri), like(mri), like(mri)};
  VoxelImage fluid = like(mri);
  for (std::size_t i = 0; i < mri.values.size(); ++i) {
    const bool inside = brain.values[i] > 0.0f;
    tissue.brain.values[i] = inside ? 1.0f : 0.0f;
    fluid.values[i] = inside && mri.values[i] < kFluid * head->white ? 1.0f : 0.0f;
  }
  fluid = geometry::gaussian_smooth(fluid, 2.5);
  const VoxelImage grain = uneven(mri, 2.0, 11);
  for_each_voxel(mri, [&](std::size_t i, const Vec3& x) {
    if (tissue.brain.values[i] == 0.0f) {
      tissue.scatter.values[i] = kOutsideScatter;
      return;
    }
    Echo echo = healthy_echo(mri.values[i] / head->white, fluid.values[i]);
    const double in_tumour = ramp(-head->tumour.at(x).distance_mm, -0.5, 0.5);
    echo.scatter = mix(echo.scatter, kTumourScatter * std::exp(0.25 * grain.values[i]), in_tumour);
    echo.impedance = mix(echo.impedance, 0.9, in_tumour);
    tissue.scatter.values[i] = static_cast<float>(echo.scatter);
    tissue.impedance.values[i] = static_cast<float>(echo.impedance);
  });
  tissue.brain = geometry::gaussian_smooth(tissue.brain, 0.7);
  tissue.impedance = geometry::gaussian_smooth(tissue.impedance, 0.5);
  return tissue;
}

Result<VoxelImage> mri_with_tumour(const VoxelImage& mri, const VoxelImage& brain,
                                   const TriangleSurface& tumour,
                                   const TumourAppearance& appearance) {
  const auto head = anatomy(mri, brain, tumour);
  if (!head) return tl::unexpected(head.error());
  VoxelImage image = mri;
  Random random(appearance.seed);
  for_each_voxel(mri, [&](std::size_t i, const Vec3& x) {
    const double depth = -head->tumour.at(x).distance_mm;
    const double inner = ramp(depth, appearance.rim_mm - 0.5, appearance.rim_mm + 0.5);
    const double lesion = mix(appearance.rim, appearance.core, inner) * head->white;
    const double value = mix(mri.values[i], lesion, ramp(depth, -0.5, 0.5));
    image.values[i] = static_cast<float>(value + appearance.noise * head->white * random.normal());
  });
  return image;
}

}  // namespace brainshift::client
