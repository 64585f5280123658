// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/replay/play.hpp"

#include <algorithm>
#include <string>

namespace brainshift::client {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

double ms_between(Clock::time_point from, Clock::time_point to) {
  return std::chrono::duration<double, std::milli>(to - from).count();
}

// Time left until `deadline`, rounded up so that a wait does not spin; zero when it has passed.
milliseconds time_left(Clock::time_point deadline) {
  const auto left = std::chrono::ceil<milliseconds>(deadline - Clock::now());
  return std::max(left, milliseconds(0));
}

class Player {
 public:
  Player(const DaemonLink& link, const std::vector<RecordedObservation>& recording,
         const PlayOptions& options, const Progress& progress)
      : link_(link), recording_(recording), options_(options), progress_(progress) {
    for (const auto& entry : recording) {
      session_.observations.emplace_back().sequence = entry.observation.sequence;
    }
    sent_.resize(recording.size());
    waiting_.resize(recording.size(), false);
  }

  PlayedSession run() {
    const auto start = Clock::now();
    for (std::size_t i = 0; i < recording_.size() && !lost_; ++i) {
      report(progress_, "replay", static_cast<double>(i) / static_cast<double>(recording_.size()));
      if (options_.speed == Speed::kRecorded) {
        receive_until([] { return false; }, start + due(i));
      }
      if (!lost_) submit(i);
      if (options_.speed == Speed::kMax) wait_for_all();
    }
    if (!lost_) wait_for_all();
    for (PlayedObservation& observation : session_.observations) {
      const bool silent = !observation.latency_ms && !observation.error && !observation.superseded;
      if (silent && lost_) observation.error = lost_;
    }
    report(progress_, "replay", 1.0);
    return std::move(session_);
  }

 private:
  std::chrono::nanoseconds due(std::size_t i) const {
    return std::chrono::nanoseconds(
        std::max<std::int64_t>(0, recording_[i].recorded_ns - recording_.front().recorded_ns));
  }

  void submit(std::size_t i) {
    sent_[i] = Clock::now();
    waiting_[i] = true;
    const auto receipt = link_.submit(recording_[i].observation);
    if (!receipt) {
      waiting_[i] = false;
      session_.observations[i].error = receipt.error();
      if (receipt.error().code == ErrorCode::kUnavailable) lost_ = receipt.error();
      return;
    }
    if (receipt->replaced_pending) supersede_before(i);
  }

  // The daemon replaces the newest pending observation of the same source.
  void supersede_before(std::size_t i) {
    for (std::size_t j = i; j-- > 0;) {
      const bool same_source = recording_[j].observation.source == recording_[i].observation.source;
      if (!waiting_[j] || !same_source) continue;
      waiting_[j] = false;
      session_.observations[j].superseded = true;
      return;
    }
  }

  bool any_waiting() const {
    return std::find(waiting_.begin(), waiting_.end(), true) != waiting_.end();
  }

  // Every answer, iterates included, renews the deadline: a long inversion that shows progress is alive.
  void wait_for_all() {
    while (any_waiting() && !lost_) {
      const auto before = received_;
      receive_until([&] { return received_ != before; }, Clock::now() + options_.timeout);
      if (received_ == before && !lost_) {
        time_out();
        return;
      }
    }
  }

  void time_out() {
    for (std::size_t i = 0; i < waiting_.size(); ++i) {
      if (!waiting_[i]) continue;
      waiting_[i] = false;
      session_.observations[i].error = malformed_.value_or(
          Error{ErrorCode::kUnavailable,
                "observation " + std::to_string(session_.observations[i].sequence) +
                    ": no update within " + std::to_string(options_.timeout.count()) + " ms"});
    }
  }

  template <typename Done>
  void receive_until(Done done, Clock::time_point deadline) {
    while (!done() && !lost_) {
      const auto asked = Clock::now();
      const milliseconds left = time_left(deadline);
      if (left.count() == 0) return;
      auto message = link_.next_update(left);
      const auto now = Clock::now();
      if (message) {
        take(std::move(*message), now);
      } else if (message.error().code != ErrorCode::kUnavailable) {
        // A malformed push: what it answered is unknown, so the wait for it runs into its timeout.
        malformed_ = message.error();
      } else if (now - asked < left / 2) {
        lost_ = message.error();  // unavailable well before the time was up: the daemon is gone
      }
    }
  }

  void take(wire::UpdateMessage&& message, Clock::time_point now) {
    Update& update = message.update;
    if (message.session_id != options_.session_id) return;
    const auto found = std::find_if(
        session_.observations.begin(), session_.observations.end(),
        [&](const PlayedObservation& o) { return o.sequence == update.observation_sequence; });
    if (found == session_.observations.end()) return;
    const auto i = static_cast<std::size_t>(found - session_.observations.begin());
    if (!waiting_[i]) return;
    ++received_;
    if (message.error) {
      waiting_[i] = false;
      found->error = std::move(message.error);
    } else if (update.final) {
      waiting_[i] = false;
      found->latency_ms = ms_between(sent_[i], now);
      found->timings = update.timings;
      if (iterates_of_ != i) iterates_.clear();
      session_.iterates = std::move(iterates_);
      iterates_.clear();
      session_.last = std::move(update);
    } else {
      take_iterate(i, std::move(update.estimate), now);
    }
  }

  void take_iterate(std::size_t i, Estimate&& estimate, Clock::time_point now) {
    if (iterates_of_ != i) iterates_.clear();
    iterates_of_ = i;
    PlayedObservation& observation = session_.observations[i];
    if (!observation.first_iterate_ms) observation.first_iterate_ms = ms_between(sent_[i], now);
    const int iteration = estimate.history.empty() ? static_cast<int>(iterates_.size()) + 1
                                                   : estimate.history.back().iteration;
    iterates_.push_back({iteration, std::move(estimate.displacement)});
  }

  const DaemonLink& link_;
  const std::vector<RecordedObservation>& recording_;
  const PlayOptions& options_;
  const Progress& progress_;
  PlayedSession session_;
  std::vector<Clock::time_point> sent_;
  std::vector<bool> waiting_;
  std::vector<Iterate> iterates_;
  std::size_t iterates_of_ = 0;
  std::size_t received_ = 0;
  std::optional<Error> lost_;
  std::optional<Error> malformed_;
};

}  // namespace

PlayedSession play(const DaemonLink& link, const std::vector<RecordedObservation>& recording,
                   const PlayOptions& options, const Progress& progress) {
  return Player(link, recording, options, progress).run();
}

}  // namespace brainshift::client
