// SPDX-License-Identifier: GPL-3.0-or-later
// TokenBucket: at most `burst` at once, and `per_second` in the long run. A bucket begins full.
#pragma once

#include <chrono>

namespace brainshift::server {

class TokenBucket {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  // Precondition: burst >= 1, per_second >= 0.
  TokenBucket(double per_second, double burst, TimePoint now)
      : per_second_(per_second), burst_(burst), tokens_(burst), filled_(now) {}

  // True and one token less, or false when none is left. `now` never goes back.
  bool take(TimePoint now);

 private:
  double per_second_;
  double burst_;
  double tokens_;
  TimePoint filled_;
};

}  // namespace brainshift::server
