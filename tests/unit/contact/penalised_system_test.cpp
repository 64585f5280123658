// SPDX-License-Identifier: GPL-3.0-or-later

#include <limits>

#include "common/contact/forward_model.hpp"
#include "common/contact/iterative_system.hpp"
#include "common/contact/penalised_system.hpp"
#include "common/core/stopwatch.hpp"
#include "common/inversion/descent/descents.hpp"
#include "common/inversion/inverter.hpp"
#include "tests/support/dense.hpp"
#include "tests/support/results.hpp"
#include "tests/support/toy_patient.hpp"
#include "tests/unit/inversion/toy_inversion.hpp"

namespace brainshift::contact {
namespace {

using inversion::patient;
using inversion::prepare;

enum class Kind { kRefactorised, kWoodbury, kIterative };

class PenalisedSystems : public ::testing::TestWithParam<Kind> {
 protected:
  static std::unique_ptr<PenalisedSystem> make(const ForwardModel& forward) {
    switch (GetParam()) {
      case Kind::kRefactorised: return std::make_unique<RefactorisedSystem>(forward);
      case Kind::kWoodbury: return std::make_unique<WoodburySystem>(forward);
      case Kind::kIterative: {
        return value_or_fail(
            IterativeSystem::build(forward, {.tolerance = 1e-13, .max_iterations = 5000}));
      }
    }
    return nullptr;
  }
  static Points load() {
    std::srand(3);
    return Points::Random(3, patient()->mesh.num_nodes());
  }
};

INSTANTIATE_TEST_SUITE_P(Kinds, PenalisedSystems,
                         ::testing::Values(Kind::kRefactorised, Kind::kWoodbury, Kind::kIterative),
                         [](const auto& each) -> std::string {
                           if (each.param == Kind::kRefactorised) return "refactorised";
                           return each.param == Kind::kWoodbury ? "woodbury" : "iterative";
                         });

// Independent reference: K_p formed and factorised with dense matrices. Sets follow one another,
// so that columns and factors of the set before must not leak into the next.
TEST_P(PenalisedSystems, EqualsADenseSolveForEverySet) {
  const inversion::PreparedModel model = prepare(Boundary::kContact);
  const ForwardModel& forward = model.forward();
  const auto system = make(forward);
  ActiveSet few = some_active(model);
  ActiveSet others(few.size(), 0);
  for (std::size_t i = 1; i < others.size(); i += 2) others[i] = 1;
  const ActiveSet none(few.size(), 0);
  const ActiveSet all(few.size(), 1);
  const Points f = load();
  for (const ActiveSet& active : {few, others, none, all, few}) {
    ASSERT_TRUE(system->activate(active).has_value());
    EXPECT_EQ(system->active(), active);
    Eigen::MatrixXd k_p = Eigen::MatrixXd(forward.stiffness()).selfadjointView<Eigen::Lower>();
    for (std::size_t i = 0; i < active.size(); ++i) {
      if (!active[i]) continue;
      Points normal = Points::Zero(3, f.cols());
      normal.col(forward.contact().pairs()[i].slave) = forward.contact().pairs()[i].normal;
      const VecX n = forward.dofs().restrict_to(normal);
      k_p += forward.contact().beta() * n * n.transpose();
    }
    const Points expected =
        forward.dofs().expand(test_support::solve_positive(k_p, forward.dofs().restrict_to(f)));
    Points u;
    ASSERT_TRUE(system->solve(f, u).has_value());
    ASSERT_GT(expected.norm(), 1.0);
    EXPECT_LT((u - expected).norm(), 1e-9 * expected.norm()) << count(active);
  }
}

TEST_P(PenalisedSystems, CountsSetsButNotTheEmptyOneNorARepeat) {
  const inversion::PreparedModel model = prepare(Boundary::kContact);
  const auto system = make(model.forward());
  const ActiveSet some = some_active(model);
  const ActiveSet none(some.size(), 0);
  for (const ActiveSet& active : {none, some, some, none, some}) {
    ASSERT_TRUE(system->activate(active).has_value());
  }
  EXPECT_EQ(system->changes(), 2);
}

TEST_P(PenalisedSystems, FollowingContactPushesPenetratingSlavesBack) {
  const inversion::PreparedModel model = prepare(Boundary::kContact);
  const auto system = make(model.forward());
  const Points b = 5e-2 * load();
  Points u;
  ASSERT_TRUE(system->solve_with_gaps(b, u).has_value());
  const double before = model.forward().contact().penetration(u).maxCoeff();
  ASSERT_GT(before, 0.5);
  const auto changed = value_or_fail(system->follow_contact(b, u));
  EXPECT_TRUE(changed);
  Points again;
  ASSERT_TRUE(system->solve_with_gaps(b, again).has_value());
  EXPECT_LT((again - u).norm(), 1e-9 * u.norm());
  const VecX after = model.forward().contact().penetration(u);
  for (Eigen::Index i = 0; i < after.size(); ++i) {
    if (!system->active()[i]) continue;
    EXPECT_LT(after[i], 0.1 * before);
  }
}

TEST_P(PenalisedSystems, SolveWithoutSlaves) {
  const inversion::PreparedModel model = prepare(Boundary::kFixed);
  const auto system = make(model.forward());
  Points u;
  ASSERT_TRUE(system->solve(load(), u).has_value());
  EXPECT_LT((u - model.forward().solve(load())).norm(), 1e-9 * u.norm());
  const auto changed = value_or_fail(system->follow_contact(load(), u));
  EXPECT_FALSE(changed);
}

TEST(FullSolve, IsPositiveAndShorterThanAllItsSolvesTogether) {
  const auto model = inversion::prepare(Boundary::kContact);
  const Stopwatch watch;
  const double solve_ms = measure_full_solve_ms(model.forward());
  EXPECT_GT(solve_ms, 0.0);
  EXPECT_LT(5.0 * solve_ms, watch.milliseconds());  // 5 of its 9 solves take the median or more
}

using inversion::sagging_data;

TEST(Woodbury, SolvesForAColumnOnce) {
  const inversion::PreparedModel model = prepare(Boundary::kContact);
  WoodburySystem system(model.forward());
  EXPECT_EQ(system.columns(), 0);
  ActiveSet active = some_active(model);
  ASSERT_TRUE(system.activate(active).has_value());
  const int first = system.columns();
  EXPECT_EQ(first, count(active));
  active[0] = 0;
  active[1] = 1;
  ASSERT_TRUE(system.activate(active).has_value());
  EXPECT_EQ(system.columns(), first + 1);
}

TEST(Woodbury, EqualsRefactorisation) {
  const inversion::PreparedModel model = prepare(Boundary::kContact);
  const SparseData data = sagging_data(model, 0.3);
  const auto run = [&](Method method) {
    std::vector<std::vector<NodeIndex>> sets;
    inversion::InversionOptions options;
    options.on_iterate = [&](const Estimate& iterate) { sets.push_back(iterate.active_slaves); };
    return std::make_pair(inversion::invert(model, data, method, options), sets);
  };
  const auto [paper, paper_sets] = run(Method::kPaper);
  const auto [woodbury, woodbury_sets] = run(Method::kPaperWoodbury);
  ASSERT_TRUE(paper.has_value() && woodbury.has_value());
  ASSERT_GT(paper->contact.iterations, 1);
  ASSERT_GT(paper->displacement.cwiseAbs().maxCoeff(), 1.0);
  EXPECT_LT((woodbury->displacement - paper->displacement).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_EQ(woodbury->history.size(), paper->history.size());
  EXPECT_EQ(woodbury->contact.iterations, paper->contact.iterations);
  EXPECT_EQ(woodbury_sets, paper_sets);
  EXPECT_EQ(woodbury->reason, paper->reason);
}

// Springs far stiffer than the body, a third of them active, and some load.
struct StiffSprings {
  explicit StiffSprings(double beta) {
    CaseConfig config = test_support::toy_config();
    config.contact.penalty_n_per_mm = beta;
    forward =
        std::make_unique<ForwardModel>(*ForwardModel::build(model, config, Boundary::kContact));
    active.assign(static_cast<std::size_t>(forward->contact().num_slaves()), 0);
    for (std::size_t i = 0; i < active.size(); i += 3) active[i] = 1;
    std::srand(3);
    load = Points::Random(3, model.mesh.num_nodes());
  }
  BrainModel model = test_support::toy_patient();
  std::unique_ptr<ForwardModel> forward;
  ActiveSet active;
  Points load;
};

// A load of 1e8 N on the springs cancels most digits: the first answer leaves a relative imbalance
// of about 1e-8, and only refinement brings it below 1e-11.
TEST(Woodbury, RefinesWhatStiffSpringsCancel) {
  StiffSprings toy(1e8);
  WoodburySystem woodbury(*toy.forward);
  RefactorisedSystem refactorised(*toy.forward);
  ASSERT_TRUE(woodbury.activate(toy.active).has_value());
  ASSERT_TRUE(refactorised.activate(toy.active).has_value());
  Points with_springs = toy.load;
  toy.forward->contact().add_load(with_springs, toy.active);
  Points u, expected;
  const Status status = woodbury.solve(with_springs, u);
  ASSERT_TRUE(status.has_value()) << status.error().message;
  ASSERT_TRUE(refactorised.solve(with_springs, expected).has_value());
  // The spring forces, 1e8 N, are rounded to 1e-8 N: as a share of the load, which is of size 1.
  EXPECT_LT((u - expected).norm(), 1e-8 * expected.norm());
}

// The contact forces are of the size of the load however stiff the springs are. Through a load of
// 1e9 N on the springs they come out wrong by a fifth.
TEST(Woodbury, GapsOfStiffSpringsLeaveTheContactForcesTheirDigits) {
  StiffSprings toy(1e9);
  WoodburySystem woodbury(*toy.forward);
  ASSERT_TRUE(woodbury.activate(toy.active).has_value());
  Points u;
  ASSERT_TRUE(woodbury.solve_with_gaps(toy.load, u).has_value());
  // What the springs press, by equilibrium of the body: f = K u - b at the slaves.
  const fem::DofMap& dofs = toy.forward->dofs();
  const VecX pressed =
      toy.forward->stiffness().selfadjointView<Eigen::Lower>() * dofs.restrict_to(u) -
      dofs.restrict_to(toy.load);
  const VecX penetration = toy.forward->contact().penetration(u);
  double largest = 0.0, apart = 0.0;
  for (int i = 0; i < penetration.size(); ++i) {
    if (!toy.active[static_cast<std::size_t>(i)]) continue;
    const ContactPair& pair = toy.forward->contact().pairs()[static_cast<std::size_t>(i)];
    const int first = dofs.unknown(pair.slave, 0);
    const double force = pair.normal.dot(pressed.segment<3>(first));
    largest = std::max(largest, std::abs(force));
    apart = std::max(apart, std::abs(force - 1e9 * penetration[i]));
  }
  ASSERT_GT(largest, 0.1);
  // A solve with K leaves u of millimetres uncertain by some 1e-13 mm, which the springs turn into
  // 1e-4 N; the forces are of some newtons.
  EXPECT_LT(apart, 1e-4 * largest);
}

Points load() {
  std::srand(3);
  return Points::Random(3, patient()->mesh.num_nodes());
}

// The stop rule asks for a residual of 1e-8 of the cold start's. A guess that is wrong by 1e-4
// has half of the digits already, so about half of the iterations remain. One that is wrong by
// its own size saves nothing and must not spoil the answer.
TEST(IterativeSystem, AGoodFirstGuessSavesIterations) {
  const inversion::PreparedModel model = prepare(Boundary::kContact);
  const auto system = value_or_fail(IterativeSystem::build(model.forward()));
  const Points f = load();
  const auto solve_from = [&](Points& u) {
    const int before = system->iterations();
    EXPECT_TRUE(system->solve(f, u).has_value());
    return system->iterations() - before;
  };
  Points exact;
  const int cold = solve_from(exact);
  ASSERT_GT(cold, 10);
  Points same = exact;
  EXPECT_EQ(solve_from(same), 0);
  Points near = 1.0001 * exact;
  const int warm = solve_from(near);
  EXPECT_GT(warm, 0);
  EXPECT_LE(warm, 3 * cold / 4);
  Points far = 2.0 * exact;
  solve_from(far);
  // A residual of 1e-8 times the condition of the toy's stiffness, about 1e2.
  for (const Points& u : {near, far}) EXPECT_LT((u - exact).norm(), 1e-6 * exact.norm());
}

TEST(IterativeSystem, ReportsTheLimitThatStopsIt) {
  const inversion::PreparedModel model = prepare(Boundary::kContact);
  const auto system = value_or_fail(
      IterativeSystem::build(model.forward(), {.tolerance = 1e-8, .max_iterations = 3}));
  Points u;
  EXPECT_THAT(refusal_of(system->solve(load(), u), ErrorCode::kNotConverged),
              testing::HasSubstr("after 3 iterations"));
}

TEST(IterativeSystem, RejectsALoadThatIsNotFinite) {
  const inversion::PreparedModel model = prepare(Boundary::kContact);
  const auto system = value_or_fail(
      IterativeSystem::build(model.forward(), {.tolerance = 1e-8, .max_iterations = 50}));
  Points f = load();
  f(0, 3) = std::numeric_limits<double>::quiet_NaN();
  Points u;
  EXPECT_FALSE(system->solve(f, u).has_value());
}

// 1e-3 mm: a two-hundredth of the data's standard deviation.
TEST(IterativeSystem, GivesTheEstimateOfDirectSolves) {
  for (Boundary boundary : {Boundary::kContact, Boundary::kFixed}) {
    const inversion::PreparedModel model = prepare(boundary);
    const SparseData data = sagging_data(model, 0.3);
    WoodburySystem woodbury(model.forward());
    const auto direct = inversion::conjugate_gradients(model, data, {}, woodbury);
    const auto iterative = inversion::invert(model, data, Method::kIterativeSolver);
    ASSERT_TRUE(direct.has_value() && iterative.has_value());
    ASSERT_GT(direct->displacement.cwiseAbs().maxCoeff(), 1.0);
    EXPECT_LT((iterative->displacement - direct->displacement).colwise().norm().maxCoeff(), 1e-3);
    EXPECT_EQ(iterative->active_slaves, direct->active_slaves);
  }
}

}  // namespace
}  // namespace brainshift::contact
