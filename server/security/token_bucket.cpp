// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/security/token_bucket.hpp"

#include <algorithm>

namespace brainshift::server {

bool TokenBucket::take(TimePoint now) {
  const double elapsed_s = std::chrono::duration<double>(now - filled_).count();
  tokens_ = std::min(burst_, tokens_ + per_second_ * std::max(0.0, elapsed_s));
  filled_ = std::max(filled_, now);
  if (tokens_ < 1.0) return false;
  tokens_ -= 1.0;
  return true;
}

}  // namespace brainshift::server
