// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <vector>

#include "client/tools/report/figures.hpp"
#include "client/tools/report/head.hpp"
#include "common/geometry/surface.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/unit/client/tools/replay/box.hpp"

namespace brainshift::client {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;

TEST(Figures, OfAGroupShowEveryPictureThatItsDataAllow) {
  Head head;
  head.tumour = geometry::ellipsoid_surface(Vec3(5, 5, 5), Vec3(2, 2, 2), 0.5);
  head.tumour_centre = head.craniotomy_centre = Vec3(5, 5, 5);
  head.gravity_direction = Vec3(-1, 0, 0);
  std::vector<ReportedRun> runs(2);
  for (std::size_t i = 0; i < 2; ++i) {
    runs[i].report.scenario = "a b/c";
    runs[i].report.method = "condensed";
    runs[i].report.boundary = i == 0 ? "contact" : "fixed";
    RunField field{box_mesh(), 0.1 * box_mesh().nodes, Points(0.12 * box_mesh().nodes)};
    runs[i].field = std::move(field);
  }
  auto groups = group_runs(runs);
  ASSERT_EQ(groups.size(), 1u);
  EXPECT_EQ(groups[0].name, "a-b-c");
  auto figures = slice_figures(groups[0], runs, head);
  EXPECT_EQ(figures.size(), 6u);
  for (const Figure& figure : figures) {
    EXPECT_FALSE(figure.image.empty()) << figure.file_name;
    EXPECT_THAT(figure.caption, HasSubstr("a b/c, method condensed, contact and fixed boundary"));
  }
  const std::vector<ReportedRun> alone = {runs[1]};
  for (const Figure& figure : slice_figures(group_runs(alone)[0], alone, head)) {
    EXPECT_THAT(figure.caption, HasSubstr("a b/c, method condensed, fixed boundary"));
  }

  runs[0].field->known = VecX::Constant(box_mesh().num_nodes(), 0.5);
  figures = slice_figures(groups[0], runs, head);
  ASSERT_EQ(figures.size(), 7u);
  EXPECT_EQ(figures[4].file_name, "known-a-b-c.png");
  EXPECT_LT(figures[4].image.cols, figures[6].image.cols) << "of the run that tells it alone";
  runs[0].field->sd_mm = VecX::Constant(box_mesh().num_nodes(), 0.2);
  figures = slice_figures(groups[0], runs, head);
  ASSERT_EQ(figures.size(), 8u);
  EXPECT_EQ(figures[4].file_name, "sd-a-b-c.png");
  for (ReportedRun& run : runs) run.field->truth.reset();
  EXPECT_EQ(slice_figures(groups[0], runs, head).size(), 6u);
  for (ReportedRun& run : runs) run.field.reset();
  EXPECT_TRUE(slice_figures(groups[0], runs, head).empty());
}

TEST(Figures, OfACourseAreAStripPerQuantityThatItHasWithTheTruthWhereRecorded) {
  RunReport run;
  const RunGroup group{"g", 0, std::nullopt};
  run.course.resize(2);
  EXPECT_TRUE(course_figures(group, run).empty());
  for (CoursePoint& point : run.course) {
    point = {point.time_s, "ius",        "caution",    "why <so>", 2.5,
             0.25,         std::nullopt, std::nullopt, 80.0};
  }
  run.course[1].time_s = 300.0;
  auto strips = course_figures(group, run);
  ASSERT_EQ(strips.size(), 2u);
  EXPECT_THAT(strips[0].svg, HasSubstr("(min): 5"));
  EXPECT_THAT(strips[0].svg, HasSubstr("2.5 ± 0.25\nius, caution: why &lt;so&gt;"));
  EXPECT_THAT(strips[1].svg, HasSubstr("time of the update (ms): 80"));
  for (CoursePoint& point : run.course) point.true_tumour_mm = 2.6;
  strips = course_figures(group, run);
  EXPECT_THAT(strips[0].svg, HasSubstr("true: 2.6"));
  // The colours of the outlines in the slices.
  EXPECT_THAT(strips[0].svg,
              ContainsRegex("stroke=\"#56b4e9\"[^>]*>\n<circle[^>]*>\n<text[^>]*>true<"));
  EXPECT_THAT(strips[0].svg,
              ContainsRegex("stroke=\"#e69f00\"[^>]*>\n<circle[^>]*>\n<text[^>]*>estimated<"));
}

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

TEST(Groups, PairBoundariesOfOneKindAndKeepNamesApart) {
  std::vector<ReportedRun> runs(5);
  for (ReportedRun& run : runs) run.report.scenario = "paper";
  runs[0].report.boundary = "contact";
  runs[1].report.boundary = "fixed";
  runs[2].report.boundary = "contact";
  runs[2].report.seed = 2;
  runs[3].report.boundary = "fixed";
  runs[3].report.seed = 2;
  runs[4].report.boundary = "contact";  // a repetition of run 0
  const auto groups = group_runs(runs);
  ASSERT_EQ(groups.size(), 3u);
  EXPECT_EQ(groups[0].contact, 0u);
  EXPECT_EQ(groups[0].fixed, 1u);
  EXPECT_EQ(groups[1].contact, 2u);
  EXPECT_EQ(groups[1].fixed, 3u);
  EXPECT_EQ(groups[1].name, "paper-2");
  EXPECT_EQ(groups[2].contact, 4u);
  EXPECT_FALSE(groups[2].fixed);
  EXPECT_EQ(groups[2].name, "paper-3");
}

TEST(Groups, KeepRunsOfDifferentSeedsApart) {
  std::vector<ReportedRun> runs(2);
  runs[0].report.boundary = "contact";
  runs[1].report.boundary = "fixed";
  EXPECT_EQ(group_runs(runs).size(), 1u);
  runs[1].report.seed = 2;
  EXPECT_EQ(group_runs(runs).size(), 2u);
}

}  // namespace
}  // namespace brainshift::client
