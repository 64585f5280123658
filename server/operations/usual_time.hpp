// SPDX-License-Identifier: GPL-3.0-or-later
// UsualTime: what the answers of a session usually take, to tell late ones by
// (AnswerTime::usual_ms). It is the median over all of them, not over the last ones: while a
// machine is too busy, its answers stay late, however long that lasts.
#pragma once

#include <cstdint>

#include "server/operations/latency_record.hpp"

namespace brainshift::server {

class UsualTime {
 public:
  // Answers that a session needs before anything is usual.
  static constexpr std::uint64_t kFew = 8;

  // Of the answers added since this session was first asked about, ms, within 1 %; 0: fewer than
  // kFew. Another session than before forgets them.
  double of(std::uint64_t session_id);
  // An answer of the session that was asked about last. Allocates nothing. Precondition: finite.
  void add(double milliseconds);

 private:
  std::uint64_t session_id_ = 0;
  LatencyRecord answers_;
};

}  // namespace brainshift::server
