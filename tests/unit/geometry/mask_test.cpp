// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/mask.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <queue>
#include <random>

#include "tests/support/results.hpp"
#include "tests/unit/geometry/ball_mask.hpp"

namespace brainshift::geometry {
namespace {

VoxelImage image_of(int nx, int ny, int nz) {
  VoxelImage image;
  image.dims = {nx, ny, nz};
  image.values.assign(image.num_voxels(), 0.0f);
  return image;
}

float& voxel(VoxelImage& image, int i, int j, int k) {
  return image.values[static_cast<std::size_t>(i + image.dims[0] * (j + image.dims[1] * k))];
}

double sum(const VoxelImage& image) {
  return std::accumulate(image.values.begin(), image.values.end(), 0.0);
}

// Fills the box [low, high).
void fill_box(VoxelImage& image, std::array<int, 3> low, std::array<int, 3> high, float value) {
  for (int k = low[2]; k < high[2]; ++k)
    for (int j = low[1]; j < high[1]; ++j)
      for (int i = low[0]; i < high[0]; ++i) voxel(image, i, j, k) = value;
}

// Component number of every voxel for which `member` holds, -1 elsewhere, one voxel at a time.
std::vector<int> breadth_first(const VoxelImage& image, const std::vector<char>& member) {
  std::vector<int> label(member.size(), -1);
  int next = 0;
  for (std::size_t seed = 0; seed < member.size(); ++seed) {
    if (!member[seed] || label[seed] >= 0) continue;
    std::queue<int> queue;
    queue.push(static_cast<int>(seed));
    label[seed] = next;
    while (!queue.empty()) {
      const int v = queue.front();
      queue.pop();
      const std::array<int, 3> at{v % image.dims[0], v / image.dims[0] % image.dims[1],
                                  v / (image.dims[0] * image.dims[1])};
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (const int step : {-1, 1}) {
          auto to = at;
          to[axis] += step;
          if (to[axis] < 0 || to[axis] >= image.dims[axis]) continue;
          const int w = to[0] + image.dims[0] * (to[1] + image.dims[1] * to[2]);
          if (!member[static_cast<std::size_t>(w)] || label[static_cast<std::size_t>(w)] >= 0)
            continue;
          label[static_cast<std::size_t>(w)] = next;
          queue.push(w);
        }
    }
    ++next;
  }
  return label;
}

// Two voxels of 8 mm3 in an image that is moved and enlarged.
TEST(MaskCentre, TellsMiddleBoundsAndVolumeAndWhatTheMaskHas) {
  VoxelImage mask;
  mask.dims = {4, 3, 2};
  mask.values.assign(24, 0.0F);
  mask.values[1] = mask.values[3 + 4 * 2 + 12] = 1.0F;  // (1, 0, 0) and (3, 2, 1)
  mask.T_ras_voxel = AffineTransform::Identity();
  mask.T_ras_voxel.linear() *= 2.0;
  mask.T_ras_voxel.translation() = Vec3(10, 0, 0);
  const MaskCentre found = mask_centre(mask);
  EXPECT_EQ(found.centre, Vec3(14, 2, 1));
  EXPECT_EQ(found.low, Vec3(12, 0, 0));
  EXPECT_EQ(found.high, Vec3(16, 4, 2));
  EXPECT_EQ(found.volume_mm3, 16.0);
  const AffineTransform T_voxel_ras = mask.T_ras_voxel.inverse();
  EXPECT_TRUE(mask_has(mask, T_voxel_ras, Vec3(12.9, 0.9, -0.9)));
  for (const Vec3& x : {Vec3(13.1, 0, 0), Vec3(12, -1.1, 0), Vec3(18, 4, 2)}) {
    EXPECT_FALSE(mask_has(mask, T_voxel_ras, x));
  }
}

TEST(MaskParts, AreNumberedFromTheLargest) {
  VoxelImage image;
  image.dims = {7, 1, 2};
  image.values = {1, 0, 2, 3, 0, 0, 1,  //
                  0, 0, 0, 4, 0, 0, -1};
  const MaskParts parts = mask_parts(image);
  EXPECT_EQ(parts.voxels, (std::vector<std::size_t>{3, 1, 1}));
  EXPECT_EQ(parts.part_of_voxel,
            (std::vector<std::int32_t>{1, -1, 0, 0, -1, -1, 2, -1, -1, -1, 0, -1, -1, -1}));
  EXPECT_TRUE(mask_parts(VoxelImage{}).voxels.empty());
}

// largest_component by definition, slowly.
std::vector<float> largest_component_by_definition(const VoxelImage& image) {
  std::vector<char> member(image.values.size());
  for (std::size_t v = 0; v < member.size(); ++v) member[v] = image.values[v] > 0.0f;
  const auto label = breadth_first(image, member);
  std::vector<int> size(member.size(), 0);
  for (const int l : label)
    if (l >= 0) ++size[static_cast<std::size_t>(l)];
  const auto largest = static_cast<int>(std::max_element(size.begin(), size.end()) - size.begin());
  std::vector<char> rest(member.size());
  for (std::size_t v = 0; v < rest.size(); ++v) rest[v] = label[v] != largest;
  const auto background = breadth_first(image, rest);
  std::vector<char> outside(member.size(), 0);
  std::size_t v = 0;
  for (int k = 0; k < image.dims[2]; ++k)
    for (int j = 0; j < image.dims[1]; ++j)
      for (int i = 0; i < image.dims[0]; ++i, ++v)
        if (rest[v] && (i == 0 || j == 0 || k == 0 || i == image.dims[0] - 1 ||
                        j == image.dims[1] - 1 || k == image.dims[2] - 1))
          outside[static_cast<std::size_t>(background[v])] = 1;
  std::vector<float> result(member.size());
  for (v = 0; v < result.size(); ++v)
    result[v] = rest[v] && outside[static_cast<std::size_t>(background[v])] ? 0.0f : 1.0f;
  return result;
}

TEST(LargestComponent, AgreesWithBreadthFirstSearchOnNoise) {
  std::mt19937 random(11);
  for (const unsigned percent :
       {15u, 31u, 50u, 80u}) {  // 31 % is where 6-connected noise percolates
    VoxelImage image = image_of(17, 13, 11);
    for (float& value : image.values)
      value = random() % 100 < percent ? static_cast<float>(1 + random() % 200) : 0.0f;
    const auto result = value_or_fail(largest_component(image));
    EXPECT_EQ(result.values, largest_component_by_definition(image)) << percent << " %";
  }
}

TEST(LargestComponent, DropsSmallerComponentsAndKeepsTheFrame) {
  VoxelImage image = image_of(12, 8, 8);
  image.T_ras_voxel = Eigen::Translation3d(4, 5, 6);
  fill_box(image, {0, 0, 0}, {2, 2, 2}, 7.0f);
  fill_box(image, {5, 3, 3}, {8, 6, 6}, 3.0f);
  const auto result = value_or_fail(largest_component(image));
  EXPECT_EQ(sum(result), 27.0);
  EXPECT_EQ(result.at(5, 3, 3), 1.0f);
  EXPECT_EQ(result.at(0, 0, 0), 0.0f);
  EXPECT_EQ(result.T_ras_voxel.matrix(), image.T_ras_voxel.matrix());
}

TEST(LargestComponent, DiagonalNeighboursAreNotConnected) {
  VoxelImage image = image_of(6, 6, 6);
  fill_box(image, {1, 1, 1}, {3, 3, 3}, 1.0f);
  voxel(image, 3, 3, 2) = 1.0f;  // shares an edge with the cube
  voxel(image, 3, 3, 3) = 1.0f;
  const auto result = value_or_fail(largest_component(image));
  EXPECT_EQ(sum(result), 8.0);
}

TEST(LargestComponent, FillsCavitiesAndWhatFloatsInThem) {
  VoxelImage image = image_of(9, 9, 9);
  fill_box(image, {1, 1, 1}, {8, 8, 8}, 1.0f);
  fill_box(image, {3, 3, 3}, {6, 6, 6}, 0.0f);
  voxel(image, 4, 4, 4) = 1.0f;
  const auto result = value_or_fail(largest_component(image));
  EXPECT_EQ(sum(result), 343.0);
}

TEST(LargestComponent, LeavesATunnelToTheOutsideOpen) {
  VoxelImage image = image_of(9, 9, 9);
  fill_box(image, {1, 1, 1}, {8, 8, 8}, 1.0f);
  fill_box(image, {4, 4, 4}, {5, 5, 9}, 0.0f);
  const auto result = value_or_fail(largest_component(image));
  EXPECT_EQ(sum(result), 343.0 - 4.0);
}

TEST(LargestComponent, OfEqualComponentsTheFirstWins) {
  VoxelImage image = image_of(7, 1, 1);
  image.values = {0, 1, 1, 0, 1, 1, 0};
  const auto result = value_or_fail(largest_component(image));
  EXPECT_EQ(result.values, (std::vector<float>{0, 1, 1, 0, 0, 0, 0}));
}

TEST(LargestComponent, NegativeAndNotANumberAreNotBrain) {
  VoxelImage image = image_of(3, 1, 1);
  image.values = {-1.0f, std::numeric_limits<float>::quiet_NaN(), 0.0f};
  EXPECT_THAT(refusal_of(largest_component(image), ErrorCode::kEmptySet),
              testing::HasSubstr("no voxel"));
}

TEST(LargestComponent, AnImageWithoutVoxelsIsEmpty) {
  refusal_of(largest_component(VoxelImage{}), ErrorCode::kEmptySet);
}

TEST(CloseGaps, FillsWhatIsNarrowerThanTheBallAndNothingElse) {
  for (const double voxel_mm : {1.0, 0.5}) {
    const auto voxels = [&](double mm) { return static_cast<int>(std::lround(mm / voxel_mm)); };
    VoxelImage image = image_of(voxels(60), voxels(20), voxels(20));
    image.T_ras_voxel.linear() *= voxel_mm;
    // Up to the image's border, with slots of 4 and 8 mm.
    fill_box(image, {0, 0, 0}, {voxels(20), voxels(20), voxels(20)}, 1.0f);
    fill_box(image, {voxels(24), 0, 0}, {voxels(40), voxels(20), voxels(20)}, 1.0f);
    fill_box(image, {voxels(48), 0, 0}, {voxels(60), voxels(20), voxels(20)}, 1.0f);
    VoxelImage filled = image;
    // A slot's mouth stays a little hollow: the ball is round.
    fill_box(filled, {voxels(20), voxels(3), voxels(3)}, {voxels(24), voxels(17), voxels(17)},
             1.0f);
    const VoxelImage closed = close_gaps(image, 3.0);
    for (std::size_t v = 0; v < filled.values.size(); ++v) {
      ASSERT_GE(closed.values[v], filled.values[v]) << v;
    }
    for (int k = 0; k < image.dims[2]; ++k)
      for (int j = 0; j < image.dims[1]; ++j)
        for (int i = voxels(40); i < voxels(48); ++i) {
          ASSERT_EQ(closed.at(i, j, k), 0.0f) << i << ' ' << j << ' ' << k;
        }
    EXPECT_EQ(close_gaps(image, 0.0).values, image.values);
    EXPECT_EQ(close_gaps(closed, 3.0).values, closed.values) << "closing twice is closing once";
  }
}

TEST(CloseGaps, MeasuresMillimetresOfAnObliqueGridThatIsNoCube) {
  VoxelImage image = image_of(40, 40, 20);
  image.T_ras_voxel.linear() =
      Eigen::AngleAxisd(0.6, Vec3(1, 2, 3).normalized()).toRotationMatrix() *
      Vec3(1.0, 1.0, 2.0).asDiagonal();
  fill_box(image, {5, 5, 4}, {35, 35, 8}, 1.0f);
  fill_box(image, {5, 5, 10}, {35, 35, 16}, 1.0f);  // a gap of 2 voxels, 4 mm
  EXPECT_EQ(close_gaps(image, 1.5).at(20, 20, 8), 0.0f);
  EXPECT_EQ(close_gaps(image, 3.0).at(20, 20, 8), 1.0f);
}

TEST(GaussianSmooth, TurnsAStepIntoTheNormalDistribution) {
  VoxelImage image = image_of(60, 40, 40);
  image.T_ras_voxel.linear() = Vec3(0.5, 1.0, 1.0).asDiagonal();
  fill_box(image, {30, 0, 0}, {60, 40, 40}, 1.0f);
  const VoxelImage smooth = gaussian_smooth(image, 2.0);
  for (int i = 16; i < 44; ++i) {
    // The step lies half a voxel before voxel 30.
    const double x = 0.5 * (i - 29.5);
    const double expected = 0.5 * std::erfc(-x / (2.0 * std::sqrt(2.0)));
    // The voxel sum is the midpoint rule: h^2/24 max|p'| = 6e-4; the cut at 3.5 sigma leaves out
    // 5e-4.
    EXPECT_NEAR(smooth.at(i, 20, 20), expected, 1.1e-3) << i;
  }
}

TEST(GaussianSmooth, AnImpulseSpreadsByMillimetresNotVoxels) {
  VoxelImage image = image_of(41, 41, 21);
  image.T_ras_voxel.linear() = balls::oblique_left_handed(1.0) * Vec3(0.8, 1.0, 2.0).asDiagonal();
  voxel(image, 20, 20, 10) = 1.0f;
  const VoxelImage smooth = gaussian_smooth(image, 2.0);
  EXPECT_NEAR(sum(smooth), 1.0, 1e-5);
  const Vec3 centre = image.T_ras_voxel * Vec3(20, 20, 10);
  Mat3 covariance = Mat3::Zero();
  for (int k = 0; k < 21; ++k)
    for (int j = 0; j < 41; ++j)
      for (int i = 0; i < 41; ++i) {
        const Vec3 x = image.T_ras_voxel * Vec3(i, j, k) - centre;
        covariance += static_cast<double>(smooth.at(i, j, k)) * x * x.transpose();
      }
  // Cut at 3.5 to 4 sigma (whole voxels), a Gaussian keeps 99.3 % of its variance or more.
  EXPECT_LT((covariance - 4.0 * Mat3::Identity()).cwiseAbs().maxCoeff(), 0.04 * 4.0);
  EXPECT_GT(covariance.trace(), 11.5);
}

TEST(GaussianSmooth, BeyondTheImageIsZero) {
  VoxelImage image = image_of(30, 30, 30);
  std::fill(image.values.begin(), image.values.end(), 1.0f);
  const VoxelImage smooth = gaussian_smooth(image, 2.0);
  // The voxel's own weight (0.2) is not shared: 0.5 + 0.1 per axis in a corner.
  EXPECT_NEAR(smooth.at(0, 0, 0), std::pow(0.5 + 0.0998, 3), 2e-3);
  EXPECT_NEAR(smooth.at(15, 15, 15), 1.0, 1e-5);
}

TEST(GaussianSmooth, OfZeroWidthChangesNothing) {
  std::mt19937 random(3);
  VoxelImage image = image_of(5, 4, 3);
  for (float& value : image.values) value = static_cast<float>(random() % 100);
  EXPECT_EQ(gaussian_smooth(image, 0.0).values, image.values);
}

TEST(GaussianSmooth, AWidthBeyondTheImageIsFinite) {
  VoxelImage image = image_of(3, 1, 2);
  std::fill(image.values.begin(), image.values.end(), 1.0f);
  for (const float value : gaussian_smooth(image, 10.0).values) {
    EXPECT_GT(value, 0.0f);
    EXPECT_LT(value, 0.1f);
  }
}

TEST(Interpolator, ReproducesLinearFunctionsInAnObliqueFrame) {
  VoxelImage image = balls::empty_image(9, Vec3(10, -20, 30), balls::oblique_left_handed(1.7));
  const auto linear = [](const Vec3& x) { return 0.3 * x[0] - 0.7 * x[1] + 0.2 * x[2] + 5.0; };
  for (int k = 0; k < 9; ++k)
    for (int j = 0; j < 9; ++j)
      for (int i = 0; i < 9; ++i)
        voxel(image, i, j, k) = static_cast<float>(linear(image.T_ras_voxel * Vec3(i, j, k)));
  const Interpolator value(image);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> inside(0.0, 8.0);
  for (int n = 0; n < 200; ++n) {
    const Vec3 x = image.T_ras_voxel * Vec3(inside(random), inside(random), inside(random));
    EXPECT_NEAR(value(x), linear(x), 1e-5 * 30.0);  // float values of size 30
  }
}

TEST(Interpolator, FallsToZeroWithinOneVoxelOfTheImage) {
  VoxelImage image = image_of(2, 2, 2);
  std::fill(image.values.begin(), image.values.end(), 4.0f);
  const Interpolator value(image);
  EXPECT_FLOAT_EQ(value(Vec3(0, 1, 0)), 4.0f);
  EXPECT_FLOAT_EQ(value(Vec3(1.25, 0.5, 0.5)), 3.0f);
  EXPECT_FLOAT_EQ(value(Vec3(-0.5, 0.5, 0.5)), 2.0f);
  EXPECT_EQ(value(Vec3(2.0, 0.5, 0.5)), 0.0f);
  EXPECT_EQ(value(Vec3(-1.0, 0.5, 0.5)), 0.0f);
  EXPECT_EQ(value(Vec3(1e300, 0, 0)), 0.0f);
  EXPECT_EQ(value(Vec3(0, std::nan(""), 0)), 0.0f);
}

}  // namespace
}  // namespace brainshift::geometry
