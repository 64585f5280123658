// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "common/core/random.hpp"
#include "common/registration/image_similarity.hpp"
#include "tests/unit/registration/blob_image.hpp"

namespace brainshift::registration {
namespace {

constexpr int kBins = 16;
using Pairs = std::vector<std::pair<double, double>>;

// Intensities that go together, but not one to one.
Pairs related(int count, std::uint64_t seed) {
  Random random(seed);
  Pairs pairs;
  for (int i = 0; i < count; ++i) {
    const double s = 1.0 + (kBins - 4) * random.uniform();
    pairs.emplace_back(
        s, 1.0 + (kBins - 4) * (0.7 * std::pow(std::sin(0.4 * s), 2) + 0.3 * random.uniform()));
  }
  return pairs;
}

double nmi_of(const Pairs& pairs) {
  JointHistogram histogram(kBins);
  for (const auto& [s, m] : pairs) histogram.add(s, m);
  return histogram.nmi();
}

// The centred cubic B-spline by its convolution form.
double cubic_spline(double x) {
  const auto cube = [](double v) { return v > 0.0 ? v * v * v : 0.0; };
  return (cube(x + 2) - 4 * cube(x + 1) + 6 * cube(x) - 4 * cube(x - 1) + cube(x - 2)) / 6.0;
}

// The definition, every bin of every sample.
double nmi_by_definition(const Pairs& pairs) {
  std::vector<std::vector<double>> p(kBins, std::vector<double>(kBins, 0.0));
  for (const auto& [s, m] : pairs)
    for (int a = 0; a < kBins; ++a)
      for (int b = 0; b < kBins; ++b)
        p[a][b] += std::max(0.0, 1.0 - std::abs(a - s)) * cubic_spline(b - m) /
                   static_cast<double>(pairs.size());
  const auto term = [](double value) { return value > 1e-300 ? -value * std::log(value) : 0.0; };
  double joint = 0.0, of_s = 0.0, of_m = 0.0;
  for (int a = 0; a < kBins; ++a) {
    double row = 0.0, column = 0.0;
    for (int b = 0; b < kBins; ++b) {
      joint += term(p[a][b]);
      row += p[a][b];
      column += p[b][a];
    }
    of_s += term(row);
    of_m += term(column);
  }
  return (of_s + of_m) / joint;
}

TEST(JointHistogram, AgreesWithTheDefinition) {
  for (std::uint64_t seed : {1, 2, 3}) {
    const Pairs pairs = related(200, seed);
    EXPECT_NEAR(nmi_of(pairs), nmi_by_definition(pairs), 1e-12);
  }
}

TEST(JointHistogram, IndependentIntensitiesHaveOne) {
  Pairs grid;
  for (double s = 1.0; s <= kBins - 3; s += 0.5)
    for (double m = 1.0; m <= kBins - 3; m += 0.5) grid.emplace_back(s, m);
  EXPECT_NEAR(nmi_of(grid), 1.0, 1e-12);
}

TEST(JointHistogram, IsGreaterWhereIntensitiesGoTogether) {
  Pairs pairs = related(5000, 4);
  const double together = nmi_of(pairs);
  for (std::size_t i = 0; i < pairs.size(); ++i)
    pairs[i].first = pairs[(i * 7 + 13) % pairs.size()].first;
  EXPECT_GT(together, nmi_of(pairs) + 0.05);
}

TEST(JointHistogram, DerivativeIsThatOfFiniteDifferences) {
  Pairs pairs = related(60, 5);
  JointHistogram histogram(kBins);
  for (const auto& [s, m] : pairs) histogram.add(s, m);
  histogram.nmi();
  double largest = 0.0;
  for (std::size_t i = 0; i < pairs.size(); i += 7) {
    const double derivative = histogram.derivative(pairs[i].first, pairs[i].second);
    constexpr double h = 1e-5;
    Pairs up = pairs, down = pairs;
    up[i].second += h;
    down[i].second -= h;
    EXPECT_NEAR(derivative, (nmi_of(up) - nmi_of(down)) / (2.0 * h), 1e-8);
    largest = std::max(largest, std::abs(derivative));
  }
  EXPECT_GT(largest, 1e-4);
}

TEST(JointHistogram, NothingAddedHasZero) {
  JointHistogram histogram(kBins);
  EXPECT_EQ(histogram.nmi(), 0.0);
  histogram.add(3.0, 5.0);
  EXPECT_GT(histogram.nmi(), 0.0);
  histogram.clear();
  EXPECT_EQ(histogram.nmi(), 0.0);
}

TEST(BinScale, MapsTheRangeOfQuantilesAndClampsTheRest) {
  const VecX values = VecX::LinSpaced(1001, 0.0, 1000.0);
  const BinScale scale = quantile_scale(values, 0.1, 0.9, 32);
  EXPECT_DOUBLE_EQ(scale.low, 100.0);
  EXPECT_DOUBLE_EQ(scale.high, 900.0);
  EXPECT_DOUBLE_EQ(scale.position(100.0), 1.0);
  EXPECT_DOUBLE_EQ(scale.position(900.0), 29.0);
  EXPECT_DOUBLE_EQ(scale.position(500.0), 15.0);
  EXPECT_DOUBLE_EQ(scale.position(-5.0), 1.0);
  EXPECT_DOUBLE_EQ(scale.position(5000.0), 29.0);
}

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
