// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/anatomy/given_inputs.hpp"

#include <gmock/gmock.h>

#include <numeric>

#include "common/geometry/surface.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/anatomy/ball_case.hpp"

namespace brainshift::anatomy {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Balls of 1 in an image of 0, voxels of 1 mm3.
VoxelImage balls(const std::vector<geometry::balls::Ball>& where) {
  return geometry::balls::binary_balls(
      geometry::balls::empty_image(60, Vec3::Zero(), Mat3::Identity()), where);
}

double sum(const VoxelImage& image) {
  return std::accumulate(image.values.begin(), image.values.end(), 0.0);
}

// The ball's mask as a linear resampling leaves it.
VoxelImage soft_ball(double radius) {
  return geometry::balls::soft_balls(
      geometry::balls::empty_image(60, Vec3::Zero(), Mat3::Identity()), {{Vec3::Zero(), radius}},
      3.0);
}

template <typename T>
std::string refused(const Result<T>& result) {
  return refusal_of(result, ErrorCode::kInvalidArgument);
}

// ---- masks ----

TEST(BrainMask, TakesVoxelsAboveZeroWhateverTheyAndTheBackgroundAre) {
  const VoxelImage ball = balls({{Vec3::Zero(), 20.0}});
  for (const float inside : {1.0F, 255.0F, 0.25F}) {
    for (const float outside : {0.0F, -1.0F, -1000.0F, std::nanf("")}) {
      VoxelImage image = ball;
      for (float& v : image.values) v = v > 0.0F ? inside : outside;
      Notes notes;
      EXPECT_EQ(value_or_fail(brain_mask(image, "m", &notes)).values, ball.values);
      EXPECT_THAT(notes, IsEmpty());
    }
  }
  // A skull-stripped image: many values, and no plateau.
  VoxelImage stripped = ball;
  int n = 0;
  for (float& v : stripped.values) v *= static_cast<float>(1 + n++ % 200);
  EXPECT_EQ(value_or_fail(brain_mask(stripped, "m", nullptr)).values, ball.values);
}

TEST(WithoutSulci, AMaskThatFollowsThemIsFilledAndSaysSo) {
  const VoxelImage ball = balls({{Vec3::Zero(), 20.0}});
  const auto with_slots = [&](int every) {
    VoxelImage image = ball;
    std::size_t v = 0;
    for (int k = 0; k < image.dims[2]; ++k)
      for (int j = 0; j < image.dims[1]; ++j)
        for (int i = 0; i < image.dims[0]; ++i, ++v)
          if (i % every < 2 && j > image.dims[1] / 2) image.values[v] = 0.0F;
    return image;
  };
  const auto voxels = [](const VoxelImage& image) {
    return std::accumulate(image.values.begin(), image.values.end(), 0.0);
  };
  Notes notes;
  const VoxelImage mask = without_sulci(with_slots(8), "m", &notes);
  EXPECT_THAT(notes, ElementsAre(AllOf(HasSubstr("m: follows the sulci; gaps of less than 6 mm"),
                                       HasSubstr("% to the brain's volume"))));
  EXPECT_GT(voxels(mask), 0.97 * voxels(ball));
  EXPECT_LE(voxels(mask), 1.001 * voxels(ball));
  // One fissure is no mask that follows the sulci.
  notes.clear();
  const VoxelImage one = with_slots(100);
  EXPECT_EQ(without_sulci(one, "m", &notes).values, one.values);
  EXPECT_THAT(notes, IsEmpty());
}

TEST(BrainMask, ASoftMaskCountsFromHalfItsPlateau) {
  for (const float plateau : {1.0F, 100.0F}) {
    VoxelImage image = soft_ball(20.0);
    for (float& v : image.values) v *= plateau;
    Notes notes;
    const double voxels = sum(value_or_fail(brain_mask(image, "m.nii", &notes)));
    EXPECT_NEAR(voxels / geometry::balls::ball_volume(20.0), 1.0, 0.02);
    EXPECT_THAT(notes, ElementsAre(AllOf(HasSubstr("m.nii"), HasSubstr("soft mask"))));
  }
}

TEST(BrainMask, ANormalisedImageIsNoMask) {
  VoxelImage image = balls({{Vec3::Zero(), 20.0}});
  int n = 0;
  for (float& v : image.values) v *= static_cast<float>(n++ % 7 - 3);
  EXPECT_THAT(refused(brain_mask(image, "images.brain = 'z.nii'", nullptr)),
              AllOf(HasSubstr("images.brain = 'z.nii'"), HasSubstr("below 0 (down to -3)"),
                    HasSubstr("normalised image")));
}

TEST(Notes, SayWhetherThereIsSomethingToDo) {
  EXPECT_EQ(what_to_do(0.1, "falx"), "; nothing to do");
  EXPECT_EQ(what_to_do(0.11, "falx"),
            "; look at the falx in the pictures, and at the labels there");
  EXPECT_TRUE(asks_nothing("falx of 72 cm2" + what_to_do(0.0, "falx")));
  EXPECT_FALSE(asks_nothing("falx of 72 cm2" + what_to_do(0.2, "falx")));
}

TEST(BrainMask, AnImageOfTheWholeHeadIsNoBrain) {
  VoxelImage head = balls({{Vec3::Zero(), 20.0}});
  head.T_ras_voxel.linear() *= 4.3;  // 2,664 cc
  EXPECT_THAT(refused(brain_mask(head, "m", nullptr)),
              AllOf(HasSubstr("m: 266"), HasSubstr("turned inside out, or the whole head?")));
  int n = 0;
  for (float& v : head.values) v *= static_cast<float>(1 + n++ % 200);
  EXPECT_THAT(refused(brain_mask(head, "m", nullptr)),
              AllOf(HasSubstr("m: is an image of the whole head, not a brain"), HasSubstr("cc")));
  head.T_ras_voxel.linear() *= 0.95;
  EXPECT_GT(sum(value_or_fail(brain_mask(head, "m", nullptr))), 0.0);
}

TEST(BrainMask, WhatANetworkLeavesOutsideOfASoftMaskIsNoBrain) {
  VoxelImage image = soft_ball(20.0);
  const VoxelImage mask = value_or_fail(brain_mask(image, "m", nullptr));
  int n = 0;
  for (float& v : image.values) v = std::max(v, 1e-4F * static_cast<float>(1 + n++ % 100));
  EXPECT_EQ(value_or_fail(brain_mask(image, "m", nullptr)).values, mask.values);
}

TEST(BrainMask, RipplesAreNoBrain) {
  const VoxelImage ball = balls({{Vec3::Zero(), 20.0}});
  VoxelImage image = ball;
  int n = 0;
  for (float& v : image.values)
    v = v > 0.0F ? static_cast<float>(50 + n++ % 90) : 0.1F * (static_cast<float>(n++ % 3) - 1.5F);
  Notes notes;
  EXPECT_EQ(value_or_fail(brain_mask(image, "m", &notes)).values, ball.values);
  EXPECT_THAT(notes, ElementsAre(HasSubstr("ripples")));
}

TEST(BrainMask, SmallPartsAreToldAndLargeOnesRefused) {
  Notes notes;
  const auto mask = value_or_fail(
      brain_mask(balls({{Vec3(-8, 0, 0), 16.0}, {Vec3(20, 0, 0), 4.0}}), "m", &notes));
  EXPECT_NEAR(sum(mask) / geometry::balls::ball_volume(16.0), 1.0, 0.02);
  EXPECT_THAT(notes, ElementsAre(HasSubstr("are left out: 1, 0.2")));
  EXPECT_THAT(
      refused(brain_mask(balls({{Vec3(-14, 0, 0), 12.0}, {Vec3(14, 0, 0), 11.0}}), "m", nullptr)),
      HasSubstr("falls into 2 parts that do not touch, of 7.2 and 5.6 cc"));
  EXPECT_THAT(refusal_of(brain_mask(balls({}), "m", nullptr), ErrorCode::kEmptySet),
              HasSubstr("m: mask: no voxel is > 0"));
}

// ---- tumours ----

TEST(TumourFoci, EveryFocusIsKeptAndToldWithItsVolume) {
  VoxelImage image = balls({{Vec3(-12, 0, 0), 8.0}, {Vec3(14, 3, 0), 5.0}, {Vec3(0, 20, 20), 1.1}});
  for (float& v : image.values) v *= 4.0F;
  Notes notes;
  const auto foci = value_or_fail(tumour_foci(image, {4}, 3.0, "t", &notes));
  ASSERT_EQ(foci.size(), 2U);
  EXPECT_NEAR(foci[0].volume_mm3, geometry::balls::ball_volume(8.0), 60.0);
  EXPECT_LT((foci[1].centre - Vec3(14, 3, 0)).norm(), 0.6);
  EXPECT_EQ(sum(foci[1].mask), foci[1].volume_mm3);
  EXPECT_THAT(notes, ElementsAre(AllOf(HasSubstr("2 parts: 2.1"), HasSubstr("0.5")),
                                 HasSubstr("specks below 0.05 cc are left out: 1, 0.008 cc")));
}

TEST(TumourFoci, OtherUnitsAndTheBackgroundAreNoTumour) {
  VoxelImage image = balls({{Vec3::Zero(), 10.0}});
  image.T_ras_voxel.linear() *= 1e-3;
  EXPECT_THAT(refused(tumour_foci(image, {1}, 3.0, "t", nullptr)),
              AllOf(HasSubstr("t: the tumour's extent 0.02"), HasSubstr("metres instead")));
  image.T_ras_voxel.linear() *= 1e6;
  EXPECT_THAT(refused(tumour_foci(image, {1}, 3.0, "t", nullptr)),
              HasSubstr("micrometres instead of millimetres?"));
  image.T_ras_voxel.linear() *= 6e-3;  // a ball of 905 cc
  EXPECT_THAT(refused(tumour_foci(image, {1}, 3.0, "t", nullptr)),
              AllOf(HasSubstr("t: 9"), HasSubstr("is it the background, or the brain?")));
}

TEST(TumourFoci, AFocusAtTheImagesBorderHasAMarginBeyondIt) {
  const auto foci =
      value_or_fail(tumour_foci(balls({{Vec3(-30, 0, 0), 5.0}}), {1}, 4.0, "t", nullptr));
  const VoxelImage& mask = foci.front().mask;
  for (int k = 0; k < mask.dims[2]; ++k)
    for (int j = 0; j < mask.dims[1]; ++j) EXPECT_EQ(mask.at(3, j, k), 0.0F);
}

TEST(TumourFoci, SeveralLabelsAreOneTumourEachToldWithItsVolume) {
  VoxelImage image = balls({{Vec3::Zero(), 9.0}});
  std::size_t v = 0;
  for (float& value : image.values) value *= v++ % 2 == 0 ? 1.0F : 4.0F;
  Notes notes;
  const auto foci = value_or_fail(tumour_foci(image, {1, 4}, 3.0, "t", &notes));
  ASSERT_EQ(foci.size(), 1U);
  EXPECT_NEAR(foci[0].volume_mm3, geometry::balls::ball_volume(9.0), 60.0);
  EXPECT_THAT(notes, ElementsAre(AllOf(HasSubstr("label 1 1.5"), HasSubstr("label 4 1.5"))));
}

TEST(TumourFoci, ALabelThatIsNotThereListsThoseThatAre) {
  VoxelImage image = balls({{Vec3::Zero(), 9.0}});
  for (float& v : image.values) v *= 255.0F;
  EXPECT_THAT(refusal_of(tumour_foci(image, {1}, 3.0, "t", nullptr), ErrorCode::kEmptySet),
              AllOf(HasSubstr("label = 1"), HasSubstr("there are: 255 (3.1")));
  EXPECT_EQ(listed_labels(balls({})), "none");
}

TEST(TumourFoci, ResampledLabelsAreRefusedAndProbabilitiesCountFromOneHalf) {
  VoxelImage image = soft_ball(9.0);
  Notes notes;
  const auto foci = value_or_fail(tumour_foci(image, {1}, 3.0, "t", &notes));
  EXPECT_NEAR(foci[0].volume_mm3 / geometry::balls::ball_volume(9.0), 1.0, 0.04);
  EXPECT_THAT(notes, ElementsAre(HasSubstr("soft mask")));
  VoxelImage whole = image;  // 0 to 255 as whole numbers
  for (float& v : whole.values) v = std::round(255.0F * v);
  whole.values[0] = std::nanf("");
  EXPECT_EQ(value_or_fail(tumour_foci(whole, {255}, 3.0, "t", nullptr))[0].volume_mm3,
            foci[0].volume_mm3);
  for (float& v : image.values) v *= 4.0F;
  EXPECT_THAT(refused(tumour_foci(image, {4}, 3.0, "t", nullptr)),
              AllOf(HasSubstr("no whole numbers"), HasSubstr("nearest neighbour")));
}

// ---- surfaces ----

TEST(ClosedSurface, CracksAndRepeatedTrianglesAreMendedAndTold) {
  const TriangleSurface whole = geometry::ellipsoid_surface(Vec3(5, 6, 7), Vec3(9, 8, 7), 3.0);
  TriangleSurface loose;  // every triangle with corners of its own, a little apart
  loose.vertices.resize(3, 3 * whole.num_triangles());
  loose.triangles.resize(3, whole.num_triangles() + 2);
  for (int t = 0; t < whole.num_triangles(); ++t) {
    for (int k = 0; k < 3; ++k) {
      loose.triangles(k, t) = 3 * t + k;
      loose.vertices.col(3 * t + k) =
          whole.vertices.col(whole.triangles(k, t)) + Vec3::Constant(1e-6 * (t % 3));
    }
  }
  loose.triangles.rightCols(2) = loose.triangles.leftCols(2);
  Notes notes;
  const auto closed = value_or_fail(closed_surface(loose, "s", &notes));
  EXPECT_TRUE(geometry::is_closed(closed));
  EXPECT_EQ(closed.num_vertices(), whole.num_vertices());
  EXPECT_NEAR(geometry::enclosed_volume(closed), geometry::enclosed_volume(whole), 0.01);
  EXPECT_THAT(notes, ElementsAre(HasSubstr("2 triangles that it has twice")));
  notes.clear();
  EXPECT_EQ(value_or_fail(closed_surface(testing::inside_out(whole), "s", &notes)).vertices,
            whole.vertices);
  EXPECT_THAT(notes, IsEmpty());
}

TEST(ClosedSurface, OpenEdgesAreCountedAndTurnedTrianglesNamed) {
  TriangleSurface open = geometry::ellipsoid_surface(Vec3::Zero(), Vec3(9, 8, 7), 3.0);
  TriangleSurface turned = open;
  std::swap(turned.triangles(0, 5), turned.triangles(1, 5));
  EXPECT_THAT(refused(closed_surface(turned, "s", nullptr)),
              HasSubstr("turned against each other"));
  open.triangles.conservativeResize(3, open.num_triangles() - 1);
  EXPECT_THAT(refused(closed_surface(open, "s", nullptr)),
              HasSubstr("s: must be a closed surface: it has 3 open edges round 1 holes"));
}

TEST(CheckExtent, NamesTheUnitThatWouldFit) {
  EXPECT_TRUE(check_extent(Vec3(3, 50, 20), "s:", 20, 400));
  EXPECT_THAT(refused(check_extent(Vec3(0, 0.05, 0), "s:", 20, 400)),
              HasSubstr("s: extent 0.05 mm must be between 20 and 400 mm; metres"));
  EXPECT_THAT(refused(check_extent(Vec3(0, 5e4, 0), "s:", 20, 400)), HasSubstr("micrometres"));
}

}  // namespace
}  // namespace brainshift::anatomy
