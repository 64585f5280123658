// SPDX-License-Identifier: GPL-3.0-or-later
#include <Eigen/Cholesky>

#include "common/contact/forward_model.hpp"
#include "common/contact/iterative_system.hpp"
#include "common/contact/penalised_system.hpp"
#include "common/contact/woodbury_system.hpp"
#include "common/core/stopwatch.hpp"
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
        auto system = IterativeSystem::build(forward, {.tolerance = 1e-13, .max_iterations = 5000});
        EXPECT_TRUE(system.has_value()) << system.error().message;
        return std::move(*system);
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
    const Points expected = forward.dofs().expand(k_p.llt().solve(forward.dofs().restrict_to(f)));
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
  const auto changed = system->follow_contact(b, u);
  ASSERT_TRUE(changed.has_value());
  EXPECT_TRUE(*changed);
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
  const auto changed = system->follow_contact(load(), u);
  ASSERT_TRUE(changed.has_value());
  EXPECT_FALSE(*changed);
}

TEST(FullSolve, IsPositiveAndShorterThanAllItsSolvesTogether) {
  const auto model = inversion::prepare(Boundary::kContact);
  const Stopwatch watch;
  const double solve_ms = measure_full_solve_ms(model.forward());
  EXPECT_GT(solve_ms, 0.0);
  EXPECT_LT(5.0 * solve_ms, watch.milliseconds());  // 5 of its 9 solves take the median or more
}

}  // namespace
}  // namespace brainshift::contact
