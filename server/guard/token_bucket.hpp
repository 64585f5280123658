// SPDX-License-Identifier: GPL-3.0-or-later
// TokenBucket: at most `burst` at once, and `per_second` in the long run. A bucket begins full.
//
//   tokens(t) = min(burst, tokens(t0) + per_second (t - t0))
#pragma once

#include <algorithm>
#include <chrono>

namespace brainshift::server {

class TokenBucket {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  // Precondition: burst >= 1, per_second >= 0.
  TokenBucket(double per_second, double burst, TimePoint now)
      : per_second_(per_second), burst_(burst), tokens_(burst), filled_(now) {}

  // Whether a whole token is there. A `now` before an earlier one fills nothing.
  bool has_one(TimePoint now) {
    const double elapsed_s = std::chrono::duration<double>(now - filled_).count();
    tokens_ = std::min(burst_, tokens_ + per_second_ * std::max(0.0, elapsed_s));
    filled_ = std::max(filled_, now);
    return tokens_ >= 1.0;
  }
  // More than are there: what is missing is filled in first.
  void spend(double tokens) { tokens_ -= tokens; }
  // True and one token less, or false when none is left.
  bool take(TimePoint now) {
    const bool one = has_one(now);
    if (one) spend(1.0);
    return one;
  }

 private:
  double per_second_;
  double burst_;
  double tokens_;
  TimePoint filled_;
};

}  // namespace brainshift::server
