// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/contact/woodbury_system.hpp"

#include "common/contact/refactorised_system.hpp"
#include "common/inversion/invert.hpp"
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

// With springs far stiffer than the body the correction cancels most digits: at 1e8 N/mm the first
// answer leaves a relative imbalance of about 1e-8, and only refinement brings it below 1e-11.
TEST(Woodbury, RefinesWhatStiffSpringsCancel) {
  const BrainModel model = test_support::toy_patient();
  CaseConfig config = test_support::toy_config();
  config.contact.penalty_n_per_mm = 1e8;
  const auto forward = ForwardModel::build(model, config, Boundary::kContact);
  ASSERT_TRUE(forward.has_value());
  ActiveSet active(static_cast<std::size_t>(forward->contact().num_slaves()), 0);
  for (std::size_t i = 0; i < active.size(); i += 3) active[i] = 1;
  WoodburySystem woodbury(*forward);
  RefactorisedSystem refactorised(*forward);
  ASSERT_TRUE(woodbury.activate(active).has_value());
  ASSERT_TRUE(refactorised.activate(active).has_value());
  std::srand(3);
  const Points load = Points::Random(3, model.mesh.num_nodes());
  Points u, expected;
  const Status status = woodbury.solve_with_gaps(load, u);
  ASSERT_TRUE(status.has_value()) << status.error().message;
  ASSERT_TRUE(refactorised.solve_with_gaps(load, expected).has_value());
  // The spring forces, 1e8 N, are rounded to 1e-8 N: as a share of the load, which is of size 1.
  EXPECT_LT((u - expected).norm(), 1e-8 * expected.norm());
}

}  // namespace
}  // namespace brainshift::contact
