// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/report/warped_slices.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/box_mesh.hpp"

namespace brainshift::client {
namespace {

constexpr double kSide_mm = 60.0;

// A cube of tissue whose image is as bright as its place is high, beneath the tumour's centre.
Head cube_head() {
  Head head;
  VoxelImage mri;
  mri.dims = {81, 81, 81};
  mri.values.resize(81 * 81 * 81);
  for (int k = 0; k < 81; ++k) {
    for (int i = 0; i < 81 * 81; ++i) {
      mri.values[static_cast<std::size_t>(k * 81 * 81 + i)] = 100.0f + static_cast<float>(k);
    }
  }
  head.mri = std::move(mri);
  head.tumour_centre = Vec3(30, 30, 30);
  return head;
}

ReportedRun moved(const Vec3& estimate, const std::optional<Vec3>& truth) {
  ReportedRun run;
  run.report.boundary = "contact";
  RunField field;
  field.mesh = test_support::box_mesh(4, 4, 4, Vec3::Constant(kSide_mm));
  field.estimated = estimate.replicate(1, field.mesh.num_nodes());
  if (truth) field.truth = truth->replicate(1, field.mesh.num_nodes());
  run.field = std::move(field);
  return run;
}

int grey(const cv::Mat& image, int row) { return image.at<cv::Vec3b>(row, image.cols / 3)[0]; }

TEST(WarpedSlices, ShowTheTissueWhereTheFieldHasPutIt) {
  const std::vector<ReportedRun> runs = {moved(Vec3(0, 0, -6), Vec3(0, 0, 6))};
  const auto slides = warped_slices(group_runs(runs).front(), runs, cube_head());
  ASSERT_EQ(slides.size(), 2u);
  const Slide& coronal = slides[1];
  ASSERT_EQ(coronal.positions.size(), 3u);
  EXPECT_EQ(coronal.positions[0].label, "before");
  EXPECT_EQ(coronal.positions[1].label, "estimate");
  EXPECT_EQ(coronal.positions[2].label, "truth");
  // 6 px per mm, up is up: what was 6 mm (36 px) higher is seen after a sag of 6 mm; the reverse.
  const int row = coronal.positions[0].image.rows / 2;
  EXPECT_NEAR(grey(coronal.positions[1].image, row), grey(coronal.positions[0].image, row - 36), 2);
  EXPECT_NEAR(grey(coronal.positions[2].image, row), grey(coronal.positions[0].image, row + 36), 2);
  EXPECT_GT(grey(coronal.positions[0].image, row - 36), grey(coronal.positions[0].image, row + 36));
}

TEST(WarpedSlices, AreBlackWhereTissueHasLeftThePlace) {
  const std::vector<ReportedRun> runs = {moved(Vec3(0, 0, -6), std::nullopt)};
  const auto slides = warped_slices(group_runs(runs).front(), runs, cube_head());
  ASSERT_EQ(slides.size(), 2u);
  ASSERT_EQ(slides[1].positions.size(), 2u);
  // 57 mm: tissue before, none after. The window's upper edge is at 80 mm.
  const int row = (80 - 57) * 6;
  EXPECT_GT(grey(slides[1].positions[0].image, row), 0);
  EXPECT_EQ(grey(slides[1].positions[1].image, row), 0);
}

TEST(WarpedSlices, NeedAFieldAndAnImage) {
  std::vector<ReportedRun> runs = {moved(Vec3(0, 0, -6), std::nullopt)};
  Head head = cube_head();
  head.mri.reset();
  EXPECT_TRUE(warped_slices(group_runs(runs).front(), runs, head).empty());
  runs.front().field.reset();
  EXPECT_TRUE(warped_slices(group_runs(runs).front(), runs, cube_head()).empty());
}

}  // namespace
}  // namespace brainshift::client
