// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "common/core/random.hpp"
#include "common/inversion/condensed/load_descent.hpp"
#include "common/inversion/condensed/newton_steps.hpp"
#include "tests/unit/inversion/condensed_fixture.hpp"

namespace brainshift::inversion {
namespace {

VecX vec(double x, double y) { return Eigen::Vector2d(x, y); }

TEST(NewtonBundle, OnePieceIsItsOwnMinimum) {
  NewtonBundle bundle(2);
  bundle.add_here(vec(3.0, -1.0));
  bundle.solve();
  EXPECT_EQ(bundle.step(), vec(3.0, -1.0));
  EXPECT_DOUBLE_EQ(bundle.fall(), 5.0);
}

TEST(NewtonBundle, WhereTwoPiecesMeetTheStepIsTheFootOfThePerpendicular) {
  NewtonBundle bundle(2);
  bundle.add_here(vec(1.0, 3.0));
  bundle.add_here(vec(1.0, -1.0));
  bundle.solve();
  EXPECT_NEAR((bundle.step() - vec(1.0, 0.0)).norm(), 0.0, 1e-5);
  EXPECT_NEAR(bundle.fall(), 0.5, 1e-6);
}

TEST(NewtonBundle, PiecesAroundTheOriginPromiseNothing) {
  NewtonBundle bundle(2);
  for (const VecX& s : {vec(1, 2), vec(-3, 1), vec(0.5, -2)}) bundle.add_here(s);
  bundle.solve();
  EXPECT_LT(bundle.fall(), 1e-6);
}

// max(q1, q2) with q1 = 1/2 |x - a|^2 and q2 = 1/2 |x - b|^2 + c: the step from any point of the
// first piece, once the second was met anywhere, is the minimum of the edge.
TEST(NewtonBundle, APieceThatWasMetElsewhereIsSeenFromThePoint) {
  const VecX a = vec(4.0, 0.0), b = vec(-4.0, 1.0);
  const double c = 3.0;
  const auto q1 = [&](const VecX& x) { return 0.5 * (x - a).squaredNorm(); };
  const auto q2 = [&](const VecX& x) { return 0.5 * (x - b).squaredNorm() + c; };
  const VecX point = vec(-5.0, 0.0), trial = vec(3.5, 2.0);
  ASSERT_GT(q1(point), q2(point));
  ASSERT_GT(q2(trial), q1(trial));
  NewtonBundle bundle(2);
  bundle.add_here(a - point);
  ASSERT_TRUE(bundle.add_at(trial - point, q2(trial) - q1(point), b - trial));
  bundle.solve();
  const VecX found = point + bundle.step();
  EXPECT_NEAR(q1(found), q2(found), 1e-3);
  EXPECT_NEAR(bundle.fall(), q1(point) - q1(found), 1e-3);
  // On the edge, the direction along it does not fall: a - x and b - x are parallel there.
  const VecX to_a = a - found, to_b = b - found;
  EXPECT_NEAR(to_a[0] * to_b[1] - to_a[1] * to_b[0], 0.0, 1e-2);
  EXPECT_LT(to_a.dot(to_b), 0.0);
}

TEST(NewtonBundle, PiecesMoveWithThePoint) {
  const VecX a = vec(4.0, 0.0), b = vec(-4.0, 1.0), d = vec(0.5, 0.25);
  const VecX point = vec(-5.0, 0.0), trial = vec(3.5, 2.0);
  const auto q1 = [&](const VecX& x) { return 0.5 * (x - a).squaredNorm(); };
  const auto q2 = [&](const VecX& x) { return 0.5 * (x - b).squaredNorm() + 3.0; };
  NewtonBundle moved(2), there(2);
  moved.add_here(a - point);
  ASSERT_TRUE(moved.add_at(trial - point, q2(trial) - q1(point), b - trial));
  moved.move(d, q1(point) - q1(point + d));
  ASSERT_EQ(moved.count(), 2);
  moved.solve();
  there.add_here(a - point - d);
  ASSERT_TRUE(there.add_at(trial - point - d, q2(trial) - q1(point + d), b - trial));
  there.solve();
  EXPECT_NEAR((moved.step() - there.step()).norm(), 0.0, 1e-3);
  EXPECT_NEAR(moved.fall(), there.fall(), 1e-5 * there.fall());
}

TEST(NewtonBundle, APieceThatTheFunctionFallsBelowIsDropped) {
  NewtonBundle bundle(2);
  bundle.add_here(vec(1.0, 0.0));
  bundle.move(vec(0.5, 0.0), 1.0);  // the piece promised 3/8
  EXPECT_EQ(bundle.count(), 0);
}

TEST(NewtonBundle, APieceAboveTheFunctionAtThePointIsNotKept) {
  NewtonBundle bundle(2);
  bundle.add_here(vec(1.0, 0.0));
  // 0.1 |d|^2 + d_x at d = (-4, 0): it rises by -2.4, its Newton step with curvature 1 is (-0.2,
  // 0).
  EXPECT_FALSE(bundle.add_at(vec(-4.0, 0.0), -2.4, vec(-0.2, 0.0)));
  EXPECT_EQ(bundle.count(), 1);
  EXPECT_TRUE(bundle.add_at(vec(-4.0, 0.0), -8.8 + 1e-12, vec(-0.2, 0.0)));
}

// No step promises more: the minimum of the model is above that of each of its pieces' mixtures.
TEST(NewtonBundle, MeetsTheConditionOfTheMinimum) {
  Random random(3);
  NewtonBundle bundle(40);
  std::vector<VecX> steps;
  for (int i = 0; i < NewtonBundle::kMax; ++i) {
    VecX s = VecX::Constant(40, 0.4);
    for (double& value : s) value += random.normal();
    steps.push_back(s);
    bundle.add_here(s);
  }
  bundle.solve();
  const double squared = bundle.step().squaredNorm();
  ASSERT_GT(squared, 1.0);
  for (const VecX& s : steps) EXPECT_GT(s.dot(bundle.step()), squared * (1.0 - 1e-5));
}

TEST(NewtonBundle, AFullOneKeepsWhatCounts) {
  Random random(4);
  NewtonBundle bundle(5);
  double before = 1e9;
  for (int i = 0; i < 3 * NewtonBundle::kMax; ++i) {
    VecX s = VecX::Constant(5, 2.0);
    for (double& value : s) value += random.normal();
    bundle.add_here(s);
    bundle.solve();
    EXPECT_LE(bundle.fall(), before * (1.0 + 1e-5)) << i;
    EXPECT_LE(bundle.count(), NewtonBundle::kMax);
    before = bundle.fall();
  }
}

constexpr Eigen::Index kSize = 6;

VecX random_vector(Random& random) {
  VecX v(kSize);
  for (double& value : v) value = random.normal();
  return v;
}

// A second derivative with eigenvalues from 1 on.
Eigen::MatrixXd second_derivative(Random& random) {
  Eigen::MatrixXd a(kSize, kSize);
  for (double& value : a.reshaped()) value = random.normal();
  return a * a.transpose() + Eigen::MatrixXd::Identity(kSize, kSize);
}

VecX apply(const QuasiNewton& estimate, const VecX& v) {
  VecX out(kSize);
  estimate.apply(v, out);
  return out;
}

TEST(QuasiNewton, BeginsWithTheIdentity) {
  Random random(1);
  QuasiNewton estimate(kSize);
  const VecX v = random_vector(random);
  EXPECT_EQ(apply(estimate, v), v);
  const VecX s = random_vector(random);
  ASSERT_TRUE(estimate.learn(s, 3.0 * s));
  EXPECT_NE(apply(estimate, v), v);
  estimate.reset();
  EXPECT_EQ(apply(estimate, v), v);
}

TEST(QuasiNewton, MeetsTheSecantEquationOfTheLastPair) {
  Random random(2);
  const Eigen::MatrixXd h = second_derivative(random);
  QuasiNewton estimate(kSize);
  for (int i = 0; i < 10; ++i) {
    const VecX s = random_vector(random);
    ASSERT_TRUE(estimate.learn(s, h * s));
    EXPECT_NEAR((apply(estimate, h * s) - s).norm(), 0.0, 1e-10 * s.norm());
  }
}

// With exact line searches on a quadratic function, BFGS ends in as many steps as there are
// unknowns (Nocedal & Wright 2006, theorem 6.4).
TEST(QuasiNewton, EndsOnAQuadraticFunctionInAsManyStepsAsUnknowns) {
  Random random(3);
  const Eigen::MatrixXd h = second_derivative(random);
  QuasiNewton estimate(kSize);
  VecX x = random_vector(random), gradient = h * x;
  for (Eigen::Index k = 0; k < kSize; ++k) {
    const VecX direction = -apply(estimate, gradient);
    const double length = -gradient.dot(direction) / direction.dot(h * direction);
    x += length * direction;
    const VecX next = h * x;
    estimate.learn(length * direction, next - gradient);
    gradient = next;
  }
  EXPECT_LT(x.norm(), 1e-8);
}

TEST(QuasiNewton, StaysPositiveDefiniteAndLeavesOutPairsWithoutCurvature) {
  Random random(4);
  QuasiNewton estimate(kSize);
  for (int i = 0; i < 200; ++i) {
    const VecX s = random_vector(random), y = random_vector(random), v = random_vector(random);
    const VecX before = apply(estimate, v);
    const bool learned = estimate.learn(s, y);
    EXPECT_EQ(learned, s.dot(y) > 0.0);
    if (!learned) {
      EXPECT_EQ(apply(estimate, v), before);
    }
    EXPECT_GT(v.dot(apply(estimate, v)), 0.0);
  }
}

// A descent on the toy, as CondensedInverter drives it.
struct Descent {
  Descent(std::shared_ptr<const CondensedOperators> given,
          std::shared_ptr<const geometry::TetLocator> locator, const CaseConfig& config)
      : operators(std::move(given)),
        window{0, operators->num_modes()},
        sampled(operators, std::move(locator), window, OutsideRegion::kExtend, team),
        strengths(operators->part_columns, window, SparseData::kMaxCommonErrors, true, 0.0, team),
        descent(*operators, window, config.contact.penalty_n_per_mm, true, team, profile) {
    limits.out_of_time = [] { return false; };
    limits.on_step = [] {};
  }

  // To the most probable loads under strengths that are estimated once.
  void find(const SparseData& data) {
    descent.reserve(data.size());
    sampled.reserve(data.size());
    ASSERT_TRUE(sampled.locate(data));
    sampled.sample(data, RemainderVariances::Ones(), VecX::Ones(data.size()));
    ASSERT_TRUE(descent.take(sampled));
    ASSERT_TRUE(strengths.fit(descent.posterior().gram(), descent.posterior().right_hand_side()));
    ASSERT_TRUE(descent.jump(sampled, strengths));
    ASSERT_TRUE(descent.descend(sampled, strengths, false, limits));
    ASSERT_TRUE(
        strengths.refit(descent.posterior().gram(), descent.posterior().right_hand_side(), false));
  }

  // 1/2 |R^-1/2 (d - A u)|^2 with contact as it is, for data without common errors.
  double misfit(const VecX& z) {
    const auto all = sampled.free_body();
    VecX left = all.col(window.count) - all.leftCols(window.count) * z;
    const ContactAtLoads& contact = descent.contact();
    if (contact.size() > 0) left -= sampled.contact(contact.active()) * contact.forces();
    return 0.5 * left.squaredNorm();
  }

  ThreadTeam team{1};
  std::shared_ptr<const CondensedOperators> operators;
  ModeWindow window;
  SampledOperators sampled;
  PriorStrengths strengths;
  UpdateProfile profile;
  LoadDescent descent;
  DescentLimits limits;
};

using LoadDescentTest = Condensed;

// A few nodes that move outwards, against the skull.
SparseData swelling_data(const BrainModel& brain, const std::vector<NodeIndex>& region,
                         double motion_mm, std::uint64_t seed) {
  Random random(seed);
  const Vec3 centre = brain.mesh.nodes.rowwise().mean();
  constexpr int kData = 8;
  SparseData data{Points(3, kData), Points(3, kData), VecX::Constant(kData, 0.1)};
  for (int i = 0; i < kData; ++i) {
    const auto place =
        static_cast<std::size_t>(random.uniform() * static_cast<double>(region.size()));
    const Vec3 x = brain.mesh.nodes.col(region[place]);
    data.positions.col(i) = x;
    data.displacements.col(i) = motion_mm * (x - centre).normalized() + 0.1 * random.direction();
  }
  return data;
}

TEST_F(LoadDescentTest, TheMeanOverHypothesesMissesTheDataNoMoreThanTheMostProbableLoads) {
  const auto locator = std::make_shared<const geometry::TetLocator>(patient()->mesh);
  const auto given = operators(Boundary::kContact);
  int pressed = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    Descent toy(given, locator, config());
    toy.find(swelling_data(*patient(), given->region, 0.4 * static_cast<double>(seed), seed));
    const double most_probable = toy.misfit(toy.descent.most_probable());
    ASSERT_EQ(value_or_fail(toy.descent.average(toy.sampled, toy.strengths)), true);
    const double mean = toy.misfit(toy.descent.z());
    pressed = std::max(pressed, toy.descent.contact().size());
    EXPECT_LE(mean, most_probable + kLostByMean + 1e-9);
  }
  EXPECT_GT(pressed, 20) << "the test shows nothing without contact";
}

TEST_F(LoadDescentTest, WhenTimeIsOverTheLoadsStayWithTheirContact) {
  const auto locator = std::make_shared<const geometry::TetLocator>(patient()->mesh);
  Descent toy(operators(Boundary::kContact), locator, config());
  const SparseData data = swelling_data(*patient(), toy.operators->region, 2.0, 3);
  toy.find(data);
  const VecX loads = toy.descent.most_probable();
  // Far from where the loads are:
  const SparseData next = swelling_data(*patient(), toy.operators->region, 6.0, 3);
  toy.sampled.sample(next, RemainderVariances::Ones(), VecX::Constant(data.size(), 0.01));
  ASSERT_TRUE(toy.descent.take(toy.sampled));
  const std::vector<int> active = toy.descent.contact().active();
  ASSERT_FALSE(active.empty());
  ASSERT_TRUE(
      toy.strengths.fit(toy.descent.posterior().gram(), toy.descent.posterior().right_hand_side()));
  toy.limits.out_of_time = [] { return true; };
  EXPECT_FALSE(value_or_fail(toy.descent.jump(toy.sampled, toy.strengths, toy.limits)));
  EXPECT_EQ(value_or_fail(toy.descent.descend(toy.sampled, toy.strengths, false, toy.limits)),
            EstimateStatus::kDeadline);
  EXPECT_FALSE(value_or_fail(toy.descent.average(toy.sampled, toy.strengths, toy.limits)));
  EXPECT_EQ(toy.descent.most_probable(), loads);
  EXPECT_EQ(toy.descent.z(), loads);
  EXPECT_EQ(toy.descent.contact().active(), active);
  EXPECT_LE(toy.descent.contact().violation_mm(), kContactViolation_mm);
}

}  // namespace
}  // namespace brainshift::inversion
