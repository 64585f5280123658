// SPDX-License-Identifier: GPL-3.0-or-later
// A synthetic image without symmetry, and what another modality sees of it.
#pragma once

#include <cmath>
#include <vector>

#include "common/core/mesh.hpp"
#include "common/core/random.hpp"
#include "common/values/intensity_samples.hpp"

namespace brainshift::registration::test {

// Gaussian blobs at random places; defined everywhere, not only on voxels.
class Blobs {
 public:
  explicit Blobs(std::uint64_t seed, double extent_mm = 30.0, int count = 60) {
    Random random(seed);
    for (int i = 0; i < count; ++i) {
      const Vec3 at(2.0 * random.uniform() - 1.0, 2.0 * random.uniform() - 1.0,
                    2.0 * random.uniform() - 1.0);
      blobs_.push_back({extent_mm * at, 4.0 + 5.0 * random.uniform(), 0.4 + random.uniform()});
    }
  }
  double operator()(const Vec3& x) const {
    double sum = 0.0;
    for (const Blob& blob : blobs_)
      sum += blob.height *
             std::exp(-0.5 * (x - blob.centre).squaredNorm() / (blob.width * blob.width));
    return sum;
  }

 private:
  struct Blob {
    Vec3 centre;
    double width, height;
  };
  std::vector<Blob> blobs_;
};

// 1.5 mm voxels, 48 mm to either side, an oblique left-handed affine.
inline VoxelImage image_of(const Blobs& blobs) {
  VoxelImage image;
  image.dims = {65, 65, 65};
  image.T_ras_voxel = Eigen::AngleAxisd(0.3, Vec3(1, 2, -1).normalized()) *
                      Eigen::Scaling(Vec3(-1.5, 1.5, 1.5)) * Eigen::Translation3d(-32, -32, -32);
  image.values.reserve(image.num_voxels());
  for (int k = 0; k < 65; ++k)
    for (int j = 0; j < 65; ++j)
      for (int i = 0; i < 65; ++i)
        image.values.push_back(static_cast<float>(blobs(image.T_ras_voxel * Vec3(i, j, k))));
  return image;
}

// `count` places in a ball of 25 mm and what the image has there.
inline IntensitySamples samples_of(const Blobs& blobs, int count, std::uint64_t seed) {
  Random random(seed);
  IntensitySamples samples{Points(3, count), VecX(count)};
  for (int i = 0; i < count; ++i) {
    samples.positions.col(i) = 25.0 * std::cbrt(random.uniform()) * random.direction();
    samples.intensities[i] = blobs(samples.positions.col(i));
  }
  return samples;
}

inline Points moved(const RigidTransform& T, const Points& points) {
  return (T.linear() * points).colwise() + Vec3(T.translation());
}

}  // namespace brainshift::registration::test
