// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/operations/usual_time.hpp"

namespace brainshift::server {

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
