// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/export/deformed_surface.hpp"

#include <gmock/gmock.h>

#include "common/geometry/surface.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::client {
namespace {

// Linear, so that interpolation is exact.
Points linear_field(const Points& x) {
  Mat3 gradient;
  gradient << 0.05, -0.02, 0.0, 0.01, -0.04, 0.03, 0.0, 0.02, 0.06;
  return (gradient * x).colwise() + Vec3(1, -2, 3);
}
VecX linear_sd(const Points& x) { return (0.01 * x.row(2)).transpose().array() + 0.2; }

void expect_moved(const DeformedSurface& made, const TriangleSurface& before) {
  ASSERT_EQ(made.vertex_fields.size(), 2u);
  EXPECT_EQ(made.vertex_fields[0].name, "displacement_mm");
  EXPECT_EQ(made.vertex_fields[1].name, "sd_mm");
  EXPECT_EQ(made.surface.triangles, before.triangles);
  const Points u = linear_field(before.vertices);
  EXPECT_LT((made.vertex_fields[0].values - u).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((made.surface.vertices - before.vertices - u).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT(
      (made.vertex_fields[1].values.transpose() - linear_sd(before.vertices)).cwiseAbs().maxCoeff(),
      1e-9);
}

TEST(DeformedSurface, TumourAndCortexMoveWithTheirField) {
  const BrainModel model = test_support::toy_patient(4);
  const Points u = linear_field(model.mesh.nodes);
  const VecX sd = linear_sd(model.mesh.nodes);
  ASSERT_GT(model.tumour.num_vertices(), 20);
  expect_moved(deformed_tumour(model, u, sd), model.tumour);
  expect_moved(deformed_cortex(model, u, sd), geometry::boundary_surface(model.mesh));
}

TEST(DeformedSurface, WithoutAStandardDeviationThereIsNoSuchField) {
  const BrainModel model = test_support::toy_patient(3);
  const Points u = Points::Zero(3, model.mesh.num_nodes());
  EXPECT_EQ(deformed_tumour(model, u, {}).vertex_fields.size(), 1u);
  EXPECT_EQ(deformed_cortex(model, u, {}).vertex_fields.size(), 1u);
}

}  // namespace
}  // namespace brainshift::client
