// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "client/tools/pictures/canvas.hpp"
#include "client/tools/pictures/slice_panel.hpp"
#include "client/tools/pictures/surface_view.hpp"
#include "common/geometry/surface.hpp"
#include "tests/unit/client/tools/replay/box.hpp"

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

TEST(SliceWindow, SagittalShowsAnteriorOnTheLeftAndSuperiorUp) {
  SliceWindow window = kWindow;
  window.plane = Plane::kSagittal;
  const cv::Point2d middle = window.pixel({5, 5, 5});
  EXPECT_LT(window.pixel({5, 8, 5}).x, middle.x);
  EXPECT_LT(window.pixel({5, 5, 8}).y, middle.y);
  EXPECT_EQ(window.normal_axis(), 0);
  EXPECT_TRUE(window.position(window.pixel({5, 3, 7})).isApprox(Vec3(5, 3, 7), 1e-12));
}

TEST(SliceSamples, CoverTheInsideOfTheMeshAndNothingElse) {
  const TetMesh mesh = box_mesh();
  const geometry::TetLocator locator(mesh);
  const SliceSamples samples = sample_slice(locator, kWindow, 1.0);
  EXPECT_EQ(samples.positions.size(), 11u * 11u);
  Points identity = mesh.nodes;
  for (std::size_t i = 0; i < samples.positions.size(); ++i) {
    EXPECT_TRUE(
        geometry::value_at(samples.locations[i], identity).isApprox(samples.positions[i], 1e-9));
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

// Both sides of a strip in the plane x = 5, as of falx and tentorium.
TriangleSurface sheet_of_two_sides() {
  TriangleSurface sheet;
  constexpr int kSteps = 4;
  sheet.vertices.resize(3, 4 * (kSteps + 1));
  sheet.triangles.resize(3, 4 * kSteps);
  int t = 0;
  for (int side = 0; side < 2; ++side) {
    const int first = 2 * (kSteps + 1) * side;
    for (int i = 0; i <= kSteps; ++i) {
      sheet.vertices.col(first + 2 * i) = Vec3(5.0, 2.0 * i, 0.0);
      sheet.vertices.col(first + 2 * i + 1) = Vec3(5.0, 2.0 * i, 10.0);
      if (i == kSteps) break;
      const int a = first + 2 * i;
      sheet.triangles.col(t++) = Eigen::Vector3i(a, a + 1 + side, a + 2 - side);
      sheet.triangles.col(t++) = Eigen::Vector3i(a + 1, a + 3 - side, a + 2 + side);
    }
  }
  return sheet;
}

TEST(Section, OfASheetWithTwoSidesIsOneLine) {
  const auto lines = section_polylines(sheet_of_two_sides(), Vec3::UnitZ(), 5.0);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_NEAR((lines[0].front() - lines[0].back()).norm(), 8.0, 1e-9);
}

TEST(SlicePanel, SaysWhetherASectionLiesInThePictureAndDrawsItWithoutABreak) {
  SlicePanel panel(kWindow);
  EXPECT_TRUE(panel.draw_section(sheet_of_two_sides(), {palette::kGreen, 5, 0.0, 2}));
  const cv::Point2d from = kWindow.pixel({5, 0.5, 5}), to = kWindow.pixel({5, 7.5, 5});
  for (int y = static_cast<int>(to.y); y < static_cast<int>(from.y); ++y) {
    EXPECT_EQ(panel.image().at<cv::Vec3b>(y, static_cast<int>(from.x)), cv::Vec3b(115, 158, 0));
  }
  SliceWindow elsewhere = kWindow;
  elsewhere.across_min = 6.0;
  EXPECT_FALSE(SlicePanel(elsewhere).draw_section(sheet_of_two_sides(), {}));
  elsewhere = kWindow;
  elsewhere.offset_mm = 11.0;
  EXPECT_FALSE(SlicePanel(elsewhere).draw_section(sheet_of_two_sides(), {}));
}

TEST(Section, OfTheDeformedSurfaceMovesWithALinearField) {
  const TetMesh mesh = box_mesh();
  const geometry::TetLocator locator(mesh);
  const TriangleSurface sphere = geometry::ellipsoid_surface(Vec3(5, 5, 5), Vec3(2, 2, 2), 0.5);
  const Points field = 0.1 * mesh.nodes;
  const TriangleSurface moved = deformed_surface(sphere, locator, field);
  EXPECT_LT((moved.vertices - 1.1 * sphere.vertices).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(SlicePanel, ArrowPointsWhereTheFieldPoints) {
  const TetMesh mesh = box_mesh();
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

TriangleSurface ball(const Vec3& centre, double radius) {
  return geometry::ellipsoid_surface(centre, Vec3::Constant(radius), 0.2 * radius);
}
std::vector<cv::Scalar> all(const TriangleSurface& surface, const cv::Scalar& colour) {
  return std::vector<cv::Scalar>(static_cast<std::size_t>(surface.num_triangles()), colour);
}
cv::Vec3b at(const SurfaceView& view, const Vec3& x) {
  const cv::Point p = view.pixel(x);
  return view.image().at<cv::Vec3b>(p.y, p.x);
}

TEST(SurfaceView, FromTheFrontThePatientsRightIsOnTheLeft) {
  const SurfaceView view(view_from(Vec3::UnitY(), Vec3::Zero()));
  const cv::Point2d middle = view.pixel(Vec3::Zero());
  EXPECT_LT(view.pixel(Vec3::UnitX()).x, middle.x);
  EXPECT_LT(view.pixel(Vec3::UnitZ()).y, middle.y);
  EXPECT_GT(view.depth(Vec3::UnitY()), 0.0);
}

TEST(SurfaceView, FromThePatientsRightAnteriorIsOnTheRight) {
  const SurfaceView view(view_from(Vec3::UnitX(), Vec3::Zero()));
  EXPECT_GT(view.pixel(Vec3::UnitY()).x, view.pixel(Vec3::Zero()).x);
}

TEST(SurfaceView, FromAboveAnteriorIsUpAndTheRightIsOnTheRight) {
  const SurfaceView view(view_from(Vec3::UnitZ(), Vec3::Zero()));
  EXPECT_LT(view.pixel(Vec3::UnitY()).y, view.pixel(Vec3::Zero()).y);
  EXPECT_GT(view.pixel(Vec3::UnitX()).x, view.pixel(Vec3::Zero()).x);
}

TEST(SurfaceView, NearerSurfacesHideFartherOnesInAnyOrder) {
  const TriangleSurface near = ball(Vec3(0, 40, 0), 20.0);
  const TriangleSurface far = ball(Vec3(0, -40, 0), 30.0);
  for (const bool near_first : {true, false}) {
    SurfaceView view(view_from(Vec3::UnitY(), Vec3::Zero()));
    if (near_first) view.draw_surface(near, all(near, {255, 0, 0}));
    view.draw_surface(far, all(far, {0, 255, 0}));
    if (!near_first) view.draw_surface(near, all(near, {255, 0, 0}));
    EXPECT_GT(at(view, Vec3::Zero())[0], 200);
    EXPECT_EQ(at(view, Vec3::Zero())[1], 0);
    EXPECT_GT(at(view, Vec3(25, 0, 0))[1], 50);  // beside the nearer ball
  }
}

TEST(SurfaceView, FacesSeenFromTheFrontAreBrightest) {
  const TriangleSurface sphere = ball(Vec3::Zero(), 50.0);
  SurfaceView view(view_from(Vec3::UnitY(), Vec3::Zero()));
  view.draw_surface(sphere, all(sphere, {200, 200, 200}));
  EXPECT_GT(at(view, Vec3::Zero())[0], at(view, Vec3(40, 0, 0))[0] + 20);
}

TEST(SurfaceView, WhatIsInsideShinesThrough) {
  const TriangleSurface outer = ball(Vec3::Zero(), 50.0);
  const TriangleSurface inner = ball(Vec3::Zero(), 10.0);
  SurfaceView view(view_from(Vec3::UnitY(), Vec3::Zero()));
  view.draw_surface(outer, all(outer, {200, 0, 0}));
  view.draw_through(inner, {0, 200, 0}, 0.5);
  EXPECT_NEAR(at(view, Vec3::Zero())[1], 100, 12);
  EXPECT_EQ(at(view, Vec3(20, 0, 0))[1], 0);
}

TEST(SurfaceView, LinesOnTheFarSideAreHidden) {
  const TriangleSurface sphere = ball(Vec3::Zero(), 50.0);
  SurfaceView view(view_from(Vec3::UnitY(), Vec3::Zero()));
  view.draw_surface(sphere, all(sphere, {200, 0, 0}));
  view.draw_on_surface({Vec3(-5, -50, 0), Vec3(5, -50, 0)}, {{0, 0, 255}, 4, 0.0});
  EXPECT_EQ(at(view, Vec3::Zero())[2], 0);
  view.draw_on_surface({Vec3(-5, 50, 0), Vec3(5, 50, 0)}, {{0, 0, 255}, 4, 0.0});
  EXPECT_GT(at(view, Vec3::Zero())[2], 200);
}

TEST(GravityArrow, PointsAlongAndSaysWhenItCannot) {
  cv::Mat down(200, 200, CV_8UC3, cv::Scalar(0, 0, 0));
  cv::Mat along_view = down.clone();
  draw_gravity_arrow(down, {0.0, 1.0});
  draw_gravity_arrow(along_view, {0.0, 0.0});
  // The arrow's shaft crosses its middle.
  EXPECT_GT(down.at<cv::Vec3b>(100, 86)[0], 200);
  EXPECT_EQ(along_view.at<cv::Vec3b>(100, 86)[0], 0);
}

}  // namespace
}  // namespace brainshift::client
