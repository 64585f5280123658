// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/operations/latency_record.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <random>
#include <span>
#include <vector>

#include "common/core/statistics.hpp"

namespace brainshift::server {
namespace {

// From a microsecond to 17 minutes, as many in every decade.
std::vector<double> random_times_ms(std::size_t count) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> exponent(-3.0, 6.0);
  std::vector<double> values(count);
  for (double& value : values) value = std::pow(10.0, exponent(random));
  return values;
}

std::unique_ptr<LatencyRecord> record_of(const std::vector<double>& values) {
  auto record = std::make_unique<LatencyRecord>();
  for (const double value : values) record->add(value);
  return record;
}

TEST(LatencyRecord, HoldsNothingAtFirst) {
  const LatencyRecord record;
  EXPECT_EQ(record.recent(), wire::LatencyFigures{});
  EXPECT_EQ(record.all(), wire::LatencyFigures{});
  EXPECT_EQ(record.sum_ms(), 0.0);
}

// A bucket is at most 1/64 of its value wide, and its middle stands for it.
TEST(LatencyRecord, PercentilesOfAllAreWithinOnePercentOfTheSortedValues) {
  for (const std::size_t count : {1u, 2u, 100u, 30000u}) {
    std::vector<double> values = random_times_ms(count);
    const auto figures = record_of(values)->all();
    std::sort(values.begin(), values.end());
    const auto of_rank = [&](double q) {
      const auto rank = static_cast<std::size_t>(std::ceil(q * static_cast<double>(count)));
      return values[rank - 1];
    };
    EXPECT_EQ(figures.count, count);
    EXPECT_NEAR(figures.p50_ms, of_rank(0.50), 0.01 * of_rank(0.50));
    EXPECT_NEAR(figures.p95_ms, of_rank(0.95), 0.01 * of_rank(0.95));
    EXPECT_NEAR(figures.p99_ms, of_rank(0.99), 0.01 * of_rank(0.99));
    EXPECT_EQ(figures.max_ms, values.back());
  }
}

TEST(LatencyRecord, RecentAreExactAndOfTheLastOnesAlone) {
  std::vector<double> values = random_times_ms(3 * LatencyRecord::kRecent + 17);
  values[5] = 1e7;  // long ago
  const auto record = record_of(values);
  const std::span<const double> last(values.end() - LatencyRecord::kRecent, values.end());
  const auto figures = record->recent();
  EXPECT_EQ(figures.count, LatencyRecord::kRecent);
  EXPECT_EQ(figures.p50_ms, percentile(last, 50.0));
  EXPECT_EQ(figures.p95_ms, percentile(last, 95.0));
  EXPECT_EQ(figures.p99_ms, percentile(last, 99.0));
  EXPECT_EQ(figures.max_ms, *std::max_element(last.begin(), last.end()));
  EXPECT_EQ(record->all().max_ms, 1e7);
}

TEST(LatencyRecord, EveryValueLiesInOneBucketUpToItsBound) {
  const std::vector<double> values = random_times_ms(5000);
  const auto record = record_of(values);
  std::uint64_t below = 0;
  for (std::size_t i = 0; i < LatencyRecord::kBounds_ms.size(); ++i) {
    below += record->buckets()[i];
    const double bound = LatencyRecord::kBounds_ms[i];
    const auto counted =
        std::count_if(values.begin(), values.end(), [&](double value) { return value <= bound; });
    EXPECT_EQ(below, static_cast<std::uint64_t>(counted)) << bound;
  }
  EXPECT_EQ(below + record->buckets().back(), values.size());
  EXPECT_DOUBLE_EQ(record->sum_ms(), std::accumulate(values.begin(), values.end(), 0.0));
}

TEST(LatencyRecord, ABoundItselfLiesBelowIt) {
  for (std::size_t i = 0; i < LatencyRecord::kBounds_ms.size(); ++i) {
    const auto record = record_of({LatencyRecord::kBounds_ms[i]});
    EXPECT_EQ(record->buckets()[i], 1u);
  }
}

TEST(LatencyRecord, ExtremesAreCountedAndLeaveItsMemoryAlone) {
  const auto record = record_of({-1.0, 0.0, 1e-9, 1e300});
  EXPECT_EQ(record->all().count, 4u);
  EXPECT_EQ(record->all().max_ms, 1e300);
  EXPECT_LT(record->all().p50_ms, 1e-6);
  EXPECT_EQ(record->buckets().front(), 3u);
  EXPECT_EQ(record->buckets().back(), 1u);
}

double usual_ms(UsualTime& usual, std::uint64_t session_id) {
  return usual.answer(session_id, 0.0, false).usual_ms;
}

TEST(UsualTime, NothingIsUsualUntilThereAreAFewAnswers) {
  UsualTime usual;
  for (std::uint64_t i = 0; i < UsualTime::kFew; ++i) {
    const AnswerTime time = usual.answer(1, 30.0, true);
    EXPECT_EQ(time.ms, 30.0);
    EXPECT_EQ(time.usual_ms, 0.0) << i;
  }
  EXPECT_NEAR(usual_ms(usual, 1), 30.0, 0.3);
}

TEST(UsualTime, IsTheMedianOfAllAnswersOfTheSessionThatCount) {
  UsualTime usual;
  for (int i = 0; i < 3000; ++i) usual.answer(1, 20.0, true);
  for (int i = 0; i < 2900; ++i) usual.answer(1, 500.0, true);  // long, but not for most of it
  for (int i = 0; i < 2900; ++i) usual.answer(1, 900.0, false);
  EXPECT_NEAR(usual_ms(usual, 1), 20.0, 0.2);
  for (int i = 0; i < 200; ++i) usual.answer(1, 500.0, true);
  EXPECT_NEAR(usual_ms(usual, 1), 500.0, 5.0);
}

TEST(UsualTime, AnotherSessionBeginsAnew) {
  UsualTime usual;
  for (std::uint64_t i = 0; i < 2 * UsualTime::kFew; ++i) usual.answer(1, 20.0, true);
  EXPECT_GT(usual_ms(usual, 1), 0.0);
  EXPECT_EQ(usual_ms(usual, 2), 0.0);
  EXPECT_EQ(usual_ms(usual, 1), 0.0) << "of a session that is over, nothing is kept";
}

}  // namespace
}  // namespace brainshift::server
