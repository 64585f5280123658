// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "common/contact/forward_model.hpp"
#include "common/contact/penalty.hpp"
#include "common/geometry/surface.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/contact_search.hpp"
#include "tests/support/results.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::contact {
namespace {

using geometry::ellipsoid_surface;

TriangleSurface make_surface(const std::vector<Vec3>& vertices,
                             const std::vector<std::array<int, 3>>& triangles) {
  TriangleSurface surface;
  surface.vertices.resize(3, static_cast<Eigen::Index>(vertices.size()));
  for (std::size_t i = 0; i < vertices.size(); ++i)
    surface.vertices.col(static_cast<Eigen::Index>(i)) = vertices[i];
  surface.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
  for (std::size_t i = 0; i < triangles.size(); ++i)
    surface.triangles.col(static_cast<Eigen::Index>(i)) =
        Eigen::Map<const Eigen::Vector3i>(triangles[i].data());
  return surface;
}

// A square plate in z = height, outward +z: the brain is below.
TriangleSurface plate(double height) {
  return make_surface({{0, 0, height}, {4, 0, height}, {4, 4, height}, {0, 4, height}},
                      {{0, 1, 2}, {0, 2, 3}});
}

// Two plates that meet in the edge x = 0, z = 0 (from y = -3 to y = 3) and fall away to both
// sides with slope `fall`. Outward is up. Seen from below a fall > 0 is a roof (convex skull), a
// fall < 0 a valley.
TriangleSurface roof(double fall) {
  return make_surface({{0, -3, 0}, {0, 3, 0}, {-4, 0, -4 * fall}, {4, 0, -4 * fall}},
                      {{0, 1, 2}, {1, 0, 3}});
}

std::vector<NodeIndex> all_of(const Points& nodes) {
  std::vector<NodeIndex> slaves(static_cast<std::size_t>(nodes.cols()));
  std::iota(slaves.begin(), slaves.end(), 0);
  return slaves;
}

ContactPair search_one(const Vec3& slave, const TriangleSurface& skull) {
  const auto pairs = search_contact(Points(slave), {0}, skull);
  EXPECT_TRUE(pairs.has_value()) << (pairs ? "" : pairs.error().message);
  return pairs ? pairs->front() : ContactPair{};
}

// Independent oracle: closest point of a triangle by minimising over a barycentric grid that is
// refined round its best point; needs no case distinction between face, edge and vertex.
Vec3 closest_on_triangle(const std::array<Vec3, 3>& corners, const Vec3& x) {
  double u = 1.0 / 3.0, v = 1.0 / 3.0, step = 0.5;
  const auto at = [&](double a, double b) -> Vec3 {
    return (1.0 - a - b) * corners[0] + a * corners[1] + b * corners[2];
  };
  double best = (at(u, v) - x).squaredNorm();
  while (step > 1e-13) {
    bool moved = false;
    for (int du = -1; du <= 1; ++du)
      for (int dv = -1; dv <= 1; ++dv) {
        const double a = u + du * step, b = v + dv * step;
        if (a < 0.0 || b < 0.0 || a + b > 1.0) continue;
        if (const double d = (at(a, b) - x).squaredNorm(); d < best) {
          best = d;
          u = a;
          v = b;
          moved = true;
        }
      }
    if (!moved) step *= 0.5;
  }
  return at(u, v);
}

Vec3 closest_by_brute_force(const TriangleSurface& surface, const Vec3& x) {
  Vec3 best = Vec3::Constant(std::numeric_limits<double>::infinity());
  for (int t = 0; t < surface.num_triangles(); ++t) {
    std::array<Vec3, 3> corners;
    for (int k = 0; k < 3; ++k)
      corners[static_cast<std::size_t>(k)] = surface.vertices.col(surface.triangles(k, t));
    const Vec3 y = closest_on_triangle(corners, x);
    if ((y - x).squaredNorm() < (best - x).squaredNorm()) best = y;
  }
  return best;
}

TEST(ContactSearch, ProjectsOntoAPlateByHand) {
  // 1.5 mm below the plate: y straight above, N down into the brain, gap open by 1.5 mm (eq. 9).
  const ContactPair pair = search_one(Vec3(3.0, 1.0, -0.5), plate(1.0));
  EXPECT_EQ(pair.slave, 0);
  EXPECT_LT((pair.contact_point - Vec3(3.0, 1.0, 1.0)).norm(), 1e-14);
  EXPECT_LT((pair.normal - Vec3(0, 0, -1)).norm(), 1e-14);
  EXPECT_NEAR(pair.initial_penetration_mm, -1.5, 1e-14);
}

TEST(ContactSearch, PenetrationFollowsDisplacement) {
  // Eq. 11: moved 2 mm up through a gap of 1.5 mm, the slave penetrates by 0.5 mm.
  const ContactPair pair = search_one(Vec3(3.0, 1.0, -0.5), plate(1.0));
  const Vec3 displacement(0.3, -0.2, 2.0);
  EXPECT_NEAR(pair.initial_penetration_mm - pair.normal.dot(displacement), 0.5, 1e-14);
}

TEST(ContactSearch, SlaveBeyondTheSkullPenetrates) {
  EXPECT_NEAR(search_one(Vec3(3.0, 1.0, 1.25), plate(1.0)).initial_penetration_mm, 0.25, 1e-14);
}

TEST(ContactSearch, SlaveOnTheSkullIsClosed) {
  const ContactPair pair = search_one(Vec3(3.0, 1.0, 1.0), plate(1.0));
  EXPECT_EQ(pair.initial_penetration_mm, 0.0);
  EXPECT_LT((pair.normal - Vec3(0, 0, -1)).norm(), 1e-14);
}

TEST(ContactSearch, ConcaveEdgeIsUsedWhereNoFaceHoldsAProjection) {
  // From below a valley, projections onto both plates fall beyond the common edge.
  const ContactPair pair = search_one(Vec3(0.1, 0.5, -1.0), roof(-0.5));
  EXPECT_LT((pair.contact_point - Vec3(0, 0.5, 0)).norm(), 1e-14);
  // Both plates are inclined alike, so the mean of their normals is vertical.
  EXPECT_LT((pair.normal - Vec3(0, 0, -1)).norm(), 1e-14);
  EXPECT_NEAR(pair.initial_penetration_mm, -1.0, 1e-14);
}

TEST(ContactSearch, ConvexRoofUsesTheNearerFace) {
  const double fall = 0.5;
  const ContactPair pair = search_one(Vec3(0.4, 0.2, -1.0), roof(fall));
  const Vec3 outward = Vec3(fall, 0, 1).normalized();
  EXPECT_LT((pair.normal + outward).norm(), 1e-14);
  // Distance to the plane fall * x + z = 0.
  const double gap = -(fall * 0.4 - 1.0) / std::hypot(fall, 1.0);
  EXPECT_NEAR(pair.initial_penetration_mm, -gap, 1e-14);
}

TEST(ContactSearch, ConcaveTipUsesTheNode) {
  // A pit pointing down at the slave: neither faces nor edges hold a projection.
  const TriangleSurface pit = make_surface({{0, 0, 0}, {2, 0, 2}, {-1, 1.7, 2}, {-1, -1.7, 2}},
                                           {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}});
  const ContactPair pair = search_one(Vec3(0.05, -0.02, -1.0), pit);
  EXPECT_LT(pair.contact_point.norm(), 1e-14);
  EXPECT_LT(pair.normal.z(), -0.99);
  EXPECT_NEAR(pair.normal.norm(), 1.0, 1e-14);
  EXPECT_NEAR(pair.initial_penetration_mm, -1.0, 0.01);
}

TEST(ContactSearch, SlaveBesideThePlateTakesItsRimOrCorner) {
  const ContactPair rim = search_one(Vec3(2.0, -1.0, 0.0), plate(1.0));
  EXPECT_LT((rim.contact_point - Vec3(2, 0, 1)).norm(), 1e-14);
  EXPECT_NEAR(rim.initial_penetration_mm, -1.0, 1e-14);
  const ContactPair corner = search_one(Vec3(-1.0, -1.0, 0.0), plate(1.0));
  EXPECT_LT((corner.contact_point - Vec3(0, 0, 1)).norm(), 1e-14);
  EXPECT_LT((corner.normal - Vec3(0, 0, -1)).norm(), 1e-14);
}

TEST(ContactSearch, FoldedEdgeHasAFiniteNormal) {
  // Two faces back to back: their normals cancel on the common edge.
  const TriangleSurface fold =
      make_surface({{0, -1, 0}, {0, 1, 0}, {2, 0, 0}, {2, 0, 0}}, {{0, 1, 2}, {1, 0, 3}});
  for (const Vec3& s : {Vec3(-1, 0.3, 0), Vec3(-1, 5, 0), Vec3(1, 0, 0.5), Vec3(0, 0.3, 0)}) {
    const ContactPair pair = search_one(s, fold);
    EXPECT_NEAR(pair.normal.norm(), 1.0, 1e-14);
    EXPECT_TRUE(std::isfinite(pair.initial_penetration_mm));
  }
}

TEST(ContactSearch, SphereInASphereIsOpenByTheGap) {
  const TriangleSurface brain = ellipsoid_surface(Vec3(3, -20, 7), Vec3::Constant(50.0), 6.0);
  const TriangleSurface skull = geometry::offset_surface(brain, 1.0);
  const auto pairs = value_or_fail(search_contact(brain.vertices, all_of(brain.vertices), skull));
  ASSERT_EQ(pairs.size(), static_cast<std::size_t>(brain.num_vertices()));
  for (const ContactPair& pair : pairs) {
    // Faceting moves the skull inwards by at most edge^2 / (6 R) = 0.12 mm between its vertices.
    EXPECT_NEAR(pair.initial_penetration_mm, -1.0, 0.12);
    const Vec3 outward = (brain.vertices.col(pair.slave) - Vec3(3, -20, 7)).normalized();
    EXPECT_GT(pair.normal.dot(-outward), 0.99);
  }
}

TEST(ContactSearch, FindsTheClosestPointOfConvexBodies) {
  const TriangleSurface skull = ellipsoid_surface(Vec3(1, 2, 3), Vec3(20, 17, 15), 4.0);
  const TriangleSurface inner = ellipsoid_surface(Vec3(1.3, 1.9, 3.2), Vec3(19, 16, 14), 5.0);
  const TriangleSurface outer = ellipsoid_surface(Vec3(0.9, 2.2, 2.9), Vec3(20.8, 18, 16), 5.0);
  int open = 0, penetrating = 0;
  for (const TriangleSurface* slaves : {&inner, &outer}) {
    const auto pairs =
        value_or_fail(search_contact(slaves->vertices, all_of(slaves->vertices), skull));
    for (const ContactPair& pair : pairs) {
      const Vec3 s = slaves->vertices.col(pair.slave);
      const Vec3 expected = closest_by_brute_force(skull, s);
      // The oracle's own resolution is the square root of rounding.
      EXPECT_NEAR((pair.contact_point - s).norm(), (expected - s).norm(), 1e-9);
      EXPECT_LT((pair.contact_point - expected).norm(), 1e-5);
      EXPECT_NEAR(pair.normal.norm(), 1.0, 1e-12);
      (pair.initial_penetration_mm > 0.0 ? penetrating : open) += 1;
    }
  }
  EXPECT_EQ(open, inner.num_vertices());
  EXPECT_EQ(penetrating, outer.num_vertices());
}

TEST(ContactSearch, KeepsTheOrderOfTheSlaves) {
  Points nodes(3, 3);
  nodes << 1, 2, 3, 1, 1, 1, 0, 0, 0;
  const auto pairs = value_or_fail(search_contact(nodes, {2, 0}, plate(1.0)));
  ASSERT_EQ(pairs.size(), 2u);
  EXPECT_EQ(pairs[0].slave, 2);
  EXPECT_EQ(pairs[1].slave, 0);
  EXPECT_NEAR(pairs[0].contact_point.x(), 3.0, 1e-14);
}

TEST(ContactSearch, NoSlavesGiveNoPairs) {
  const auto pairs = value_or_fail(search_contact(Points(3, 0), {}, plate(1.0)));
  EXPECT_TRUE(pairs.empty());
}

TEST(ContactSearch, IgnoresVerticesWithoutTriangles) {
  // First in the list, so that indices of master nodes and of vertices differ; right at the
  // slave.
  TriangleSurface skull = plate(1.0);
  const Points corners = skull.vertices;
  skull.vertices.resize(3, 5);
  skull.vertices << Vec3(3.0, 1.0, -0.5), corners;
  skull.triangles.array() += 1;
  for (const Vec3& slave : {Vec3(3.0, 1.0, -0.5), Vec3(0.5, 3.5, -0.5), Vec3(-1.0, -1.0, -0.5)})
    EXPECT_NEAR(search_one(slave, skull).initial_penetration_mm, -1.5, 1e-14);
  EXPECT_LT((search_one(Vec3(-1.0, -1.0, 0.0), skull).contact_point - Vec3(0, 0, 1)).norm(), 1e-14);
}

TEST(ContactSearch, RejectsWhatItCannotSearch) {
  const Points nodes = Vec3(1, 1, 0);
  const auto code = [&](const std::vector<NodeIndex>& slaves, const TriangleSurface& skull) {
    const auto pairs = search_contact(nodes, slaves, skull);
    EXPECT_FALSE(pairs);
    return pairs ? ErrorCode::kInternal : pairs.error().code;
  };
  EXPECT_EQ(code({0}, TriangleSurface{}), ErrorCode::kEmptySet);
  EXPECT_EQ(code({1}, plate(1.0)), ErrorCode::kInvalidArgument);
  EXPECT_EQ(code({-1}, plate(1.0)), ErrorCode::kInvalidArgument);

  TriangleSurface flat = plate(1.0);
  flat.vertices.col(3) = flat.vertices.col(2);
  EXPECT_EQ(code({0}, flat), ErrorCode::kDegenerateMesh);
  TriangleSurface nan = plate(1.0);
  nan.vertices(1, 2) = std::nan("");
  EXPECT_EQ(code({0}, nan), ErrorCode::kNotFinite);
  TriangleSurface dangling = plate(1.0);
  dangling.triangles(0, 1) = 4;
  EXPECT_EQ(code({0}, dangling), ErrorCode::kInvalidArgument);

  Points bad = nodes;
  bad(2, 0) = std::numeric_limits<double>::infinity();
  EXPECT_EQ(search_contact(bad, {0}, plate(1.0)).error().code, ErrorCode::kNotFinite);
}

using test_support::box_mesh;
using test_support::ContactSolution;
using test_support::nodes_where;
using test_support::solve_with_contact;

TEST(PenaltyContact, PenetrationFollowsEquation11) {
  // One slave 1 mm below a ceiling whose normal points down into the body.
  const ContactPair pair{0, Vec3(0, 0, 1), Vec3(0, 0, -1), -1.0};
  const PenaltyContact contact({pair}, 5.0);
  Points u = Points::Zero(3, 1);
  EXPECT_DOUBLE_EQ(contact.penetration(u)[0], -1.0);
  u(2, 0) = 0.4;
  EXPECT_DOUBLE_EQ(contact.penetration(u)[0], -0.6);
  EXPECT_EQ(count(contact.penetrating(u)), 0);
  u(2, 0) = 1.3;
  EXPECT_NEAR(contact.penetration(u)[0], 0.3, 1e-15);
  EXPECT_EQ(count(contact.penetrating(u)), 1);
  u << 9, 9, 0;  // sliding along the ceiling does not close the gap
  EXPECT_DOUBLE_EQ(contact.penetration(u)[0], -1.0);
}

// A column on a floor is pulled upwards against a ceiling by a uniform traction. By hand: without
// ceiling its top rises by u0 = t H / E' with E' the column's modulus; the ceiling at gap g < u0
// holds it at g, so the total contact force is (u0 - g) / u0 of the total pull.
class Column : public ::testing::Test {
 protected:
  static constexpr double kHeight = 30.0, kWidth = 20.0;
  TetMesh mesh = box_mesh(2, 2, 3, Vec3(kWidth, kWidth, kHeight));
  fem::Elasticity tissue{0.0, 0.0021};  // nu = 0: no lateral motion, E' = E = 2 G
  fem::DofMap dofs{mesh.num_nodes()};
  std::vector<NodeIndex> top = nodes_where(mesh, [](const Vec3& x) { return x[2] == kHeight; });
  Points load = Points::Zero(3, mesh.num_nodes());
  double traction = 2.8e-4;  // N/mm^2: u0 = 2 mm
  double free_rise = traction * kHeight / (2 * tissue.shear);

  void SetUp() override {
    for (NodeIndex n : nodes_where(mesh, [](const Vec3& x) { return x[2] == 0.0; }))
      dofs.fix_all(n);
    dofs.finalise();
    const auto faces = geometry::boundary_triangles(mesh);
    for (Eigen::Index f = 0; f < faces.cols(); ++f) {
      bool on_top = true;
      for (int k = 0; k < 3; ++k) on_top = on_top && mesh.nodes(2, faces(k, f)) == kHeight;
      if (!on_top) continue;
      const Vec3 a = mesh.nodes.col(faces(0, f)), b = mesh.nodes.col(faces(1, f)),
                 c = mesh.nodes.col(faces(2, f));
      const double third = (b - a).cross(c - a).norm() / 6.0;
      for (int k = 0; k < 3; ++k) load(2, faces(k, f)) += third * traction;
    }
  }
  ContactSolution solve(double gap, double beta, double* total_force) {
    std::vector<ContactPair> pairs;
    for (NodeIndex n : top) {
      pairs.push_back({n, Vec3(mesh.nodes.col(n)) + Vec3(0, 0, gap), Vec3(0, 0, -1), -gap});
    }
    const PenaltyContact contact(pairs, beta);
    const auto stiffness = fem::assemble_stiffness(mesh, tissue, dofs);
    auto factor = value_or_fail(linalg::SparseCholesky::factorise(stiffness));
    const auto solution = value_or_fail(solve_with_contact(
        stiffness, fem::StiffnessFactor(std::move(factor)), dofs, contact, load));
    const VecX p = contact.penetration(solution.displacement);
    *total_force = 0.0;
    for (int i = 0; i < p.size(); ++i) {
      if (solution.active[static_cast<std::size_t>(i)]) *total_force += beta * p[i];
    }
    return solution;
  }
};

TEST_F(Column, RisesFreelyUnderAnOpenGap) {
  double force = -1.0;
  const ContactSolution solution = solve(free_rise + 0.1, 5.0, &force);
  EXPECT_TRUE(solution.converged);
  EXPECT_EQ(count(solution.active), 0);
  EXPECT_EQ(force, 0.0);
  for (NodeIndex n : top) EXPECT_NEAR(solution.displacement(2, n), free_rise, 1e-11);
}

TEST_F(Column, ContactForceEqualsTheHandComputedOne) {
  const double gap = 0.75;
  const double pull = traction * kWidth * kWidth;
  double force = 0.0;
  const ContactSolution solution = solve(gap, 1e5, &force);
  EXPECT_TRUE(solution.converged);
  EXPECT_EQ(count(solution.active), static_cast<int>(top.size()));
  // The penalty yields force / beta, about 1e-7 of the gap.
  EXPECT_NEAR(force, pull * (free_rise - gap) / free_rise, 1e-6 * pull);
  for (NodeIndex n : top) EXPECT_NEAR(solution.displacement(2, n), gap, 1e-6);
}

TEST_F(Column, SofterPenaltyPenetratesByForceOverBeta) {
  double stiff_force = 0.0, soft_force = 0.0;
  solve(0.75, 1e5, &stiff_force);
  const ContactSolution soft = solve(0.75, 5.0, &soft_force);
  EXPECT_LT(soft_force, stiff_force);
  double penetration = 0.0;
  for (NodeIndex n : top) penetration = std::max(penetration, soft.displacement(2, n) - 0.75);
  EXPECT_GT(penetration, 0.0);
  EXPECT_LT(penetration, 0.01);
}

TEST(ForwardModel, ContactSolutionPressesActiveSlavesAndLeavesTheOthersOpen) {
  const BrainModel model = test_support::toy_patient();
  const auto forward =
      value_or_fail(ForwardModel::build(model, test_support::toy_config(), Boundary::kContact));
  Points load = Points::Zero(3, model.mesh.num_nodes());
  load.row(2).setConstant(0.02);  // lift, so that part of the dome touches
  const auto solution = value_or_fail(solve_with_contact(forward, load));
  EXPECT_TRUE(solution.converged);
  const int active = count(solution.active);
  EXPECT_GT(active, 0);
  EXPECT_LT(active, forward.contact().num_slaves());
  const VecX p = forward.contact().penetration(solution.displacement);
  for (int i = 0; i < p.size(); ++i)
    EXPECT_EQ(p[i] > 0.0, solution.active[static_cast<std::size_t>(i)] != 0);
  // Without contact the same load would go deep into the skull.
  EXPECT_GT(forward.contact().penetration(forward.solve(load)).maxCoeff(), 10 * p.maxCoeff());
}

TEST(ForwardModel, FixedBoundaryHoldsSlavesInTheNormalAndLetsThemSlide) {
  const BrainModel model = test_support::toy_patient();
  const auto forward =
      value_or_fail(ForwardModel::build(model, test_support::toy_config(), Boundary::kFixed));
  EXPECT_EQ(forward.contact().num_slaves(), 0);
  Points load = Points::Zero(3, model.mesh.num_nodes());
  load.row(2).setConstant(-0.02);
  const Points u = forward.solve(load);
  const Points normals = geometry::vertex_normals({model.mesh.nodes, model.boundary_triangles});
  double slide = 0.0;
  for (NodeIndex n : model.slaves) {
    EXPECT_NEAR(u.col(n).dot(normals.col(n)), 0.0, 1e-12);
    slide = std::max(slide, u.col(n).norm());
  }
  EXPECT_GT(slide, 0.1);
}

TEST(ForwardModel, ReportsABodyWithoutFixedNodes) {
  BrainModel model = test_support::toy_patient();
  model.slaves.insert(model.slaves.end(), model.fixed.begin(), model.fixed.end());
  model.fixed.clear();
  refusal_of(ForwardModel::build(model, test_support::toy_config(), Boundary::kContact),
             ErrorCode::kFloatingBody);
}

}  // namespace
}  // namespace brainshift::contact
