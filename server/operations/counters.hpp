// SPDX-License-Identifier: GPL-3.0-or-later
// Counters: what the daemon has done since it started.
//
// Every observation message is counted once as received and, sooner or later, once as what became
// of it. At any moment, for every source:
//   received = answered + failed + replaced + skipped + refused + repeated + waiting
// A source gets a row of its own when an observation of it is first accepted, up to kMaxSources
// rows; everything else is counted in a row without a name, so that a peer cannot fill the table.
//
// All members may be called from any thread. A call takes a lock for less than a microsecond and
// allocates nothing, but for a source's first accepted observation; reporting holds it while it
// copies 240 KiB. The worker counts an update after it has been published.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string_view>
#include <vector>

#include "common/values/decision.hpp"
#include "common/values/estimate.hpp"
#include "common/wire/report.hpp"
#include "server/operations/latency_record.hpp"

namespace brainshift::server {

// The way of one update with an estimate.
struct Passage {
  using TimePoint = std::chrono::steady_clock::time_point;

  TimePoint arrived;    // its observation
  TimePoint begun;      // by the worker
  TimePoint published;  // handed to the transport
  StageTimings timings;
  bool usable = false;
  bool late = false;  // AnswerTime::late
};

class Counters {
 public:
  using TimePoint = Passage::TimePoint;

  static constexpr std::size_t kMaxSources = 32;
  // Of an update, in the order of its way: "wait" from the arrival of its observation until the
  // worker begins, the five of StageTimings, and "total" from arrival to publication.
  static constexpr std::array<const char*, 7> kStages = {"wait",   "register", "invert", "rebuild",
                                                         "encode", "journal",  "total"};

  // An observation message; each is counted by exactly one of these three.
  void accepted(std::string_view source, TimePoint now);
  void refused(std::string_view source, TimePoint now);   // source: empty when it is not known
  void repeated(std::string_view source, TimePoint now);  // its receipt was sent once more
  // What became of an accepted one.
  void decided(const Decision& decision);

  void answered(const Passage& passage);  // by an update with an estimate
  void failed();                          // by an update with an error
  void iterate();

  // Fills in updates, sources and stages.
  void report(wire::DaemonReport& report, TimePoint now) const;

 private:
  struct Row {
    wire::SourceCounts counts;
    TimePoint last = {};
  };
  using Stages = std::array<LatencyRecord, kStages.size()>;

  // With the mutex held.
  Row& row(std::string_view source);
  Row& receive(Row& row, TimePoint now);

  mutable std::mutex mutex_;
  Row unnamed_;
  std::vector<Row> rows_;
  std::uint64_t usable_ = 0;
  std::uint64_t unusable_ = 0;
  std::uint64_t late_ = 0;
  std::uint64_t failures_ = 0;
  std::uint64_t iterates_ = 0;
  Stages stages_;
};

}  // namespace brainshift::server
