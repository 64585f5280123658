// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/condensed_exact.hpp"

#include <gmock/gmock.h>

#include "common/inversion/invert.hpp"
#include "common/inversion/prepared/data_region.hpp"
#include "common/inversion/prepared/output_operators.hpp"
#include "tests/unit/inversion/condensed_fixture.hpp"

namespace brainshift::inversion {
namespace {

using testing::HasSubstr;

class CondensedExactly : public Condensed {
 protected:
  static CondensedExact exact(Boundary boundary, const CondensedExactOptions& options = {}) {
    auto made = CondensedExact::build(prepared(boundary), options);
    EXPECT_TRUE(made.has_value());
    return std::move(*made);
  }
  // The data moved off the nodes, into the tetrahedra: all weights count. Those that leave the
  // region stay.
  static SparseData between_nodes(SparseData data) {
    Random random(11);
    std::vector<char> in_region(static_cast<std::size_t>(patient()->mesh.num_nodes()), 0);
    for (const NodeIndex node : data_region(*patient())) {
      in_region[static_cast<std::size_t>(node)] = 1;
    }
    for (int i = 0; i < data.size(); ++i) {
      const Vec3 moved = data.positions.col(i) + 2.0 * random.direction();
      const auto location = prepared(Boundary::kContact).locator().locate(moved);
      bool inside = location.distance_mm == 0.0;
      for (int k = 0; k < 4; ++k) {
        inside = inside && in_region[static_cast<std::size_t>(location.nodes[k])] != 0;
      }
      if (inside) data.positions.col(i) = moved;
    }
    return data;
  }
};

INSTANTIATE_TEST_SUITE_P(Boundaries, CondensedExactly,
                         ::testing::Values(Boundary::kContact, Boundary::kFixed),
                         [](const auto& each) { return std::string(to_string(each.param)); });

// Rounding of two ways to the same displacement of some millimetres.
constexpr double kRounding_mm = 1e-9;

TEST_P(CondensedExactly, EqualsTheDirectPosteriorOfThePenalisedSystem) {
  auto inverter = exact(GetParam());
  const SparseData at_nodes = sagging_data(GetParam(), 0.3);
  const SparseData between = between_nodes(at_nodes);
  ASSERT_FALSE(between.positions == at_nodes.positions);
  for (const SparseData& data : {at_nodes, between}) {
    Estimate estimate;
    ASSERT_TRUE(inverter.update(data, estimate));
    EXPECT_EQ(estimate.status, EstimateStatus::kConverged);
    if (GetParam() == Boundary::kContact) {
      ASSERT_GT(estimate.contact.active, 5) << "the test shows nothing without contact";
    }
    const auto direct = direct_posterior(GetParam(), data, estimate.active_slaves);
    const Eigen::Map<const VecX> u(estimate.displacement.data(), estimate.displacement.size());
    ASSERT_GT(direct.mean.cwiseAbs().maxCoeff(), 1.0);
    EXPECT_LT((u - direct.mean).cwiseAbs().maxCoeff(), kRounding_mm);
    EXPECT_EQ(estimate.sd_mm.size(), 0);
  }
}

// What it says of contact and misfit without the field is true of the field.
TEST_P(CondensedExactly, ForcesPenetrationAndMisfitAreThoseOfTheField) {
  auto inverter = exact(GetParam());
  const SparseData data = sagging_data(GetParam(), 0.3);
  Estimate estimate;
  ASSERT_TRUE(inverter.update(data, estimate));
  const auto& contact = prepared(GetParam()).forward().contact();
  const VecX penetration = contact.penetration(estimate.displacement);
  Eigen::Index active = 0;
  for (int i = 0; i < contact.num_slaves(); ++i) {
    const NodeIndex slave = contact.pairs()[static_cast<std::size_t>(i)].slave;
    if (active < estimate.contact_force_n.size() &&
        estimate.active_slaves[static_cast<std::size_t>(active)] == slave) {
      const double force = estimate.contact_force_n[active++];
      EXPECT_GT(force, -1e-6) << i;
      EXPECT_NEAR(penetration[i], force / contact.beta(), kRounding_mm) << i;
    } else {
      EXPECT_LT(penetration[i], 1e-3 + kRounding_mm) << i;
    }
  }
  EXPECT_EQ(active, estimate.contact_force_n.size());
  Points misfit = data.displacements;
  for (int i = 0; i < data.size(); ++i) {
    const auto at = prepared(GetParam()).locator().locate(data.positions.col(i));
    for (int k = 0; k < 4; ++k) {
      misfit.col(i) -= at.weights[k] * estimate.displacement.col(at.nodes[k]);
    }
  }
  EXPECT_NEAR(estimate.misfit_mm.mean, mean_std_of_norms(misfit).mean, kRounding_mm);
}

TEST_P(CondensedExactly, OneShotAndRepeatedRunsAreBitIdentical) {
  const SparseData data = sagging_data(GetParam(), 0.3);
  const auto once = invert(prepared(GetParam()), data, Method::kCondensedExact);
  ASSERT_TRUE(once.has_value());
  CondensedExactOptions three_threads;
  three_threads.threads = 3;
  auto inverter = exact(GetParam(), three_threads);
  for (int run = 0; run < 2; ++run) {
    Estimate estimate;
    inverter.reset();
    ASSERT_TRUE(inverter.update(data, estimate));
    EXPECT_TRUE(estimate.displacement == once->displacement);
    EXPECT_TRUE(estimate.contact_force_n == once->contact_force_n);
    EXPECT_EQ(estimate.active_slaves, once->active_slaves);
  }
}

TEST_F(CondensedExactly, WarmStartBeginsWithTheLastSet) {
  auto inverter = exact(Boundary::kContact);
  const SparseData data = sagging_data(Boundary::kContact, 0.3);
  Estimate cold, warm;
  ASSERT_TRUE(inverter.update(data, cold));
  ASSERT_TRUE(inverter.update(data, warm));
  EXPECT_GT(cold.contact.iterations, 1);
  EXPECT_EQ(warm.contact.iterations, 1);
  EXPECT_TRUE(warm.displacement == cold.displacement);
  CondensedExactOptions from_nothing;
  from_nothing.warm_start = false;
  auto forgetful = exact(Boundary::kContact, from_nothing);
  for (int run = 0; run < 2; ++run) {
    ASSERT_TRUE(forgetful.update(data, warm));
    EXPECT_EQ(warm.contact.iterations, cold.contact.iterations);
  }
}

TEST_F(CondensedExactly, IterationLimitReturnsTheBestIterateAndSaysSo) {
  CaseConfig hurried = config();
  hurried.condensed.max_contact_iterations = 1;
  const auto model = PreparedModel::prepare(patient(), hurried, Boundary::kContact);
  ASSERT_TRUE(model.has_value());
  auto inverter = CondensedExact::build(*model);
  ASSERT_TRUE(inverter.has_value());
  Estimate estimate;
  ASSERT_TRUE(inverter->update(sagging_data(Boundary::kContact, 0.3), estimate));
  EXPECT_EQ(estimate.status, EstimateStatus::kIterationLimit);
  EXPECT_THAT(estimate.reason, HasSubstr("best iterate"));
}

TEST_F(CondensedExactly, DataOutsideThePreparedRegionAreRefused) {
  const SparseData good = sagging_data(Boundary::kContact, 0.3);
  auto inverter = exact(Boundary::kContact);
  Estimate estimate;
  ASSERT_TRUE(inverter.update(good, estimate));
  const Points before = estimate.displacement;
  SparseData data = good;
  data.positions.col(4) = Vec3(5, 5, 5);  // far from tumour and craniotomy
  auto status = inverter.update(data, estimate);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(status.error().message, HasSubstr("point 4"));
  EXPECT_THAT(status.error().message, HasSubstr("outside the prepared region"));
  data.positions.col(4) = Vec3(30, 30, 300);
  status = inverter.update(data, estimate);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(status.error().message, HasSubstr("outside the brain"));
  status = inverter.update(
      {good.positions.leftCols(2), good.displacements.leftCols(2), good.sd_mm.head(2)}, estimate);
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error().message, HasSubstr("2 points"));
  EXPECT_TRUE(estimate.displacement == before) << "the estimate before must stay";
  EXPECT_TRUE(inverter.update(good, estimate)) << "and the next one must work";
}

TEST_F(CondensedExactly, MemoryBeyondTheLimitIsRefusedBeforeTheWork) {
  CaseConfig small = config();
  small.condensed.memory_limit_gib = 1e-4;
  const auto model = PreparedModel::prepare(patient(), small, Boundary::kContact);
  ASSERT_TRUE(model.has_value());
  bool worked = false;
  CondensedExactOptions options;
  options.progress = [&](std::string_view, double) { worked = true; };
  const auto refused = CondensedExact::build(*model, options);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(refused.error().message, HasSubstr("condensed.memory_limit_gib = 0.0001"));
  EXPECT_FALSE(worked);
}

TEST_F(CondensedExactly, StoppingEndsPreparationAndUpdate) {
  std::stop_source source;
  source.request_stop();
  CondensedExactOptions options;
  options.stop = source.get_token();
  const auto refused = CondensedExact::build(prepared(Boundary::kContact), options);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::kUnavailable);
  auto inverter = exact(Boundary::kContact);
  Estimate estimate;
  InversionOptions asked;
  asked.stop = source.get_token();
  const auto status = inverter.update(sagging_data(Boundary::kContact, 0.3), estimate, asked);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::kNotConverged);
  EXPECT_EQ(status.error().message, "inversion was stopped at iteration 1");
}

}  // namespace
}  // namespace brainshift::inversion
