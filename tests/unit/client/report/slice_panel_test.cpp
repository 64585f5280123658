// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/report/slice_panel.hpp"

#include <gtest/gtest.h>

#include "client/report/figures.hpp"
#include "common/geometry/surface.hpp"
#include "tests/unit/client/replay/box.hpp"

namespace brainshift::client {
namespace {

const SliceWindow kWindow{Plane::kAxial, 5.0, -2.0, 12.0, -2.0, 12.0, 10.0};

TEST(SliceWindow, ShowsThePatientsRightOnTheLeftAndAnteriorUp) {
  const cv::Point2d middle = kWindow.pixel({5, 5, 5});
  EXPECT_LT(kWindow.pixel({8, 5, 5}).x, middle.x);  // +R
  EXPECT_LT(kWindow.pixel({5, 8, 5}).y, middle.y);  // +A
  EXPECT_TRUE(kWindow.position(kWindow.pixel({3, 7, 5})).isApprox(Vec3(3, 7, 5), 1e-12));
  EXPECT_EQ(kWindow.size(), cv::Size(140, 140));
}

TEST(SliceWindow, CoronalShowsSuperiorUp) {
  SliceWindow window = kWindow;
  window.plane = Plane::kCoronal;
  const cv::Point2d middle = window.pixel({5, 5, 5});
  EXPECT_LT(window.pixel({8, 5, 5}).x, middle.x);
  EXPECT_LT(window.pixel({5, 5, 8}).y, middle.y);
  EXPECT_TRUE(window.position(window.pixel({3, 5, 7})).isApprox(Vec3(3, 5, 7), 1e-12));
}

TEST(SliceSamples, CoverTheInsideOfTheMeshAndNothingElse) {
  const TetMesh mesh = test::Box{}.mesh();
  const geometry::TetLocator locator(mesh);
  const SliceSamples samples = sample_slice(locator, kWindow, 1.0);
  EXPECT_EQ(samples.positions.size(), 11u * 11u);
  Points identity = mesh.nodes;
  for (std::size_t i = 0; i < samples.positions.size(); ++i) {
    EXPECT_TRUE(interpolate(samples.locations[i], identity).isApprox(samples.positions[i], 1e-9));
  }
}

TEST(Section, OfAClosedSurfaceIsOneClosedLineOfTheRightLength) {
  const TriangleSurface sphere = geometry::ellipsoid_surface(Vec3(1, 2, 3), Vec3(10, 10, 10), 1.0);
  const auto lines = section_polylines(sphere, Vec3::UnitZ(), 3.2);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_NEAR((lines[0].front() - lines[0].back()).norm(), 0.0, 1e-6);
  double length = 0.0;
  for (std::size_t i = 1; i < lines[0].size(); ++i)
    length += (lines[0][i] - lines[0][i - 1]).norm();
  EXPECT_NEAR(length, 2.0 * 3.14159265 * 10.0, 1.0);
  EXPECT_TRUE(section_polylines(sphere, Vec3::UnitZ(), 30.0).empty());
}

TEST(Section, OfTheDeformedSurfaceMovesWithALinearField) {
  const TetMesh mesh = test::Box{}.mesh();
  const geometry::TetLocator locator(mesh);
  const TriangleSurface sphere = geometry::ellipsoid_surface(Vec3(5, 5, 5), Vec3(2, 2, 2), 0.5);
  const Points field = 0.1 * mesh.nodes;
  const TriangleSurface moved = deformed_surface(sphere, locator, field);
  EXPECT_LT((moved.vertices - 1.1 * sphere.vertices).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(SlicePanel, ArrowPointsWhereTheFieldPoints) {
  const TetMesh mesh = test::Box{}.mesh();
  const geometry::TetLocator locator(mesh);
  const SliceSamples samples = sample_slice(locator, kWindow, 5.0);
  SlicePanel panel(kWindow);
  // Anatomically leftwards: to the right in a radiological view.
  panel.draw_arrows(samples, Vec3(-1.5, 0, 0).replicate(1, mesh.num_nodes()), 1.0, 1.5, true);
  const cv::Point2d start = kWindow.pixel({5, 5, 5});
  const auto lit = [&](double dx) {
    return panel.image().at<cv::Vec3b>(static_cast<int>(start.y),
                                       static_cast<int>(start.x + dx))[0] > 60;
  };
  EXPECT_TRUE(lit(7));
  EXPECT_FALSE(lit(-7));
}

TEST(SlicePanel, GravityPointsDownInACoronalSliceOfAnUprightHead) {
  SliceWindow window{Plane::kCoronal, 5.0, 0.0, 20.0, 0.0, 20.0, 20.0};
  SlicePanel panel(window);
  panel.draw_gravity(Vec3(0, 0, -1));
  // The barbs widen the arrow near its tip: compare the ink above and below its middle.
  const cv::Rect above(0, 56, 172, 44);
  const cv::Rect below(0, 100, 172, 50);
  const auto ink = [&](const cv::Rect& part) { return cv::sum(panel.image()(part))[0]; };
  EXPECT_GT(ink(below), 1.2 * ink(above));
}

TEST(SlicePanel, MriGreyFollowsTheVoxels) {
  VoxelImage mri;
  mri.dims = {15, 15, 15};
  mri.T_ras_voxel = AffineTransform(Eigen::Translation3d(-2, -2, -2));
  mri.values.assign(15 * 15 * 15, 0.0f);
  for (std::size_t i = 0; i < mri.values.size(); ++i)
    mri.values[i] = static_cast<float>(i % 15);  // grows with x
  SlicePanel panel(kWindow);
  panel.draw_mri(mri, 1.0);
  EXPECT_GT(panel.image().at<cv::Vec3b>(70, 20)[0], panel.image().at<cv::Vec3b>(70, 120)[0] + 100);
}

TEST(Figures, OfAGroupShowEveryPictureThatItsDataAllow) {
  const test::Box box;
  Head head;
  head.tumour = geometry::ellipsoid_surface(Vec3(5, 5, 5), Vec3(2, 2, 2), 0.5);
  head.tumour_centre = head.craniotomy_centre = Vec3(5, 5, 5);
  head.gravity_direction = Vec3(-1, 0, 0);
  std::vector<ReportedRun> runs(2);
  for (std::size_t i = 0; i < 2; ++i) {
    runs[i].report.scenario = "a b/c";
    runs[i].report.boundary = i == 0 ? "contact" : "fixed";
    RunField field{box.mesh(), 0.1 * box.mesh().nodes, Points(0.12 * box.mesh().nodes)};
    runs[i].field = std::move(field);
  }
  auto groups = group_runs(runs);
  ASSERT_EQ(groups.size(), 1u);
  EXPECT_EQ(groups[0].name, "a-b-c");
  auto figures = slice_figures(groups[0], runs, head);
  EXPECT_EQ(figures.size(), 6u);
  for (const Figure& figure : figures) EXPECT_FALSE(figure.image.empty()) << figure.file_name;

  for (ReportedRun& run : runs) run.field->truth.reset();
  EXPECT_EQ(slice_figures(groups[0], runs, head).size(), 4u);
  for (ReportedRun& run : runs) run.field.reset();
  EXPECT_TRUE(slice_figures(groups[0], runs, head).empty());
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
