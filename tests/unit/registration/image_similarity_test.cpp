// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/image_similarity.hpp"

#include <gtest/gtest.h>

#include "tests/unit/registration/blob_image.hpp"

namespace brainshift::registration {
namespace {

VoxelImage linear_image() {
  VoxelImage image = test::image_of(test::Blobs(1));
  std::size_t voxel = 0;
  for (int k = 0; k < image.dims[2]; ++k)
    for (int j = 0; j < image.dims[1]; ++j)
      for (int i = 0; i < image.dims[0]; ++i, ++voxel)
        image.values[voxel] =
            static_cast<float>(5.0 + Vec3(1.0, -2.0, 0.5).dot(image.T_ras_voxel * Vec3(i, j, k)));
  return image;
}

TEST(GradientInterpolator, IsExactForALinearImage) {
  const VoxelImage image = linear_image();
  const GradientInterpolator interpolator(image);
  Random random(2);
  for (int i = 0; i < 50; ++i) {
    const Vec3 x = 30.0 * random.direction();
    const ImageValue value = interpolator(x);
    ASSERT_TRUE(value.inside);
    EXPECT_NEAR(value.value, 5.0 + Vec3(1.0, -2.0, 0.5).dot(x), 1e-4);
    EXPECT_LT((value.gradient - Vec3(1.0, -2.0, 0.5)).norm(), 1e-4);
  }
}

TEST(GradientInterpolator, GradientIsThatOfFiniteDifferences) {
  const VoxelImage image = test::image_of(test::Blobs(3));
  const GradientInterpolator interpolator(image);
  Random random(4);
  for (int i = 0; i < 50; ++i) {
    const Vec3 x = 30.0 * random.uniform() * random.direction();
    const ImageValue value = interpolator(x);
    const Vec3 along = random.direction();
    constexpr double h = 1e-6;
    const double slope =
        (interpolator(x + h * along).value - interpolator(x - h * along).value) / (2 * h);
    EXPECT_NEAR(value.gradient.dot(along), slope, 1e-6);
  }
}

TEST(GradientInterpolator, EndsAtTheOutermostVoxelCentres) {
  const VoxelImage image = linear_image();
  const GradientInterpolator interpolator(image);
  EXPECT_TRUE(interpolator(image.T_ras_voxel * Vec3(0.01, 30, 30)).inside);
  EXPECT_FALSE(interpolator(image.T_ras_voxel * Vec3(-0.01, 30, 30)).inside);
  EXPECT_TRUE(interpolator(image.T_ras_voxel * Vec3(30, 30, 63.99)).inside);
  EXPECT_FALSE(interpolator(image.T_ras_voxel * Vec3(30, 30, 64.01)).inside);
  EXPECT_FALSE(interpolator(Vec3::Constant(std::nan(""))).inside);
}

TEST(ImageSimilarity, GradientIsThatOfFiniteDifferences) {
  const test::Blobs blobs(5);
  const VoxelImage image = test::image_of(blobs);
  const IntensitySamples samples = test::samples_of(blobs, 4000, 6);
  const BinScale scale = quantile_scale(samples.intensities, 0.0, 1.0, 32);
  ImageSimilarity similarity(image, nullptr, scale, samples, scale, 1);
  Vec6 away;
  away << 0.03, -0.02, 0.04, 1.0, -2.0, 0.5;
  const Vec3 centre(3, -2, 5);
  const RigidTransform T = rigid_increment(away, Vec3::Zero());
  const Similarity here = similarity.at(T, centre);
  EXPECT_EQ(here.overlap, 1.0);
  for (int k = 0; k < 6; ++k) {
    const double h = k < 3 ? 1e-6 : 1e-5;
    const auto at = [&](double step) {
      return similarity.at(rigid_increment(step * Vec6::Unit(k), centre) * T, centre).nmi;
    };
    const double slope = (at(h) - at(-h)) / (2.0 * h);
    EXPECT_NEAR(here.gradient[k], slope, 1e-3 * std::abs(slope) + 1e-6) << "axis " << k;
    EXPECT_GT(std::abs(slope), 1e-4);
  }
}

TEST(ImageSimilarity, CountsOnlySamplesInsideImageAndRegion) {
  const test::Blobs blobs(7);
  const VoxelImage image = test::image_of(blobs);
  VoxelImage region = image;
  for (std::size_t i = 0; i < region.values.size(); ++i)
    region.values[i] = i < region.values.size() / 2 ? 1.0f : 0.0f;
  const IntensitySamples samples = test::samples_of(blobs, 4000, 8);
  const BinScale scale = quantile_scale(samples.intensities, 0.0, 1.0, 32);
  ImageSimilarity everywhere(image, nullptr, scale, samples, scale, 1);
  ImageSimilarity half(image, &region, scale, samples, scale, 2);
  const RigidTransform identity = RigidTransform::Identity();
  EXPECT_EQ(everywhere.at(identity, Vec3::Zero()).overlap, 1.0);
  EXPECT_NEAR(half.at(identity, Vec3::Zero()).overlap, 0.5, 0.05);
  const RigidTransform away(Eigen::Translation3d(200, 0, 0));
  EXPECT_EQ(everywhere.at(away, Vec3::Zero()).overlap, 0.0);
  EXPECT_EQ(everywhere.at(away, Vec3::Zero()).nmi, 0.0);
}

}  // namespace
}  // namespace brainshift::registration
