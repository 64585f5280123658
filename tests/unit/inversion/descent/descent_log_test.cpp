// SPDX-License-Identifier: GPL-3.0-or-later
// What every descent method owes its caller: history, iterates, status, reason, a stop when asked.
#include "common/inversion/descent/descent_log.hpp"

#include <algorithm>

#include "common/inversion/inverter.hpp"
#include "tests/unit/inversion/toy_inversion.hpp"

namespace brainshift::inversion {
namespace {

class DescentMethods : public ::testing::TestWithParam<Method> {
 protected:
  static Result<Estimate> run(const PreparedModel& model, const SparseData& data,
                              const InversionOptions& options = {}) {
    return invert(model, data, GetParam(), options);
  }
};

INSTANTIATE_TEST_SUITE_P(Methods, DescentMethods,
                         ::testing::Values(Method::kPaper, Method::kPaperWoodbury,
                                           Method::kIterativeSolver),
                         [](const auto& each) {
                           std::string name(to_string(each.param));
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

TEST_P(DescentMethods, PublishEveryIterateAndConverge) {
  const PreparedModel model = prepare(Boundary::kContact);
  InversionOptions options;
  std::size_t iterates = 0;
  options.on_iterate = [&](const Estimate& iterate) {
    ++iterates;
    EXPECT_EQ(iterate.status, EstimateStatus::kIterating);
    EXPECT_EQ(iterate.history.size(), iterates);
    EXPECT_EQ(iterate.history.back().iteration, static_cast<int>(iterates));
  };
  const auto estimate = run(model, sagging_data(model, 0.1), options);
  ASSERT_TRUE(estimate.has_value()) << estimate.error().message;
  EXPECT_EQ(estimate->history.size(), iterates);
  EXPECT_EQ(estimate->status, EstimateStatus::kConverged);
  EXPECT_NE(estimate->reason.find("misfit changed by less than 0.001"), std::string::npos)
      << estimate->reason;
  EXPECT_NEAR(estimate->history.front().misfit_mm.mean, estimate->initial_misfit_mm.mean, 1e-12);
  EXPECT_LT(estimate->misfit_mm.mean, 0.2 * estimate->initial_misfit_mm.mean);
  EXPECT_EQ(estimate->active_slaves.size(),
            static_cast<std::size_t>(estimate->contact_force_n.size()));
}

TEST_P(DescentMethods, KeepTheLastIterateAtTheIterationLimit) {
  CaseConfig config = test_support::toy_config();
  config.inversion.max_iterations = 2;
  const PreparedModel model = prepare(Boundary::kContact, config);
  const auto estimate = run(model, sagging_data(model, 0.1));
  ASSERT_TRUE(estimate.has_value()) << estimate.error().message;
  EXPECT_EQ(estimate->status, EstimateStatus::kIterationLimit);
  EXPECT_EQ(estimate->history.size(), 2u);
  EXPECT_GT(estimate->displacement.norm(), 0.0);
  EXPECT_NE(estimate->reason.find("limit 2"), std::string::npos) << estimate->reason;
}

TEST_P(DescentMethods, StopWhenAsked) {
  const PreparedModel model = prepare(Boundary::kContact);
  std::stop_source source;
  InversionOptions options;
  options.stop = source.get_token();
  options.on_iterate = [&](const Estimate& iterate) {
    if (iterate.history.size() == 2) source.request_stop();
  };
  const auto estimate = run(model, sagging_data(model, 0.1), options);
  ASSERT_FALSE(estimate.has_value());
  EXPECT_EQ(estimate.error().code, ErrorCode::kNotConverged);
  EXPECT_NE(estimate.error().message.find("iteration 3"), std::string::npos)
      << estimate.error().message;
}

TEST_P(DescentMethods, AreAtTheMinimumWhenNothingMoved) {
  const PreparedModel model = prepare(Boundary::kContact);
  SparseData data = sagging_data(model, 0.0);
  data.displacements.setZero();
  const auto estimate = run(model, data);
  ASSERT_TRUE(estimate.has_value()) << estimate.error().message;
  EXPECT_EQ(estimate->status, EstimateStatus::kConverged);
  EXPECT_NE(estimate->reason.find("gradient is zero"), std::string::npos) << estimate->reason;
  EXPECT_EQ(estimate->displacement.norm(), 0.0);
}

}  // namespace
}  // namespace brainshift::inversion
