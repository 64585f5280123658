// SPDX-License-Identifier: GPL-3.0-or-later
// A surface enters as the cortex only if it can be one.
#include "common/geometry/surface_check.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <vector>

#include "common/geometry/surface.hpp"
#include "tests/support/results.hpp"

namespace brainshift::geometry {
namespace {

using testing::HasSubstr;

const CorticalSite kSite{Vec3(10, 20, 30), Vec3(0, 0, 1), 45.0};

// A shallow cap of n x n points, 40 mm wide, `above_mm` over the site's centre; looks along +z.
// Cells for which `leave_out` is true have no triangles.
TriangleSurface cap(int n = 21, double above_mm = -4.0,
                    const std::function<bool(int, int)>& leave_out = {}) {
  TriangleSurface surface;
  surface.vertices.resize(3, n * n);
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const double x = 40.0 * (i / (n - 1.0) - 0.5), y = 40.0 * (j / (n - 1.0) - 0.5);
      surface.vertices.col(j * n + i) =
          kSite.centre + Vec3(x, y, above_mm - (x * x + y * y) / 160.0);
    }
  }
  std::vector<Eigen::Vector3i> triangles;
  for (int j = 0; j + 1 < n; ++j) {
    for (int i = 0; i + 1 < n; ++i) {
      if (leave_out && leave_out(i, j)) continue;
      const int a = j * n + i;
      triangles.emplace_back(a, a + 1, a + n + 1);
      triangles.emplace_back(a, a + n + 1, a + n);
    }
  }
  surface.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
  for (std::size_t t = 0; t < triangles.size(); ++t)
    surface.triangles.col(static_cast<Eigen::Index>(t)) = triangles[t];
  return surface;
}

std::string refusal(const TriangleSurface& surface, const CorticalSite& site = kSite) {
  const auto checked = check_cortical_surface(surface, site);
  return checked ? "no refusal" : checked.error().message;
}

TEST(SurfaceCheck, AGoodSurfacePassesAsItIs) {
  const auto checked = value_or_fail(check_cortical_surface(cap(), kSite));
  EXPECT_EQ(checked.surface.triangles, cap().triangles);
  EXPECT_FALSE(checked.turned);
  EXPECT_EQ(checked.parts, 1);
  EXPECT_EQ(checked.holes, 0);
  EXPECT_NEAR(checked.extent_mm, std::hypot(40.0, 40.0), 0.5);
  EXPECT_NEAR(checked.distance_mm, 4.0, 1e-9);
  EXPECT_TRUE(checked.notes.empty());
}

TEST(SurfaceCheck, ASurfaceThatLooksInwardsIsTurnedRoundAndReported) {
  TriangleSurface inwards = cap();
  inwards.triangles.row(0).swap(inwards.triangles.row(1));
  const auto checked = value_or_fail(check_cortical_surface(inwards, kSite));
  EXPECT_TRUE(checked.turned);
  EXPECT_GT(vertex_normals(checked.surface).row(2).minCoeff(), 0.5);
  EXPECT_THAT(checked.notes, testing::ElementsAre(HasSubstr("were turned round")));
}

TEST(SurfaceCheck, ASurfaceAcrossTheOpeningIsRejected) {
  const CorticalSite sideways{kSite.centre, Vec3(1, 0, 0), 45.0};
  EXPECT_THAT(refusal(cap(), sideways),
              HasSubstr("look neither out of the craniotomy nor into it: mean cosine"));
}

TEST(SurfaceCheck, OneTriangleTurnedAgainstTheRestIsRejected) {
  TriangleSurface surface = cap();
  surface.triangles.col(100).reverseInPlace();
  EXPECT_THAT(refusal(surface), HasSubstr("are turned against each other"));
}

TEST(SurfaceCheck, AThirdTriangleOnAnEdgeIsRejected) {
  TriangleSurface surface = cap();
  surface.triangles.conservativeResize(3, surface.num_triangles() + 1);
  surface.triangles.rightCols<1>() << 1, 0, 200;
  surface.triangles.conservativeResize(3, surface.num_triangles() + 1);
  surface.triangles.rightCols<1>() << 0, 1, 300;
  EXPECT_EQ(refusal(surface), "the edge between vertices 0 and 1 has more than two triangles");
}

TEST(SurfaceCheck, ATriangleOfUnknownOrRepeatedVerticesIsRejected) {
  TriangleSurface surface = cap();
  surface.triangles.col(7) << 1, 2, 441;
  EXPECT_EQ(refusal(surface), "triangle 7 has the vertices 1 2 441: must be three of 441");
  surface.triangles.col(7) << 5, 5, 6;
  EXPECT_EQ(refusal(surface), "triangle 7 has the vertices 5 5 6: must be three of 441");
}

TEST(SurfaceCheck, HolesAndPartsAreCounted) {
  const auto with_holes = value_or_fail(check_cortical_surface(
      cap(21, -4.0,
          [](int i, int j) { return (i == 4 && j == 4) || (i >= 10 && i < 12 && j == 9); }),
      kSite));
  EXPECT_EQ(with_holes.holes, 2);
  EXPECT_EQ(with_holes.parts, 1);
  EXPECT_NEAR(with_holes.longest_hole_rim_mm, 12.0, 0.3);  // cells of 2 mm
  EXPECT_THAT(with_holes.notes, testing::ElementsAre(HasSubstr("has 2 holes")));

  const auto two_parts = value_or_fail(
      check_cortical_surface(cap(21, -4.0, [](int i, int) { return i == 10; }), kSite));
  EXPECT_EQ(two_parts.parts, 2);
  EXPECT_EQ(two_parts.holes, 0);

  // Two cells that meet at a corner are one hole, with one rim through that corner.
  const auto touching = value_or_fail(check_cortical_surface(
      cap(21, -4.0, [](int i, int j) { return (i == 6 || i == 7) && i == j; }), kSite));
  EXPECT_EQ(touching.holes, 1);
  EXPECT_NEAR(touching.longest_hole_rim_mm, 16.0, 0.4);
}

TEST(SurfaceCheck, OtherUnitsAreNamed) {
  const auto scaled = [](double factor) {
    TriangleSurface surface = cap();
    surface.vertices *= factor;
    return surface;
  };
  EXPECT_EQ(refusal(scaled(0.001)),
            "the surface spans 0.0568 mm: must be 9 to 270 mm for a craniotomy of 45 mm; metres?");
  EXPECT_THAT(refusal(scaled(0.1)), HasSubstr("; centimetres?"));
  EXPECT_THAT(refusal(scaled(1000.0)), HasSubstr("; micrometres?"));
  EXPECT_THAT(refusal(scaled(1e-9)), testing::EndsWith("for a craniotomy of 45 mm"));
}

TEST(SurfaceCheck, ASurfaceFarFromTheCraniotomyIsRejected) {
  EXPECT_THAT(refusal(cap(21, -26.0)),
              HasSubstr("closest point is 26.0 mm from the craniotomy's "
                        "centre: must be within 25 mm; is its pose right?"));
  EXPECT_EQ(refusal(cap(21, -24.0)), "no refusal");
}

TEST(SurfaceCheck, FewOrInfinitePointsAreRejected) {
  EXPECT_EQ(refusal(cap(7)), "the surface has 49 points: must be at least 50");
  TriangleSurface surface = cap();
  surface.vertices(1, 17) = NAN;
  EXPECT_EQ(refusal(surface), "surface point 17 is not finite");
}

TEST(SurfaceCheck, PointsWithoutTrianglesPass) {
  TriangleSurface points = cap();
  points.triangles.resize(3, 0);
  const auto checked = value_or_fail(check_cortical_surface(points, kSite));
  EXPECT_EQ(checked.parts, 0);
  points.vertices.array() += 100.0;
  EXPECT_THAT(refusal(points), HasSubstr("is its pose right?"));
}

TEST(CraniotomySite, IsTheMiddleOfTheOpeningAndItsNormal) {
  BrainModel model;
  model.mesh.nodes = cap(21, 0.0).vertices;
  model.boundary_triangles = cap().triangles;
  EXPECT_THAT(craniotomy_site(model).error().message, HasSubstr("no boundary triangle"));
  for (int j = 8; j <= 12; ++j)
    for (int i = 5; i <= 15; ++i) model.craniotomy.push_back(j * 21 + i);
  const auto site = value_or_fail(craniotomy_site(model));
  EXPECT_LT((site.centre - kSite.centre).norm(), 1.0);
  EXPECT_GT(site.outward.z(), 0.999);
  EXPECT_NEAR(site.size_mm, std::hypot(20.0, 8.0), 0.1);
}

TEST(SurfaceRims, AClosedSurfaceHasNone) {
  const auto rims =
      value_or_fail(surface_rims(ellipsoid_surface(Vec3::Zero(), Vec3(10, 12, 14), 3.0)));
  EXPECT_EQ(rims.parts, 1);
  EXPECT_TRUE(rims.rim_mm.empty());
}

}  // namespace
}  // namespace brainshift::geometry
