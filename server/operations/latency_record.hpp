// SPDX-License-Identifier: GPL-3.0-or-later
// LatencyRecord: what a time was, over all updates and over the last ones, in a fixed memory.
// UsualTime: what the answers of a session usually take.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/values/estimate.hpp"
#include "common/wire/report.hpp"

namespace brainshift::server {

// The last kRecent values are kept as they are: their percentiles are exact. All values are counted
// in buckets of 64 to an octave, from 1 ns to 73 minutes: a percentile of all is off by less than
// 1 % of itself, the greatest value and the sum are exact. Coarse buckets with the bounds of
// kBounds_ms are counted beside them, for monitors.
class LatencyRecord {
 public:
  static constexpr std::size_t kRecent = 2048;
  // Upper bounds of the coarse buckets; the last bucket has none.
  static constexpr std::array<double, 19> kBounds_ms = {0.1,  0.2,  0.5,   1.0,   2.0,   5.0, 10.0,
                                                        20.0, 50.0, 100.0, 200.0, 500.0, 1e3, 2e3,
                                                        5e3,  1e4,  2e4,   5e4,   1e5};

  // Allocates nothing. Precondition: finite. A negative time counts as 0.
  void add(double milliseconds);

  wire::LatencyFigures recent() const;
  wire::LatencyFigures all() const;
  double sum_ms() const { return sum_ms_; }
  std::uint64_t count() const { return count_; }
  // Of all values, within 1 %; 0 without any. q in [0, 1].
  double quantile_ms(double q) const;
  // One more than the bounds; not cumulative.
  const std::array<std::uint64_t, kBounds_ms.size() + 1>& buckets() const { return coarse_; }

 private:
  static constexpr int kSubBits = 6;  // 64 buckets to an octave
  static constexpr std::uint64_t kLongest_ns = std::uint64_t{1} << 42;
  static constexpr std::size_t kBuckets = (42 - kSubBits + 2) << kSubBits;

  static std::size_t bucket_of(std::uint64_t nanoseconds);
  static double middle_ms(std::size_t bucket);

  std::array<std::uint32_t, kBuckets> fine_{};
  std::array<std::uint64_t, kBounds_ms.size() + 1> coarse_{};
  std::array<double, kRecent> last_{};  // a ring; the next one goes to count_ % kRecent
  std::uint64_t count_ = 0;
  double sum_ms_ = 0.0, max_ms_ = 0.0;
};

// To tell late answers by (AnswerTime::usual_ms). It is the median over all of them, not over the
// last ones: while a machine is too busy, its answers stay late, however long that lasts.
class UsualTime {
 public:
  // Answers that a session needs before anything is usual.
  static constexpr std::uint64_t kFew = 8;

  // An answer of the session that took `ms`, beside what is usual before it: within 1 %; 0: fewer
  // than kFew were counted. Another session than before forgets them. counts: it is an answer to
  // tell later ones by. Allocates nothing. Precondition: finite.
  AnswerTime answer(std::uint64_t session_id, double ms, bool counts);

 private:
  std::uint64_t session_id_ = 0;
  LatencyRecord answers_;
};

}  // namespace brainshift::server
