// SPDX-License-Identifier: Apache-2.0
#include "client/lib/field.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <limits>

#include "common/core/random.hpp"

namespace brainshift::client {
namespace {

// The cube [0, 10]^3 mm as cells^3 cubes of six tetrahedra (Kuhn).
BrainModel cube(int cells) {
  BrainModel model;
  model.model_id = "cube";
  const int n = cells + 1;
  model.mesh.nodes.resize(3, n * n * n);
  for (int i = 0; i < n * n * n; ++i) {
    model.mesh.nodes.col(i) = 10.0 / cells * Vec3(i % n, i / n % n, i / n / n);
  }
  std::vector<Eigen::Vector4i> tets;
  std::array<int, 3> axes = {0, 1, 2};
  do {
    for (int c = 0; c < cells * cells * cells; ++c) {
      std::array<int, 3> corner = {c % cells, c / cells % cells, c / cells / cells};
      Eigen::Vector4i tet;
      for (int k = 0; k < 4; ++k) {
        if (k > 0) ++corner.at(static_cast<std::size_t>(axes.at(static_cast<std::size_t>(k - 1))));
        tet[k] = corner[0] + n * (corner[1] + n * corner[2]);
      }
      if ((axes[0] + 1) % 3 != axes[1]) std::swap(tet[2], tet[3]);
      tets.push_back(tet);
    }
  } while (std::next_permutation(axes.begin(), axes.end()));
  model.mesh.tets.resize(4, static_cast<Eigen::Index>(tets.size()));
  for (std::size_t t = 0; t < tets.size(); ++t) {
    model.mesh.tets.col(static_cast<Eigen::Index>(t)) = tets[t];
  }
  return model;
}

// Bends the cube; a node's sd is a tenth of its x, what is known 1 - x / 10.
Update bent(const BrainModel& model, double mm) {
  Update update;
  update.model_id = model.model_id;
  update.sequence = 3;
  const Points& x = model.mesh.nodes;
  update.estimate.displacement.resize(3, x.cols());
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    update.estimate.displacement.col(i) =
        mm * Vec3(std::sin(0.3 * x(1, i)), 1.0 + 0.1 * x(0, i), std::cos(0.3 * x(0, i)));
  }
  update.estimate.sd_mm = 0.1 * x.row(0).transpose();
  update.estimate.known = 1.0 - 0.1 * x.row(0).transpose().array();
  update.estimate.quality.quality = Quality::kGood;
  return update;
}

Points random_points(int count, double low, double high) {
  Random random(5);
  Points points(3, count);
  for (Eigen::Index i = 0; i < points.size(); ++i) {
    points.data()[i] = low + (high - low) * random.uniform();
  }
  return points;
}

TEST(Field, AtTheNodesIsTheUpdateAndLinearBetweenThem) {
  const BrainModel model = cube(4);
  const Update update = bent(model, 1.0);
  const auto field = Field::of(*FieldMesh::build(model), update);
  ASSERT_TRUE(field) << field.error().message;
  const FieldValues at_nodes = field->at(model.mesh.nodes);
  EXPECT_LT((at_nodes.displacement - update.estimate.displacement).cwiseAbs().maxCoeff(), 1e-12);
  const Points points = random_points(1000, 0.0, 10.0);
  const FieldValues values = field->at(points);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    ASSERT_EQ(values.where[static_cast<std::size_t>(i)], Where::kInside);
    EXPECT_NEAR(values.sd_mm[i], 0.1 * points(0, i), 1e-12);  // linear in x
    EXPECT_NEAR(values.known[i], 1.0 - 0.1 * points(0, i), 1e-12);
    EXPECT_NEAR(values.displacement(1, i), 1.0 + 0.1 * points(0, i), 1e-12);
  }
}

TEST(Field, UndeformedTakesBackWhatAtHasMoved) {
  const BrainModel model = cube(6);
  for (const double mm : {0.0, 0.1, 1.0, 2.5}) {
    const auto field = Field::of(*FieldMesh::build(model), bent(model, mm));
    const Points rest = random_points(2000, 0.0, 10.0);
    const Points moved = rest + field->at(rest).displacement;
    const Undeformed was = field->undeformed(moved);
    EXPECT_LT((was.points - rest).cwiseAbs().maxCoeff(), 1e-9) << mm;  // NaN fails too
    EXPECT_LT((was.field.sd_mm - 0.1 * rest.row(0).transpose()).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(Field, OutsideOfTheMeshSaysSoAndHasNoNumber) {
  const BrainModel model = cube(3);
  const auto field = Field::of(*FieldMesh::build(model), bent(model, 2.0));
  Points points(3, 5);
  const double inf = std::numeric_limits<double>::infinity();
  points << 10.001, -1e-3, 5.0, inf, std::nan(""),  //
      5.0, 5.0, 1e9, 5.0, 5.0,                      //
      5.0, 5.0, 5.0, 5.0, 5.0;
  const FieldValues values = field->at(points);
  const Undeformed was = field->undeformed(points.rightCols(3));
  EXPECT_EQ(values.where, std::vector<Where>(5, Where::kOutside));
  EXPECT_EQ(was.where, std::vector<Where>(3, Where::kOutside));
  EXPECT_TRUE(values.displacement.array().isNaN().all() && values.sd_mm.array().isNaN().all());
  EXPECT_TRUE(was.points.array().isNaN().all() && was.field.known.array().isNaN().all());
  // The cube has moved up by 2 to 4 mm: where it was there is nothing now.
  EXPECT_EQ(field->undeformed(Vec3(5.0, 0.5, 5.0)).where[0], Where::kOutside);
  EXPECT_EQ(field->at(Vec3(5.0, 0.5, 5.0)).where[0], Where::kInside);
}

TEST(Field, OfAPartIsKnownWhereEveryNodeWasReceived) {
  const BrainModel model = cube(4);
  Update update = bent(model, 1.0);
  FieldPart part{.mesh_nodes = model.mesh.num_nodes(), .nodes = {}};
  for (NodeIndex i = 0; i < model.mesh.num_nodes(); ++i) {
    if (model.mesh.nodes(0, i) <= 5.0) part.nodes.push_back(i);
  }
  const auto whole = Field::of(*FieldMesh::build(model), update);
  Points chosen(3, static_cast<Eigen::Index>(part.nodes.size()));
  for (std::size_t i = 0; i < part.nodes.size(); ++i) {
    chosen.col(static_cast<Eigen::Index>(i)) = update.estimate.displacement.col(part.nodes[i]);
  }
  update.estimate.displacement = chosen;
  update.estimate.sd_mm.resize(0);
  update.estimate.known.resize(0);
  update.part = part;
  const auto field = Field::of(*FieldMesh::build(model), update);
  ASSERT_TRUE(field) << field.error().message;
  const Points points = random_points(500, 0.0, 10.0);
  const FieldValues values = field->at(points);
  EXPECT_EQ(values.sd_mm.size(), 0);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const bool has = points(0, i) <= 5.0;
    ASSERT_EQ(values.where[static_cast<std::size_t>(i)],
              has ? Where::kInside : Where::kNotReceived);
    if (has) {
      EXPECT_EQ(values.displacement.col(i), whole->at(points.col(i)).displacement);
    }
  }
}

TEST(Field, OfAnotherModelMeshOrVerdictIsRefused) {
  const BrainModel model = cube(2);
  const auto mesh = FieldMesh::build(model);
  const auto refusal = [&](auto change) {
    Update update = bent(model, 1.0);
    change(update);
    const auto field = Field::of(*mesh, update);
    return field ? std::string("taken") : field.error().message;
  };
  EXPECT_EQ(refusal([](Update&) {}), "taken");
  EXPECT_EQ(refusal([](Update& u) { u.model_id = "ball"; }),
            "update 3: it is of model ball, the mesh of cube");
  EXPECT_EQ(refusal([](Update& u) { u.estimate.quality.quality = Quality::kUnusable; }),
            "update 3: its field may not be shown: it is an iterate or unusable");
  EXPECT_EQ(refusal([](Update& u) { u.final = false; }),
            "update 3: its field may not be shown: it is an iterate or unusable");
  const std::string mesh_of = "update 3: its field is not one of a mesh of 27 nodes";
  EXPECT_EQ(refusal([](Update& u) { u.estimate.displacement.conservativeResize(3, 26); }), mesh_of);
  EXPECT_EQ(refusal([](Update& u) { u.estimate.known.conservativeResize(26); }), mesh_of);
  EXPECT_EQ(refusal([](Update& u) {
              u.estimate.displacement.conservativeResize(3, 1);
              u.estimate.sd_mm.resize(0);
              u.estimate.known.resize(0);
              u.part = FieldPart{.mesh_nodes = 27, .nodes = {27}};
            }),
            mesh_of);
  EXPECT_EQ(refusal([](Update& u) {
              u.part = FieldPart{.mesh_nodes = 27, .nodes = {}, .base_sequence = 2};
            }),
            "update 3: it carries only what changed");
}

TEST(Field, AMeshThatNamesNoNodeIsRefusedAndAnEmptyOneHoldsNothing) {
  BrainModel model = cube(1);
  model.mesh.tets(2, 0) = 8;
  EXPECT_EQ(FieldMesh::build(model).error().message,
            "model: a tetrahedron names a node that is none");
  model = {};
  model.model_id = "none";
  Update update = bent(model, 0.0);
  EXPECT_EQ(Field::of(*FieldMesh::build(model), update)->at(Vec3::Zero()).where[0],
            Where::kOutside);
}

// A head of 130,000 tetrahedra. Bounds are ten times what one core takes: the test is for the kind
// of fault that makes look-ups walk through the mesh. It prints the figures.
TEST(Field, LooksPointsUpInMicroseconds) {
  using Clock = std::chrono::steady_clock;
  const auto ms = [](Clock::time_point since) {
    return std::chrono::duration<double, std::milli>(Clock::now() - since).count();
  };
  const BrainModel model = cube(28);
  const Points points = random_points(100000, 0.0, 10.0);
  auto begin = Clock::now();
  const auto mesh = FieldMesh::build(model);
  const double build_ms = ms(begin);
  const auto field = Field::of(*mesh, bent(model, 0.5));
  begin = Clock::now();
  const FieldValues values = field->at(points);
  const double at_us = 1e3 * ms(begin) / 100000.0;
  begin = Clock::now();
  (void)field->undeformed(Vec3(5.0, 5.0, 5.0));
  const double first_ms = ms(begin);
  begin = Clock::now();
  (void)field->undeformed(points + values.displacement);
  const double inverse_us = 1e3 * ms(begin) / 100000.0;
  std::printf("locator %.1f ms, at %.2f us a point, moved locator %.1f ms, undeformed %.2f us\n",
              build_ms, at_us, first_ms, inverse_us);
  EXPECT_LT(build_ms, 500.0);
  EXPECT_LT(at_us, 10.0);
  EXPECT_LT(inverse_us, 10.0);
}

}  // namespace
}  // namespace brainshift::client
