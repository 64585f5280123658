// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/condensed_inverter.hpp"

#include <gmock/gmock.h>

#include <limits>

#include "common/core/stopwatch.hpp"
#include "common/inversion/condensed/field_rebuild.hpp"
#include "common/inversion/condensed/load_descent.hpp"
#include "common/inversion/condensed/robust_weights.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/inversion/condensed_fixture.hpp"

namespace brainshift::inversion {
namespace {

using testing::HasSubstr;

INSTANTIATE_TEST_SUITE_P(Boundaries, Condensed,
                         ::testing::Values(Boundary::kContact, Boundary::kFixed),
                         [](const auto& each) { return std::string(to_string(each.param)); });

// Single precision of what is summed from U and G: 6e-8 of each of some hundred terms, which partly
// cancel.
constexpr double kFloatTolerance = 1e-5;

TEST_P(Condensed, EstimateEqualsTheDirectPosteriorOfThePenalisedSystem) {
  const SparseData data = sagging_data(GetParam(), 0.3);
  Estimate estimate;
  auto inverter = Condensed::inverter(GetParam());
  ASSERT_TRUE(inverter.update(data, estimate));
  EXPECT_EQ(estimate.status, EstimateStatus::kConverged);
  if (GetParam() == Boundary::kContact) {
    ASSERT_GT(estimate.contact.active, 5) << "the test shows nothing without contact";
  }
  const auto direct = direct_posterior(GetParam(), data, estimate.active_slaves);
  const Eigen::Map<const VecX> u(estimate.displacement.data(), estimate.displacement.size());
  const double largest_mm = direct.mean.cwiseAbs().maxCoeff();
  ASSERT_GT(largest_mm, 1.0);
  EXPECT_LT((u - direct.mean).cwiseAbs().maxCoeff(), kFloatTolerance * largest_mm + kOmitted_mm);
}

TEST_P(Condensed, DataAlongDirectionsEqualTheDirectPosteriorOfTheirProjections) {
  SparseData data = sagging_data(GetParam(), 0.3);
  data.directions = Points::Zero(3, data.size());
  Random random(8);
  for (int i = 0; i < data.size(); i += 2) {
    const Vec3 n = random.direction();
    data.directions.col(i) = n;
    data.displacements.col(i) = n.dot(data.displacements.col(i)) * n;
  }
  Estimate estimate;
  auto inverter = Condensed::inverter(GetParam());
  ASSERT_TRUE(inverter.update(data, estimate));
  EXPECT_EQ(estimate.status, EstimateStatus::kConverged);
  const auto direct = direct_posterior(GetParam(), data, estimate.active_slaves);
  const Eigen::Map<const VecX> u(estimate.displacement.data(), estimate.displacement.size());
  EXPECT_LT((u - direct.mean).cwiseAbs().maxCoeff(),
            kFloatTolerance * direct.mean.cwiseAbs().maxCoeff() + kOmitted_mm);
  // Whole displacements would have said more.
  SparseData whole = data;
  whole.directions.setZero();
  Estimate other;
  ASSERT_TRUE(inverter.update(whole, other));
  EXPECT_GT((other.displacement - estimate.displacement).cwiseAbs().maxCoeff(), 0.05);
}

// Data that the model explains: noisy samples of an estimate.
SparseData explained(const SparseData& data, const Estimate& estimate,
                     const std::vector<NodeIndex>& region, double noise_mm) {
  SparseData result = data;
  Random random(21);
  for (int i = 0; i < data.size(); ++i) {
    result.displacements.col(i) = estimate.displacement.col(region[static_cast<std::size_t>(i)]);
    for (int axis = 0; axis < 3; ++axis)
      result.displacements(axis, i) += noise_mm * random.normal();
  }
  return result;
}

TEST_P(Condensed, GrossErrorsLoseTheirInfluence) {
  Estimate expected, robust, kept;
  auto inverter = Condensed::inverter(GetParam());
  SparseData clean = sagging_data(GetParam(), 0.3);
  ASSERT_TRUE(inverter.update(clean, expected));
  clean = explained(clean, expected, operators(GetParam())->region, 0.2);
  ASSERT_TRUE(inverter.update(clean, expected));
  SparseData spoilt = clean;
  for (int i = 0; i < spoilt.size(); i += 5) spoilt.displacements.col(i) += Vec3(5.0, -4.0, 3.0);
  spoilt.sources = {{"ius", 0, spoilt.size()}};
  ASSERT_TRUE(inverter.update(spoilt, robust));
  const VecX weights = inverter.weights();
  ASSERT_EQ(weights.size(), spoilt.size());
  for (int i = 0; i < spoilt.size(); ++i) EXPECT_EQ(weights[i] < kOutlierWeight, i % 5 == 0) << i;
  CaseConfig with = config();
  with.sensing.robust_weights = false;
  ASSERT_TRUE(Condensed::inverter(GetParam(), {}, with).update(spoilt, kept));
  const auto error = [&](const Estimate& estimate) {
    return (estimate.displacement - expected.displacement).colwise().norm().maxCoeff();
  };
  EXPECT_LT(error(robust), 0.1 * error(kept));
  ASSERT_EQ(robust.sources.size(), 1u);
  EXPECT_EQ(robust.sources[0].outliers, (clean.size() + 4) / 5);
  EXPECT_THAT(robust.reason, HasSubstr("count less as outliers"));
}

TEST_P(Condensed, ASourceThatContradictsTheOthersIsSaid) {
  Estimate estimate;
  auto inverter = Condensed::inverter(GetParam());
  SparseData data = sagging_data(GetParam(), 0.2);
  data.displacements /= 40.0;  // what the prior expects
  ASSERT_TRUE(inverter.update(data, estimate));
  data = explained(data, estimate, operators(GetParam())->region, 0.2);
  const int half = data.size() / 2;
  data.sources = {{"ius", 0, half}, {"pointer", half, data.size() - half}};
  ASSERT_TRUE(inverter.update(data, estimate));
  ASSERT_EQ(estimate.sources.size(), 2u);
  for (const SourceSummary& source : estimate.sources) {
    EXPECT_TRUE(source.consistent) << source.source << ": " << source.p_value;
    EXPECT_GT(source.degrees_of_freedom, 3.0);
  }
  data.displacements.rightCols(data.size() - half).colwise() += Vec3(2.0, 0.0, 2.0);
  ASSERT_TRUE(inverter.update(data, estimate));
  EXPECT_FALSE(estimate.sources[1].consistent);
  EXPECT_THAT(estimate.reason, HasSubstr("\"pointer\" contradicts the other sources"));
}

// Data given as a function of the displacement converge to the fixed point; here the place of each
// datum shifts by a tenth of the displacement at one node.
TEST_P(Condensed, MovingDataAreMeasuredAnewUntilTheyStay) {
  const SparseData start = sagging_data(GetParam(), 0.2);
  const NodeIndex node = operators(GetParam())->region.front();
  int calls = 0;
  Points last;
  MovingData moving;
  InversionOptions asked;
  asked.moving = &moving;
  moving.nodes = {node};
  moving.relocate = [&](const Points& u, SparseData& data) {
    ++calls;
    const bool moved = last.cols() == 0 || (u - last).norm() > 1e-3;
    last = u;
    if (moved) data.displacements = start.displacements.colwise() + Vec3(0.1 * u.col(0));
    return moved;
  };
  Estimate estimate;
  ASSERT_TRUE(Condensed::inverter(GetParam()).update(start, estimate, asked));
  EXPECT_GE(calls, 2);
  EXPECT_LT((last.col(0) - estimate.displacement.col(node)).norm(), 2e-3);
  // What a still inverter makes of the data where they ended.
  SparseData end = start;
  end.displacements = start.displacements.colwise() + Vec3(0.1 * last.col(0));
  Estimate still;
  ASSERT_TRUE(Condensed::inverter(GetParam()).update(end, still));
  EXPECT_LT((still.displacement - estimate.displacement).cwiseAbs().maxCoeff(), 2e-3);
}

TEST_P(Condensed, MovingDataThatBecomeUselessAreRefused) {
  const SparseData start = sagging_data(GetParam(), 0.2);
  MovingData moving;
  InversionOptions asked;
  asked.moving = &moving;
  moving.nodes = {0};
  moving.relocate = [](const Points&, SparseData& data) {
    data.positions(0, 0) = std::numeric_limits<double>::quiet_NaN();
    return true;
  };
  Estimate estimate;
  refusal_of(Condensed::inverter(GetParam()).update(start, estimate, asked), ErrorCode::kNotFinite);
}

// Loads are averaged over the hypotheses; while the mean keeps the set of the most probable one, so
// are displacements.
TEST_P(Condensed, EstimateWithEstimatedStrengthsIsTheMeanOfTheHypotheses) {
  SparseData data = sagging_data(GetParam(), 0.3);
  data.displacements *= 0.01;  // less than the case's prior expects
  CaseConfig with = config();
  with.prior.estimate_scales = true;
  Estimate estimate;
  auto inverter = Condensed::inverter(GetParam(), {}, with);
  ASSERT_TRUE(inverter.update(data, estimate));
  EXPECT_EQ(estimate.status, EstimateStatus::kConverged);
  ASSERT_GT(estimate.hypotheses.size(), 1u) << "the test shows nothing";
  EXPECT_GT(*std::max_element(estimate.prior_absent.begin(), estimate.prior_absent.end()), 0.5);
  VecX mean = VecX::Zero(estimate.displacement.size());
  for (const Hypothesis& each : estimate.hypotheses) {
    mean +=
        each.weight * direct_posterior(GetParam(), data, estimate.active_slaves, each.scales).mean;
  }
  const Eigen::Map<const VecX> u(estimate.displacement.data(), estimate.displacement.size());
  EXPECT_LT((u - mean).cwiseAbs().maxCoeff(),
            kFloatTolerance * mean.cwiseAbs().maxCoeff() + kOmitted_mm);
}

// Equal in the data region; elsewhere the modes leave variance out, which is added as that of the
// free body.
TEST_P(Condensed, StandardDeviationBoundsTheDirectOneAndEqualsItNearTheData) {
  const SparseData data = sagging_data(GetParam(), 0.3);
  Estimate estimate;
  auto inverter = Condensed::inverter(GetParam());
  ASSERT_TRUE(inverter.update(data, estimate));
  const auto direct = direct_posterior(GetParam(), data, estimate.active_slaves, kAsInTheCase,
                                       DirectCovariance::kYes);
  const auto& region = operators(GetParam())->region;
  // Widened by what the data lie off more than they should.
  double squares = 0.0, free = 3.0 * data.size();
  for (int i = 0; i < data.size(); ++i) {
    const Vec3 off =
        data.displacements.col(i) - estimate.displacement.col(region[static_cast<std::size_t>(i)]);
    squares += off.squaredNorm() / (data.sd_mm[i] * data.sd_mm[i]);
    free -= direct.covariance.diagonal().segment<3>(3 * region[static_cast<std::size_t>(i)]).sum() /
            (data.sd_mm[i] * data.sd_mm[i]);
  }
  const double ratio = std::sqrt(squares / free);
  const double widened = ratio > std::sqrt(1.0 + 2.0 * std::sqrt(2.0 / free)) ? ratio : 1.0;
  for (int node = 0; node < patient()->mesh.num_nodes(); ++node) {
    const double variance = direct.covariance.diagonal().segment<3>(3 * node).mean();
    const double expected_mm = widened * std::sqrt(std::max(0.0, variance));
    EXPECT_GT(estimate.sd_mm[node], 0.98 * expected_mm) << node;
    if (std::binary_search(region.begin(), region.end(), node)) {
      EXPECT_NEAR(estimate.sd_mm[node], expected_mm, 0.05 * expected_mm) << node;
    }
  }
}

TEST_P(Condensed, TheMisfitRatioIsThatOfTheResiduals) {
  SparseData data = sagging_data(GetParam(), 0.3);
  data.positions.col(3) = Vec3(5, 5, 5);  // away from the region
  Estimate estimate;
  CaseConfig plain = config();
  plain.sensing.robust_weights = false;
  ASSERT_TRUE(Condensed::inverter(GetParam(), {}, plain).update(data, estimate));
  const auto& region = operators(GetParam())->region;
  double squares = 0.0;
  for (int i = 0; i < data.size(); ++i) {
    if (i == 3) continue;  // its variance holds what the modes leave out too
    const Vec3 off =
        data.displacements.col(i) - estimate.displacement.col(region[static_cast<std::size_t>(i)]);
    squares += off.squaredNorm() / (3.0 * data.size() * data.sd_mm[i] * data.sd_mm[i]);
  }
  EXPECT_GT(estimate.misfit_ratio, 0.99 * std::sqrt(squares));
  EXPECT_EQ(estimate.data_outside_region, 1);
}

TEST_P(Condensed, ContactHolds) {
  Estimate estimate;
  auto inverter = Condensed::inverter(GetParam());
  ASSERT_TRUE(inverter.update(sagging_data(GetParam(), 0.3), estimate));
  const auto& contact = prepared(GetParam()).forward().contact();
  const VecX penetration = contact.penetration(estimate.displacement);
  Eigen::Index active = 0;
  for (int i = 0; i < contact.num_slaves(); ++i) {
    const NodeIndex slave = contact.pairs()[static_cast<std::size_t>(i)].slave;
    if (active < estimate.contact_force_n.size() &&
        estimate.active_slaves[static_cast<std::size_t>(active)] == slave) {
      const double force = estimate.contact_force_n[active++];
      EXPECT_GE(force, 0.0) << i;                                      // it presses,
      EXPECT_NEAR(penetration[i], force / contact.beta(), 1e-4) << i;  // as the penalty says
    } else {
      EXPECT_LT(penetration[i], kContactViolation_mm + 1e-4) << i;
    }
  }
  EXPECT_EQ(active, estimate.contact_force_n.size());
  EXPECT_LE(estimate.contact.max_violation_mm, kContactViolation_mm);
}

// What came before does not matter.
TEST_P(Condensed, AnEstimateDependsOnItsDataAlone) {
  for (const bool estimated : {false, true}) {
    CaseConfig with = config();
    with.prior.estimate_scales = estimated;
    with.condensed.deadline_ms = 1e6;  // which depends on the machine
    CondensedOptions options;
    options.rank = 150;  // more take seconds where strengths are estimated
    auto used = Condensed::inverter(GetParam(), options, with);
    Estimate a, b;
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      SparseData data = sagging_data(GetParam(), 0.3, seed);
      data.displacements *= 0.15 * static_cast<double>(seed);
      auto fresh = Condensed::inverter(GetParam(), options, with);
      ASSERT_TRUE(used.update(data, a));
      ASSERT_TRUE(fresh.update(data, b));
      EXPECT_EQ(a.displacement, b.displacement) << seed;
      EXPECT_EQ(a.sd_mm, b.sd_mm) << seed;
      EXPECT_EQ(a.prior_scales, b.prior_scales) << seed;
      EXPECT_EQ(a.active_slaves, b.active_slaves) << seed;
    }
  }
}

// With the medium residual field, twice the motion leaves more than the same uncertainty.
TEST_F(Condensed, TheModelsOwnErrorGrowsWithTheMotion) {
  CaseConfig with = config();
  with.prior.estimate_scales = true;
  with.prior.medium_density_sd_n_m3 = 1000.0;
  const auto model = value_or_fail(PreparedModel::prepare(patient(), with, Boundary::kFixed));
  const auto made = value_or_fail(condense(model));
  const auto small_and_large = std::make_shared<const CondensedOperators>(made);
  auto inverter = *CondensedInverter::build(
      small_and_large, std::make_shared<const geometry::TetLocator>(patient()->mesh), with);
  SparseData data = sagging_data(Boundary::kFixed, 0.0);
  data.displacements *= 0.2;
  Estimate little, much;
  ASSERT_TRUE(inverter.update(data, little));
  data.displacements *= 8.0;
  ASSERT_TRUE(inverter.update(data, much));
  EXPECT_GT(much.sd_mm.maxCoeff(), 2.0 * little.sd_mm.maxCoeff());
}

// Contact is certified for where the data are at last.
TEST_P(Condensed, DataThatNeverSettleEndTheRoundsAndAreSaid) {
  auto inverter = Condensed::inverter(GetParam());
  const SparseData data = sagging_data(GetParam(), 0.3);
  int asked = 0;
  MovingData moving;
  moving.nodes = {0};
  moving.relocate = [&](const Points&, SparseData& now) {
    now.displacements = data.displacements * (++asked % 2 == 0 ? 1.0 : 1.02);
    return true;
  };
  InversionOptions options;
  options.moving = &moving;
  Estimate estimate;
  ASSERT_TRUE(inverter.update(data, estimate, options));
  EXPECT_EQ(estimate.status, EstimateStatus::kIterationLimit);
  EXPECT_THAT(estimate.reason, HasSubstr("places of the data did not settle"));
  EXPECT_LE(estimate.contact.decrement, kDecrement);
  EXPECT_GT(asked, 3);
  EXPECT_LT(asked, 20);
}

TEST_P(Condensed, TheCertificateIsMet) {
  auto inverter = Condensed::inverter(GetParam());
  Estimate estimate;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    ASSERT_TRUE(inverter.update(sagging_data(GetParam(), 0.3, seed), estimate));
    EXPECT_EQ(estimate.status, EstimateStatus::kConverged);
    EXPECT_LE(estimate.contact.decrement, kDecrement);
    EXPECT_LE(estimate.contact.max_violation_mm, kContactViolation_mm);
  }
}

TEST_P(Condensed, TheStagesOfAnUpdateAreThoseOfThatUpdateAlone) {
  auto inverter = Condensed::inverter(GetParam());
  Estimate estimate;
  const SparseData data = sagging_data(GetParam(), 0.3);
  ASSERT_TRUE(inverter.update(data, estimate));
  const UpdateProfile first = inverter.profile();
  const Stopwatch watch;
  ASSERT_TRUE(inverter.update(data, estimate));
  const double all_ms = watch.milliseconds();
  double sum_ms = 0.0;
  for (std::size_t i = 0; i < kUpdateStages; ++i) {
    EXPECT_EQ(inverter.profile().stages[i].times, first.stages[i].times) << i;
    sum_ms += inverter.profile().stages[i].ms;
  }
  EXPECT_LE(sum_ms, all_ms) << "stages do not overlap";
  EXPECT_GT(inverter.profile().of(UpdateStage::kContact).times, 0);
  EXPECT_EQ(inverter.profile().of(UpdateStage::kField).times, 1);
}

TEST_P(Condensed, LeavingContactOutChangesNothingElse) {
  const SparseData data = sagging_data(GetParam(), 0.3);
  Estimate full, without_contact;
  ASSERT_TRUE(Condensed::inverter(GetParam()).update(data, full));
  CondensedOptions options;
  options.contact = false;
  ASSERT_TRUE(Condensed::inverter(GetParam(), options).update(data, without_contact));
  EXPECT_EQ(without_contact.contact.active, 0);
  EXPECT_EQ(without_contact.displacement == full.displacement, GetParam() == Boundary::kFixed);
}

// Two kinds of data that no load explains together, with a standard deviation far too small.
TEST_F(Condensed, DataThatThePriorDoesNotExplainWidenTheErrorBarsAndAreSaid) {
  SparseData data = sagging_data(Boundary::kContact, 0.0);
  Estimate fits, off;
  ASSERT_TRUE(Condensed::inverter(Boundary::kContact).update(data, fits));
  EXPECT_THAT(fits.reason, testing::Not(HasSubstr("does not explain")));
  for (int i = 0; i < data.size(); ++i) {
    data.displacements.col(i) += (i % 2 == 0 ? 2.0 : -2.0) * Vec3::UnitX();
  }
  ASSERT_TRUE(Condensed::inverter(Boundary::kContact).update(data, off));
  EXPECT_THAT(off.reason, HasSubstr("the prior does not explain the data"));
  EXPECT_GT(off.sd_mm.mean(), 1.5 * fits.sd_mm.mean());
}

TEST_F(Condensed, DeadlineReturnsTheBestIterateAndSaysSo) {
  CaseConfig hurried = config();
  hurried.condensed.deadline_ms = 1e-9;
  Estimate estimate;
  auto inverter = Condensed::inverter(Boundary::kContact, {}, hurried);
  SparseData data = sagging_data(Boundary::kContact, 0.3);
  const int half = data.size() / 2;
  data.sources = {{"ius", 0, half}, {"pointer", half, data.size() - half}};
  data.displacements.leftCols(half).array() += 5.0;  // which contradicts the others
  ASSERT_TRUE(inverter.update(data, estimate));
  EXPECT_EQ(estimate.status, EstimateStatus::kDeadline);
  EXPECT_THAT(estimate.reason, HasSubstr("best iterate"));
  EXPECT_TRUE(estimate.displacement.allFinite());
  ASSERT_EQ(estimate.sources.size(), 2u);
  for (const SourceSummary& source : estimate.sources) {
    EXPECT_TRUE(std::isnan(source.p_value) && source.consistent) << "the search did not end";
  }
  ASSERT_TRUE(Condensed::inverter(Boundary::kContact).update(data, estimate));
  EXPECT_FALSE(estimate.sources.front().consistent) << "with time it says so";
}

TEST_P(Condensed, ALongUpdateShowsOneProvisionalFieldAndEndsWithTheSameBits) {
  const SparseData data = sagging_data(GetParam(), 0.3);
  Estimate alone, after;
  ASSERT_TRUE(Condensed::inverter(GetParam()).update(data, alone));
  std::vector<Estimate> shown;
  InversionOptions asked;
  asked.on_iterate = [&shown](const Estimate& iterate) { shown.push_back(iterate); };
  asked.spent_ms = 1000.0;  // before the inversion: registration of many points
  ASSERT_TRUE(Condensed::inverter(GetParam()).update(data, after, asked));
  EXPECT_TRUE(after.displacement == alone.displacement);
  EXPECT_TRUE(after.sd_mm == alone.sd_mm);
  EXPECT_TRUE(after.known == alone.known);
  ASSERT_EQ(shown.size(), 1u);
  const Estimate& early = shown.front();
  EXPECT_EQ(early.status, EstimateStatus::kIterating);
  EXPECT_FALSE(early.quality.usable());
  EXPECT_LT(early.history.size(), after.history.size());
  ASSERT_EQ(early.sd_mm.size(), after.sd_mm.size());
  EXPECT_GT(early.sd_mm.minCoeff(), 0.0);
  const VecX apart = (early.displacement - after.displacement).colwise().norm().transpose();
  EXPECT_LT(apart.cwiseQuotient(early.sd_mm).maxCoeff(), 1.0);
}

// A stop is not a deadline, whatever the deadline is: no estimate, and the reason says "stopped".
TEST_P(Condensed, AStopBeforeTheFirstSetEndsTheUpdateAtOnce) {
  CaseConfig hurried = config();
  hurried.condensed.deadline_ms = 1e-9;
  auto inverter = Condensed::inverter(GetParam(), {}, hurried);
  std::stop_source source;
  source.request_stop();
  InversionOptions asked;
  asked.stop = source.get_token();
  Estimate estimate;
  const Status status = inverter.update(sagging_data(GetParam(), 0.3), estimate, asked);
  EXPECT_EQ(refusal_of(status, ErrorCode::kNotConverged), "inversion was stopped at iteration 1");
  EXPECT_EQ(estimate.status, EstimateStatus::kNotRun);
  EXPECT_EQ(estimate.displacement.cols(), 0);
}

TEST_P(Condensed, AStopDuringAnUpdateEndsItBeforeTheNextSetAndTheNextUpdateIsACleanOne) {
  const SparseData data = sagging_data(GetParam(), 0.3);
  auto inverter = Condensed::inverter(GetParam());
  std::stop_source source;
  InversionOptions asked;
  asked.stop = source.get_token();
  // Data that move for ever: without the stop the update would search on, kMaxRounds times.
  int measured = 0;
  MovingData moving;
  moving.nodes = {0};
  moving.relocate = [&](const Points&, SparseData& now) {
    now.displacements.col(0).x() += 1e-3;
    if (++measured == 2) source.request_stop();
    return true;
  };
  asked.moving = &moving;
  Estimate estimate;
  const std::string refusal = sentence_of(inverter.update(data, estimate, asked));
  EXPECT_EQ(measured, 2);
  EXPECT_THAT(refusal, HasSubstr("stopped at iteration"));
  EXPECT_THAT(refusal, testing::Not(HasSubstr("deadline")));

  Estimate after, clean;
  ASSERT_TRUE(inverter.update(data, after));
  ASSERT_TRUE(Condensed::inverter(GetParam()).update(data, clean));
  EXPECT_TRUE(after.displacement == clean.displacement);
}

TEST_F(Condensed, IterationLimitReturnsTheBestIterateAndSaysSo) {
  CaseConfig hurried = config();
  hurried.condensed.max_contact_iterations = 1;
  Estimate estimate;
  auto inverter = Condensed::inverter(Boundary::kContact, {}, hurried);
  ASSERT_TRUE(inverter.update(sagging_data(Boundary::kContact, 0.3), estimate));
  EXPECT_EQ(estimate.status, EstimateStatus::kIterationLimit);
}

TEST_F(Condensed, DataOutsideTheRegionAreRefusedWhereTheCaseSaysSo) {
  SparseData data = sagging_data(Boundary::kContact, 0.0);
  CaseConfig strict = config();
  strict.condensed.outside_region = OutsideRegion::kRefuse;
  auto inverter = Condensed::inverter(Boundary::kContact, {}, strict);
  Estimate estimate;
  EXPECT_TRUE(inverter.update(data, estimate));
  const Points before = estimate.displacement;
  data.positions.col(7) = Vec3(5, 5, 5);  // far from tumour and craniotomy
  EXPECT_THAT(
      refusal_of(inverter.update(data, estimate), ErrorCode::kInvalidArgument),
      testing::AllOf(HasSubstr("point 7 at (5 5 5) mm"), HasSubstr("condensed.outside_region")));
  EXPECT_TRUE(estimate.displacement == before);
}

// condensed.outside_region = extend: a datum away from the region is sampled from the whole arrays,
// and the variance that the modes leave out of the prior there is added to its own.
TEST_F(Condensed, DataFarFromTheRegionAreBelievedLess) {
  CaseConfig coarse = config();
  coarse.condensed.max_rank = 12;  // so few modes leave much of the prior out
  coarse.sensing.robust_weights = false;
  CondensedOptions linear;  // the equations of one update, without a search
  linear.contact = false;
  const auto model = value_or_fail(PreparedModel::prepare(patient(), coarse, Boundary::kContact));
  const CondensedOperators given = std::move(*condense(model));
  const auto update = [&](const CondensedOperators& with, const SparseData& data) {
    auto inverter = CondensedInverter::build(
        std::make_shared<const CondensedOperators>(with),
        std::make_shared<const geometry::TetLocator>(patient()->mesh), coarse, linear);
    Estimate estimate;
    EXPECT_TRUE(inverter->update(data, estimate));
    return estimate;
  };
  SparseData data = sagging_data(Boundary::kContact, 0.0);
  data.displacements *= 0.05;
  data.sd_mm.setConstant(0.01);  // below what the modes leave out, 0.03 mm
  const Vec3 far(5, 5, 5);       // from tumour and craniotomy
  data.positions.col(0) = far;
  data.displacements.col(0) = Vec3(0.5, -0.5, 0.5);
  const Estimate extended = update(given, data);

  const geometry::TetLocation at = model.locator().locate(far);
  double left_out_mm2 = 0.0;
  for (int k = 0; k < 4; ++k) {
    const int node = at.nodes[k];
    if (std::binary_search(given.region.begin(), given.region.end(), node)) continue;
    for (int c = 0; c < 4; ++c) {
      left_out_mm2 += at.weights[k] * static_cast<double>(given.control_weights(c, node)) *
                      given.truncated_variance_mm2.row(given.control_neighbours(c, node)).sum();
    }
  }
  ASSERT_GT(std::sqrt(left_out_mm2), data.sd_mm[0]) << "the test shows nothing";

  // Operators that leave nothing out, and a datum that says itself how little it is worth.
  CondensedOperators complete = given;
  complete.truncated_variance_mm2.setZero();
  SparseData worth_less = data;
  worth_less.sd_mm[0] = std::sqrt(data.sd_mm[0] * data.sd_mm[0] + left_out_mm2);
  const double scale_mm = extended.displacement.cwiseAbs().maxCoeff();
  // The same equations; the sums of the variance are in another order.
  EXPECT_LT(
      (update(complete, worth_less).displacement - extended.displacement).cwiseAbs().maxCoeff(),
      1e-6 * scale_mm);
  // Believed as it stands, the datum would move the estimate.
  EXPECT_GT((update(complete, data).displacement - extended.displacement).cwiseAbs().maxCoeff(),
            0.01 * scale_mm);
}

// What is refused: contract/data_check_test.cpp.
TEST_F(Condensed, RefusedDataLeaveTheEstimateAndTheNextUpdateAsTheyWere) {
  const SparseData good = sagging_data(Boundary::kContact, 0.3);
  CondensedInverter inverter = Condensed::inverter(Boundary::kContact);
  Estimate estimate;
  ASSERT_TRUE(inverter.update(good, estimate));
  const Points before = estimate.displacement;
  SparseData bad = good, outside = good;
  bad.displacements(1, 3) = std::numeric_limits<double>::quiet_NaN();
  outside.positions.col(2) = Vec3(30, 30, 300);
  for (const SparseData& refused : {bad, outside}) {
    EXPECT_FALSE(inverter.update(refused, estimate));
    EXPECT_TRUE(estimate.displacement == before);
    ASSERT_TRUE(inverter.update(good, estimate));
    EXPECT_TRUE(estimate.displacement == before);
  }
}

}  // namespace
}  // namespace brainshift::inversion
