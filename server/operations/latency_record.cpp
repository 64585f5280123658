// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/operations/latency_record.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>

#include "common/core/statistics.hpp"

namespace brainshift::server {

// Below 2^7 ns a bucket is 1 ns wide. Above, it is the power of two that leaves 7 leading bits: the
// highest one, and 6 that tell 64 buckets of the octave apart.
std::size_t LatencyRecord::bucket_of(std::uint64_t nanoseconds) {
  const auto shift = static_cast<std::size_t>(
      std::max(0, static_cast<int>(std::bit_width(nanoseconds)) - (kSubBits + 1)));
  return (shift << kSubBits) + static_cast<std::size_t>(nanoseconds >> shift);
}

double LatencyRecord::middle_ms(std::size_t bucket) {
  const std::size_t octave = bucket >> kSubBits;
  const std::size_t shift = octave < 2 ? 0 : octave - 1;
  const auto lowest = static_cast<double>(std::uint64_t{bucket - (shift << kSubBits)} << shift);
  return 1e-6 * (lowest + 0.5 * static_cast<double>(std::uint64_t{1} << shift));
}

void LatencyRecord::add(double milliseconds) {
  const double value = std::max(0.0, milliseconds);
  const double nanoseconds = std::min(1e6 * value, static_cast<double>(kLongest_ns - 1));
  ++fine_[bucket_of(static_cast<std::uint64_t>(nanoseconds))];
  const auto bound = std::lower_bound(kBounds_ms.begin(), kBounds_ms.end(), value);
  ++coarse_[static_cast<std::size_t>(bound - kBounds_ms.begin())];
  last_[count_ % kRecent] = value;
  ++count_;
  sum_ms_ += value;
  max_ms_ = std::max(max_ms_, value);
}

wire::LatencyFigures LatencyRecord::recent() const {
  const std::size_t kept = std::min<std::uint64_t>(count_, kRecent);
  if (kept == 0) return {};
  const std::span<const double> values(last_.data(), kept);
  return {kept, percentile(values, 50.0), percentile(values, 95.0), percentile(values, 99.0),
          *std::max_element(values.begin(), values.end())};
}

// The value of rank ceil(q n), as the middle of its bucket.
double LatencyRecord::quantile_ms(double q) const {
  const auto rank = static_cast<std::uint64_t>(std::ceil(q * static_cast<double>(count_)));
  std::uint64_t seen = 0;
  for (std::size_t bucket = 0; bucket < kBuckets; ++bucket) {
    seen += fine_[bucket];
    if (seen >= rank) return std::min(middle_ms(bucket), max_ms_);
  }
  return max_ms_;
}

wire::LatencyFigures LatencyRecord::all() const {
  if (count_ == 0) return {};
  return {count_, quantile_ms(0.5), quantile_ms(0.95), quantile_ms(0.99), max_ms_};
}

AnswerTime UsualTime::answer(std::uint64_t session_id, double ms, bool counts) {
  if (session_id != session_id_) {
    session_id_ = session_id;
    answers_ = {};
  }
  const AnswerTime time{ms, answers_.count() < kFew ? 0.0 : answers_.quantile_ms(0.5)};
  if (counts) answers_.add(ms);
  return time;
}

}  // namespace brainshift::server
