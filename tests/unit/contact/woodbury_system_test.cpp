// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/contact/woodbury_system.hpp"

#include "common/inversion/invert.hpp"
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

}  // namespace
}  // namespace brainshift::contact
