// SPDX-License-Identifier: GPL-3.0-or-later
// Truths from another mesh with quadratic elements, on the toy patient.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "client/tools/twin/adverse.hpp"
#include "client/tools/twin/other_mesh.hpp"
#include "client/tools/twin/stiffness.hpp"
#include "client/tools/twin/surgery.hpp"
#include "client/tools/twin/truth_load.hpp"
#include "tests/support/results.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::client {
namespace {

constexpr double kSd = 0.3, kLength_mm = 8.0;

const BrainModel& stiffness_patient() {
  static const BrainModel model = test_support::toy_patient(6);
  return model;
}

// ln of the relative shear modulus of every element.
VecX log_stiffness(std::uint64_t seed) {
  const CaseConfig config = test_support::toy_config();
  const VariedBrain varied = vary_stiffness(stiffness_patient(), config, kSd, kLength_mm, seed);
  VecX ln(varied.model.mesh.num_tets());
  for (int t = 0; t < varied.model.mesh.num_tets(); ++t) {
    const int label = varied.model.mesh.labels.at(static_cast<std::size_t>(t));
    ln[t] = std::log(varied.config.material.regions.at(label).shear_modulus_pa /
                     config.material.shear_modulus_pa);
  }
  return ln;
}

Points centroids(const TetMesh& mesh) {
  Points x(3, mesh.num_tets());
  for (int t = 0; t < mesh.num_tets(); ++t) {
    x.col(t) = mesh.nodes(Eigen::all, mesh.tets.col(t)).rowwise().mean();
  }
  return x;
}

TEST(VariedStiffness, IsTheSameBrainForASeed) {
  EXPECT_EQ(log_stiffness(7), log_stiffness(7));
  EXPECT_NE(log_stiffness(7), log_stiffness(8));
}

// Over many brains: mean 0, standard deviation sd, and covariance sd^2 exp(-d^2 / 2 l^2) of two
// elements at a distance d. Classes of 0.5 sd within +-2 sd leave 0.970 of the standard deviation:
// the variance of a standard normal clamped to +-2 is 0.9205, rounding adds 0.5^2 / 12.
TEST(VariedStiffness, HasTheMeanSpreadAndLengthAskedFor) {
  constexpr int kBrains = 60;
  const Points x = centroids(stiffness_patient().mesh);
  const Eigen::Index elements = x.cols();
  double sum = 0.0, squares = 0.0;
  // Of pairs of elements by distance in units of the length: about 1, and beyond 4.
  double near = 0.0, far = 0.0, expected_near = 0.0;
  long near_pairs = 0, far_pairs = 0;
  for (std::uint64_t seed = 1; seed <= kBrains; ++seed) {
    const VecX ln = log_stiffness(seed);
    sum += ln.mean() / kBrains;
    squares += ln.squaredNorm() / static_cast<double>(elements) / kBrains;
    for (Eigen::Index a = 0; a < elements; a += 17) {
      for (Eigen::Index b = a + 1; b < elements; b += 5) {
        const double d = (x.col(a) - x.col(b)).norm() / kLength_mm;
        if (d > 0.7 && d < 1.3) {
          near += ln[a] * ln[b];
          expected_near += std::exp(-0.5 * d * d);
          ++near_pairs;
        } else if (d > 4.0) {
          far += ln[a] * ln[b];
          ++far_pairs;
        }
      }
    }
  }
  ASSERT_GT(near_pairs, 1000);
  ASSERT_GT(far_pairs, 1000);
  // The spread over 60 brains of this size is a fifth of these bounds.
  EXPECT_NEAR(sum, 0.0, 0.03);
  EXPECT_NEAR(std::sqrt(squares), 0.970 * kSd, 0.03 * kSd);
  const double variance = squares;
  EXPECT_NEAR(near / static_cast<double>(near_pairs) / variance,
              expected_near / static_cast<double>(near_pairs), 0.08);
  EXPECT_NEAR(far / static_cast<double>(far_pairs) / variance, 0.0, 0.08);
}

// ln of the relative shear modulus of every element, with tissues told apart.
VecX log_tissues(std::uint64_t seed) {
  const CaseConfig config = test_support::toy_config();
  const auto varied = value_or_fail(vary_tissues(stiffness_patient(), config, seed));
  VecX ln(varied.model.mesh.num_tets());
  for (int t = 0; t < varied.model.mesh.num_tets(); ++t) {
    const int label = varied.model.mesh.labels.at(static_cast<std::size_t>(t));
    ln[t] = std::log(varied.config.material.regions.at(label).shear_modulus_pa /
                     config.material.shear_modulus_pa);
  }
  return ln;
}

// Averaged over brains, what the field adds vanishes, and a tissue is 30 % stiffer or softer with
// equal probability: ln 1.3 and ln 0.7 have the mean -0.047 and the standard deviation 0.31; with
// the field's (0.29, see above) that is 0.42 in all.
TEST(VariedTissues, AreStifferAndSofterByWhatIsSaid) {
  constexpr int kBrains = 60;
  double sum = 0.0, squares = 0.0;
  for (std::uint64_t seed = 1; seed <= kBrains; ++seed) {
    const VecX ln = log_tissues(seed);
    sum += ln.mean() / kBrains;
    squares += ln.squaredNorm() / static_cast<double>(ln.size()) / kBrains;
  }
  EXPECT_NEAR(sum, -0.047, 0.1);
  EXPECT_NEAR(std::sqrt(squares), 0.42, 0.06);
}

TEST(VariedTissues, AreTheSameForASeedAndDifferInTheTumour) {
  EXPECT_EQ(log_tissues(3), log_tissues(3));
  EXPECT_NE(log_tissues(3), log_tissues(4));
  // Centres of tetrahedra well inside the tumour, and well outside it but not at the surface.
  const Points x = centroids(stiffness_patient().mesh);
  int differ = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const VecX ln = log_tissues(seed);
    double inside = 0.0, outside = 0.0;
    int in = 0, out = 0;
    for (Eigen::Index t = 0; t < x.cols(); ++t) {
      const double distance = (x.col(t) - Vec3(30, 30, 40)).norm();
      if (distance < 9.0) inside += ln[t], ++in;
      if (distance > 12.0 && distance < 17.0) outside += ln[t], ++out;
    }
    ASSERT_GT(in, 5);
    ASSERT_GT(out, 5);
    differ += std::abs(inside / in - outside / out) > 0.35 ? 1 : 0;
  }
  EXPECT_GE(differ, 5);  // half of the brains have tissues of unlike sign
  EXPECT_LE(differ, 17);
}

// Gravity alone, as on a case with a mesh of 6 cells.
Scenario sag() {
  Scenario scenario = *find_scenario("paper");
  scenario.fluid_levels_mm = {30.0};
  return scenario;
}

Scenario elsewhere(Scenario scenario) {
  scenario.adverse.other_mesh = true;
  return scenario;
}

struct Played {
  TruthBrain brain;
  Truth truth;
  Points displacement;  // at the case's nodes
};

Played solve(const BrainModel& model, const Scenario& scenario, const BrainModel* other) {
  const CaseConfig config = test_support::toy_config();
  auto brain = value_or_fail(truth_brain(model, config, scenario, 1, other));
  const auto forward = value_or_fail(truth_forward(brain));
  TruthSolver solver(forward);
  const Points load =
      gravity_load(brain, gravity_of(brain.model, scenario), scenario.fluid_levels_mm[0]) +
      constant_load(brain, scenario);
  auto truth = value_or_fail(solver.solve(load));
  Points u = displacement_at_nodes(brain, truth.displacement);
  return {std::move(brain), std::move(truth), std::move(u)};
}

double difference(const Points& a, const Points& b) {
  return (a - b).colwise().norm().mean() / b.colwise().norm().mean();
}

// Quadratic elements on 5 cells come nearer to quadratic elements on 10 cells than linear ones on 6
// do, at the nodes of the case.
TEST(OtherMesh, QuadraticElementsAreNearerToTheLimitThanTheCasesOwn) {
  const BrainModel model = test_support::toy_patient(6);
  const BrainModel coarse = test_support::toy_patient(5), fine = test_support::toy_patient(9);
  const Points own = solve(model, sag(), nullptr).displacement;
  const Points quadratic = solve(model, elsewhere(sag()), &coarse).displacement;
  const Points limit = solve(model, elsewhere(sag()), &fine).displacement;
  ASSERT_EQ(own.cols(), quadratic.cols());
  EXPECT_LT(difference(quadratic, limit), difference(own, limit));
  EXPECT_LT(difference(quadratic, limit), 0.10);
  EXPECT_GT(difference(own, limit), 0.02);  // what an inverse crime hides
}

TEST(OtherMesh, TheSkullHoldsItsMiddlesOfEdges) {
  Scenario scenario = elsewhere(sag());
  scenario.fluid_levels_mm = {0.0};
  scenario.swelling = {0.5, 42.0, 9.0};
  const BrainModel model = test_support::toy_patient(6), other = test_support::toy_patient(5);
  const Played played = solve(model, scenario, &other);
  const auto forward = value_or_fail(truth_forward(played.brain));
  double widest = 0.0;
  for (const contact::ContactPair& pair : forward.contact().pairs()) {
    EXPECT_GE(pair.slave, played.brain.elsewhere->space.num_vertices());
    EXPECT_LT(pair.initial_penetration_mm, -0.5);  // the box's edges are rounded off
    widest = std::max(widest, -pair.initial_penetration_mm);
  }
  EXPECT_NEAR(widest, 1.0, 0.03);  // the toy's gap
  EXPECT_GT(played.truth.active, 10);
  EXPECT_LT(played.truth.max_penetration_mm, 0.1);
  // Nearer to a mesh with six times as many elements than the case's own mesh is.
  const BrainModel fine = test_support::toy_patient(9);
  const Points limit = solve(model, scenario, &fine).displacement;
  scenario.adverse.other_mesh = false;
  const Points own = solve(model, scenario, nullptr).displacement;
  EXPECT_LT(difference(played.displacement, limit), difference(own, limit));
  EXPECT_LT(difference(played.displacement, limit), 0.3);
}

// A surgery from another mesh is scored on the case's mesh and measured where the truth is.
TEST(OtherMesh, ASurgeryKeepsToTheCasesNodes) {
  const BrainModel model = test_support::toy_patient(6), other = test_support::toy_patient(5);
  const Scenario scenario = elsewhere(sag());
  auto brain = value_or_fail(truth_brain(model, test_support::toy_config(), scenario, 1, &other));
  const auto forward = value_or_fail(truth_forward(brain));
  TruthSolver solver(forward);
  const auto surgery = value_or_fail(play_scenario(brain, solver, scenario, 1));
  const io::SurgeryTruth& truth = surgery.truths[0];
  EXPECT_EQ(truth.displacement.cols(), model.mesh.num_nodes());
  EXPECT_EQ(truth.scalars.at("truth_nodes"), brain.elsewhere->space.num_nodes());
  for (const auto& [kind, points] : truth.points) {
    for (const io::ScorePoint& point : points) {
      EXPECT_LT(point.nodes.maxCoeff(), model.mesh.num_nodes()) << kind;
    }
  }
  EXPECT_EQ(surgery.observations[0].case_id, model.case_id);
}

TEST(OtherMesh, AnotherHeadIsRefused) {
  const BrainModel model = test_support::toy_patient(6);
  BrainModel elsewhere = test_support::toy_patient(5);
  elsewhere.mesh.nodes.row(0).array() += 12.0;
  EXPECT_THAT(refusal_of(make_other_mesh(model, elsewhere), ErrorCode::kInvalidArgument),
              testing::HasSubstr("12.0 mm"));
}

TEST(OtherMesh, ACaseWithAReadyMeshIsRefused) {
  CaseConfig config = test_support::toy_config();
  config.mesh = MeshFile{"head.msh"};
  EXPECT_THAT(refusal_of(mesh_anew(config), ErrorCode::kInvalidArgument),
              testing::HasSubstr("mesh.file"));
}

// A quadratic displacement is met exactly at any place.
TEST(SpacePoints, MeetQuadraticDisplacementsExactly) {
  const BrainModel model = test_support::toy_patient(5);
  const fem::DisplacementSpace space = fem::make_space(model.mesh, fem::Element::kP2);
  const auto field = [](const Vec3& x) {
    return Vec3(1e-3 * x[0] * x[1], 2e-3 * x[2] * x[2], 0.1 * x[0] - 1e-3 * x[1] * x[2]);
  };
  Points u(3, space.num_nodes());
  for (int i = 0; i < space.num_nodes(); ++i) u.col(i) = field(space.nodes.col(i));
  const SpacePoints places(geometry::TetLocator(model.mesh), model.tumour.vertices);
  EXPECT_EQ(places.farthest_outside_mm(), 0.0);
  const Points values = places.displacement(space, u);
  for (Eigen::Index i = 0; i < values.cols(); ++i) {
    EXPECT_LT((values.col(i) - field(model.tumour.vertices.col(i))).norm(), 1e-10);
  }
}

}  // namespace
}  // namespace brainshift::client
