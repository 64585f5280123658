// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/contact/woodbury_system.hpp"

#include "common/contact/penalised_system.hpp"
#include "common/inversion/inverter.hpp"
#include "tests/support/toy_patient.hpp"
#include "tests/unit/inversion/toy_inversion.hpp"

namespace brainshift::contact {
namespace {

using inversion::prepare;
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

}  // namespace
}  // namespace brainshift::contact
