// SPDX-License-Identifier: GPL-3.0-or-later
// A daemon that answers from a script, and what it is played.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <thread>
#include <vector>

#include "client/tools/replay/play.hpp"

namespace brainshift::client {

inline constexpr std::uint64_t kSession = 7;

// An iterate or a final update of session kSession, with a history of `iteration` records.
inline UpdateMessage update(std::uint64_t observation, bool final, int iteration = 1) {
  UpdateMessage message;
  message.session_id = kSession;
  message.update.observation_sequence = observation;
  message.update.final = final;
  if (final) message.update.estimate.quality.quality = Quality::kGood;
  message.update.timings.invert_ms = 10.0 * static_cast<double>(observation);
  message.update.estimate.displacement = Points::Constant(3, 2, static_cast<double>(iteration));
  for (int i = 1; i <= iteration; ++i) {
    message.update.estimate.history.push_back({i, {1.0 / i, 0.1}, 10 - i, 0.5 / i, 100.0 * i});
  }
  return message;
}

inline UpdateMessage unusable_update(std::uint64_t observation) {
  UpdateMessage message = update(observation, true, 9);
  QualityVerdict& verdict = message.update.estimate.quality;
  verdict.flags.set(QualityFlag::kInvertedElements);
  verdict.quality = Quality::kUnusable;
  verdict.reason = "elements are turned inside out (9)";
  return message;
}

// Answers every observation by a scripted list of messages.
struct ScriptedDaemon {
  std::function<std::vector<UpdateMessage>(const Observation&)> script;
  std::function<Result<ObservationReceipt>(const Observation&)> on_submit =
      [](const Observation& o) {
        return ObservationReceipt{o.sequence, false};
      };
  std::deque<UpdateMessage> queue;
  std::vector<std::uint64_t> submitted;
  std::vector<std::chrono::steady_clock::time_point> submitted_at;

  DaemonLink link() {
    return {[this](const Observation& o) -> Result<ObservationReceipt> {
              submitted.push_back(o.sequence);
              submitted_at.push_back(std::chrono::steady_clock::now());
              auto receipt = on_submit(o);
              if (receipt) {
                for (auto& message : script(o)) queue.push_back(std::move(message));
              }
              return receipt;
            },
            [this](std::chrono::milliseconds timeout) -> Result<UpdateMessage> {
              if (queue.empty()) {
                const auto until = std::chrono::steady_clock::now() + timeout;
                while (std::chrono::steady_clock::now() < until) std::this_thread::yield();
                return fail(ErrorCode::kUnavailable, "nothing came");
              }
              auto message = std::move(queue.front());
              queue.pop_front();
              return message;
            }};
  }
};

// Observations with sequences 1, 2, ..., spacing_ns apart.
inline std::vector<RecordedObservation> recording(int count, std::int64_t spacing_ns = 0) {
  std::vector<RecordedObservation> observations(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    observations[static_cast<std::size_t>(i)].recorded_ns = 5'000'000'000 + i * spacing_ns;
    observations[static_cast<std::size_t>(i)].observation.sequence =
        static_cast<std::uint64_t>(i + 1);
    observations[static_cast<std::size_t>(i)].observation.source = "ius";
  }
  return observations;
}

inline const PlayOptions kOptions{kSession, Speed::kMax, std::chrono::milliseconds(20)};

inline PlayOptions repeated(int repeat) {
  PlayOptions options = kOptions;
  options.repeat = repeat;
  return options;
}

}  // namespace brainshift::client
