// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/pictures/surface_view.hpp"

#include <gtest/gtest.h>

#include "client/tools/pictures/gravity_arrow.hpp"
#include "common/geometry/surface.hpp"

namespace brainshift::client {
namespace {

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
