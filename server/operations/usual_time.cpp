// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/operations/usual_time.hpp"

namespace brainshift::server {

double UsualTime::of(std::uint64_t session_id) {
  if (session_id != session_id_) {
    session_id_ = session_id;
    answers_ = {};
  }
  return answers_.count() < kFew ? 0.0 : answers_.quantile_ms(0.5);
}

void UsualTime::add(double milliseconds) { answers_.add(milliseconds); }

}  // namespace brainshift::server
