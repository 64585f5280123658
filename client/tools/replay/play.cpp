// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/replay/play.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "client/lib/client.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/recording/surgery_file.hpp"

namespace brainshift::client {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

// Between two looks whether the session still runs.
constexpr milliseconds kBetweenLooks{500};

double ms_between(Clock::time_point from, Clock::time_point to) {
  return std::chrono::duration<double, std::milli>(to - from).count();
}

// Time left until `deadline`, rounded up so that a wait does not spin; zero when it has passed.
milliseconds time_left(Clock::time_point deadline) {
  const auto left = std::chrono::ceil<milliseconds>(deadline - Clock::now());
  return std::max(left, milliseconds(0));
}

// Sequence number with which a recorded observation is sent in a cycle, counted from 0:
//   recorded number + cycle (last - first + 1)
// Numbers that increase within the recording increase over all cycles.
std::uint64_t sequence_in_cycle(const std::vector<RecordedObservation>& recording,
                                std::size_t index, int cycle) {
  const std::uint64_t first = recording.front().observation.sequence;
  const std::uint64_t last = recording.back().observation.sequence;
  return recording[index].observation.sequence +
         static_cast<std::uint64_t>(cycle) * (last - first + 1);
}

class Player {
 public:
  Player(const DaemonLink& link, const std::vector<RecordedObservation>& recording,
         const PlayOptions& options, const Progress& progress)
      : link_(link), recording_(recording), options_(options), progress_(progress) {
    const auto plays = static_cast<std::size_t>(options.repeat) * recording.size();
    session_.observations.resize(plays);
    for (std::size_t i = 0; i < plays; ++i) {
      session_.observations[i].sequence = sequence_in_cycle(recording, i % recording.size(),
                                                            static_cast<int>(i / recording.size()));
    }
    sent_.resize(plays);
  }

  PlayedSession run() {
    const auto start = Clock::now();
    const std::size_t plays = session_.observations.size();
    for (std::size_t i = 0; i < plays && !lost_; ++i) {
      report(progress_, "replay", static_cast<double>(i) / static_cast<double>(plays));
      if (options_.speed == Speed::kRecorded) receive_until([] { return false; }, start + due(i));
      if (!lost_) submit(i);
      if (options_.speed == Speed::kMax) wait_for_all();
    }
    if (!lost_) wait_for_all();
    for (PlayedObservation& observation : session_.observations) {
      const bool silent = !observation.latency_ms && !observation.error && !observation.superseded;
      if (silent && lost_) observation.error = lost_;
    }
    session_.lost = lost_;
    report(progress_, "replay", 1.0);
    return std::move(session_);
  }

 private:
  const RecordedObservation& recorded(std::size_t i) const {
    return recording_[i % recording_.size()];
  }

  std::chrono::nanoseconds due(std::size_t i) const {
    return std::chrono::nanoseconds(
        std::max<std::int64_t>(0, recorded(i).recorded_ns - recording_.front().recorded_ns));
  }

  void submit(std::size_t i) {
    Observation observation = recorded(i).observation;
    observation.sequence = session_.observations[i].sequence;
    sent_[i] = Clock::now();
    waiting_.push_back(i);
    const auto receipt = link_.submit(observation);
    if (!receipt) {
      answered(i);
      session_.observations[i].error = receipt.error();
      if (receipt.error().code == ErrorCode::kUnavailable) lost_ = receipt.error();
      return;
    }
    if (receipt->replaced_pending) supersede_before(i);
  }

  // The daemon replaces the newest pending observation of the same source.
  void supersede_before(std::size_t i) {
    for (std::size_t w = waiting_.size(); w-- > 0;) {
      const std::size_t j = waiting_[w];
      if (j == i || recorded(j).observation.source != recorded(i).observation.source) continue;
      answered(j);
      session_.observations[j].superseded = true;
      return;
    }
  }

  void answered(std::size_t i) { std::erase(waiting_, i); }

  // Every answer, an iterate too, renews the deadline: a long
  // inversion that shows progress is alive.
  void wait_for_all() {
    while (!waiting_.empty() && !lost_) {
      const auto before = received_;
      receive_until([&] { return received_ != before; }, Clock::now() + options_.timeout);
      if (received_ == before && !lost_) {
        time_out();
        return;
      }
    }
  }

  void time_out() {
    for (const std::size_t i : waiting_) {
      session_.observations[i].error = malformed_.value_or(
          Error{ErrorCode::kUnavailable,
                "observation " + std::to_string(session_.observations[i].sequence) +
                    ": no update within " + std::to_string(options_.timeout.count()) + " ms"});
    }
    waiting_.clear();
  }

  template <typename Done>
  void receive_until(Done done, Clock::time_point deadline) {
    while (!done() && !lost_) {
      const auto asked = Clock::now();
      const milliseconds left = std::min(time_left(deadline), kBetweenLooks);
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
      if (done() || lost_) return;
      if (const Status session = link_.session_status(); !session) lost_ = session.error();
    }
  }

  void take(UpdateMessage&& message, Clock::time_point now) {
    Update& update = message.update;
    if (message.session_id != options_.session_id) return;
    const auto found = std::find_if(waiting_.begin(), waiting_.end(), [&](std::size_t i) {
      return session_.observations[i].sequence == update.observation_sequence;
    });
    if (found == waiting_.end()) return;
    const std::size_t i = *found;
    PlayedObservation& observation = session_.observations[i];
    ++received_;
    if (message.error) {
      answered(i);
      observation.error = std::move(message.error);
    } else if (update.final) {
      answered(i);
      observation.latency_ms = ms_between(sent_[i], now);
      observation.timings = update.timings;
      observation.status = update.estimate.status;
      observation.active = update.estimate.contact.active;
      observation.contact_iterations = update.estimate.contact.iterations;
      observation.quality = update.estimate.quality;
      observation.misfit_mm = update.estimate.misfit_mm.mean;
      if (!update.usable()) return;
      observation.tumour = geometry::tumour_motion(update, options_.tumour);
      session_.last_recorded_sequence = recorded(i).observation.sequence;
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
  std::vector<std::size_t> waiting_;  // sent, not answered yet; oldest first
  std::vector<Iterate> iterates_;
  std::size_t iterates_of_ = 0;
  std::size_t received_ = 0;
  std::optional<Error> lost_;
  std::optional<Error> malformed_;
};

}  // namespace

DaemonLink link_to(Client& client) {
  return {[&client](const Observation& observation) { return client.submit(observation); },
          [&client](std::chrono::milliseconds timeout) { return client.next_update(timeout); },
          [&client] { return client.session_status(); }};
}

Observation for_replay(Observation recorded) {
  if (recorded.daemon_ns != 0) recorded.acquired_ns = recorded.daemon_ns;
  recorded.daemon_ns = recorded.sent_ns = 0;
  recorded.session = {};
  return recorded;
}

PlayedSession play(const DaemonLink& link, const std::vector<RecordedObservation>& recording,
                   const PlayOptions& options, const Progress& progress) {
  return Player(link, recording, options, progress).run();
}

Result<ResumePoint> read_resume_point(const std::filesystem::path& journal) {
  const auto file = io::SurgeryFile::open_damaged(journal);
  if (!file) return tl::unexpected(file.error());
  ResumePoint point;
  point.meta = file->meta();
  const Status whole = file->visit([&](const io::SurgeryRecord& record) -> Status {
    if (record.kind == io::RecordKind::kObservation) {
      const auto observation = wire::decode_observation(record.payload);
      if (!observation) {
        return io::unreadable(journal, "observation " + std::to_string(record.sequence) + ": " +
                                           observation.error().message);
      }
      std::string source = observation->source;
      point.last.insert_or_assign(std::move(source), *observation);
    }
    if (record.kind == io::RecordKind::kUpdate) point.last_update = record.sequence;
    ++point.records;
    return {};
  });
  if (!whole) point.broken = whole.error();
  return point;
}

Result<std::vector<RecordedObservation>> remaining(
    const std::vector<RecordedObservation>& recording, const ResumePoint& point) {
  // What was measured, whoever measured it when.
  const auto measured = [](const Observation& observation) {
    Observation bare;
    bare.sequence = observation.sequence;
    bare.body = observation.body;
    return wire::encode(bare);
  };
  for (const auto& [source, last] : point.last) {
    const auto observes = [&](const auto& recorded) {
      return recorded.observation.source == source;
    };
    const auto is_last = [&](const auto& recorded) {
      return observes(recorded) && recorded.observation.sequence == last.sequence &&
             measured(recorded.observation) == measured(last);
    };
    if (std::none_of(recording.begin(), recording.end(), observes)) continue;
    if (std::any_of(recording.begin(), recording.end(), is_last)) continue;
    return invalid(
        fmt::format("is not the journal of this surgery: its observation {} of \"{}\" is "
                    "another one, or none, there",
                    last.sequence, source));
  }
  std::vector<RecordedObservation> left;
  for (const RecordedObservation& recorded : recording) {
    const auto last = point.last.find(recorded.observation.source);
    if (last != point.last.end() && recorded.observation.sequence < last->second.sequence) continue;
    left.push_back(recorded);
  }
  return left;
}

std::string describe(const ResumePoint& point) {
  if (point.last.empty()) return "begins anew: no observation is recorded";
  std::string text;
  for (const auto& [source, last] : point.last) {
    text += text.empty() ? "goes on after observation " : " and ";
    text += std::to_string(last.sequence) + " of " + source;
  }
  if (point.last_update > 0) text += ", update " + std::to_string(point.last_update);
  return text;
}

}  // namespace brainshift::client
