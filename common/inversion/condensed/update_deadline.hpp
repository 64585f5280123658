// SPDX-License-Identifier: GPL-3.0-or-later
// UpdateDeadline: when the searches of an update must end for its answer to be there in time.
//
// A search asks between its steps whether time is over. What happens after it has been told so
// takes time as well: the step that it was about to make, the linear model and the hypotheses of
// the loads that it ends at, error bars and the whole field; with a thousand active slaves as long
// as the search itself. So time is over before the deadline, earlier by
//
//   reserve = (end of the update - when a search was first told) + longest time between two
//             questions                                                        of this session,
//
// of the last update that was told so, or kFades of what was reserved before; before one was, twice
// what the last update took after the last question; in the first update kFirstPart of the
// deadline. Never more than kMostPart of it: a search must begin. An update that was stopped on its
// way, by a debugger or by a computer that slept, counts for a while and no longer.
#pragma once

#include <algorithm>
#include <atomic>
#include <functional>

#include "common/core/stopwatch.hpp"

namespace brainshift::inversion {

class UpdateDeadline {
 public:
  static constexpr double kFirstPart = 0.5, kMostPart = 0.8, kFades = 0.95;

  // clock: ms since a fixed moment; empty: the monotonic clock.
  explicit UpdateDeadline(double deadline_ms, std::function<double()> clock = {})
      : deadline_ms_(deadline_ms),
        clock_(std::move(clock)),
        reserve_ms_(kFirstPart * deadline_ms) {}

  // spent_ms: of the deadline already.
  void begin(double spent_ms = 0.0) {
    began_ms_ = now();
    spent_ms_ = spent_ms;
    asked_ms_ = gap_ms_ = 0.0;
    told_ms_ = -1.0;
  }
  double elapsed_ms() const { return now() - began_ms_; }
  // By any thread of the update's team.
  bool over() {
    const double asked = elapsed_ms(), before = asked_ms_.exchange(asked);
    double gap = gap_ms_;
    while (asked - before > gap && !gap_ms_.compare_exchange_weak(gap, asked - before)) {
    }
    if (spent_ms_ + asked + std::min(reserve_ms_, kMostPart * deadline_ms_) <= deadline_ms_)
      return false;
    double never = -1.0;
    told_ms_.compare_exchange_strong(never, asked);
    return true;
  }
  // Of an update that gave an answer.
  void end() {
    const double ended = elapsed_ms();
    if (told_ms_ >= 0.0) {
      const double needed = std::min(ended - told_ms_ + gap_ms_, kMostPart * deadline_ms_);
      reserve_ms_ = learned_ ? std::max(needed, kFades * reserve_ms_) : needed;
      learned_ = true;
    } else {
      reserve_ms_ = learned_ ? kFades * reserve_ms_ : 2.0 * (ended - asked_ms_ + gap_ms_);
    }
  }
  double reserve_ms() const { return reserve_ms_; }

 private:
  double now() const { return clock_ ? clock_() : watch_.milliseconds(); }

  double deadline_ms_;
  std::function<double()> clock_;
  Stopwatch watch_;
  double began_ms_ = 0.0, spent_ms_ = 0.0, reserve_ms_;
  bool learned_ = false;
  // Of this update, ms since it began; told_ms_ < 0: not yet.
  std::atomic<double> asked_ms_ = 0.0, gap_ms_ = 0.0, told_ms_ = -1.0;
};

}  // namespace brainshift::inversion
