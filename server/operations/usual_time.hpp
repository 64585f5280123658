// SPDX-License-Identifier: GPL-3.0-or-later
// UsualTime: what the answers of a session usually take, to tell late ones by
// (AnswerTime::usual_ms). It is the median over all of them, not over the last ones: while a
// machine is too busy, its answers stay late, however long that lasts.
#pragma once

#include <cstdint>

#include "common/values/estimate.hpp"
#include "server/operations/latency_record.hpp"

namespace brainshift::server {

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
