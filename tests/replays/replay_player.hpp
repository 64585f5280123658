// SPDX-License-Identifier: GPL-3.0-or-later
// The raw table of `replays`: one row for every observation that was sent.
//
//   head, nodes, kernel          case, size of its mesh, and the BLAS kernel of the daemon
//   surgery, seed                of the corpus
//   speed, pass                  "1x" or "max"; passes count from 1, each is a session of its own
//   update                       place in the pass, from 1; the first update of a session is cold
//   sequence, source             of the observation
//   due_ms, sent_late_ms         when it was to be sent, after the first, and how much later it was
//                                (empty at full speed)
//   outcome                      "field", "superseded", or the code of the error it ended in
//   latency_ms                   at the client: from just before it was sent until its update was
//                                received and decoded
//   register_ms ... journal_ms   stages (StageTimings)
//   answer_ms, usual_ms, late    the daemon's own account (AnswerTime); usual_ms 0: too few yet
//   status, quality, deadline    of the estimate; deadline 1: the time ran out, best iterate
//   active                       slaves that carry a contact force
//   evidence                     observations that the field follows from: "ius 4; tracks 3"
//   difference_mm                greatest difference of a node's component from the first field of
//                                this surgery with the same evidence; empty for that first one
//   t_solve_ms                   one solve with the factor of K, measured by the daemon in this run
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/lib/client.hpp"
#include "client/tools/replay/play.hpp"
#include "common/core/error.hpp"
#include "common/core/types.hpp"
#include "common/values/estimate.hpp"
#include "tests/replays/corpus.hpp"
#include "tests/surgeries/row_file.hpp"

namespace brainshift::replays {

inline constexpr std::string_view kRecordedSpeed = "1x", kFullSpeed = "max";
std::string_view name_of(client::Speed speed);

// What all rows of a pass share.
struct PassFacts {
  std::string head, kernel, surgery;
  int nodes = 0;
  std::uint64_t seed = 0;
  client::Speed speed = client::Speed::kMax;
  int pass = 1;
  double t_solve_ms = 0.0;
};

// One observation of a pass. `played` is what the client library says; the rest was seen as the
// messages passed.
struct PlayedRow {
  client::PlayedObservation played;
  std::string source;
  double due_ms = 0.0, sent_ms = 0.0;  // after the first
  AnswerTime answer;
  std::string evidence;
  std::optional<double> difference_mm;
};

surgeries::Row row_of(const PassFacts& facts, int update, const PlayedRow& row);

// "ius 4; stereopsis 5"
std::string evidence_of(const std::vector<SourceSummary>& sources);

// Plays a recording of the corpus to a running daemon, as `brainshift replay` does
// (client/tools/replay/play.hpp), and keeps what that does not: when each observation was sent, the
// daemon's own account of the time, and every field, for comparison.
//
// The first field of a surgery for every evidence that a daemon had.
class KnownFields {
 public:
  // Greatest difference of a component, mm, from the field that is known for this evidence. Empty
  // for the first one, which is kept. 1e9 for another number of nodes.
  std::optional<double> compare(const std::string& evidence, const Points& displacement);

 private:
  std::map<std::string, Points> fields_;
};

// Stands between play() and a daemon, and notes what passes. Comparing a field of 18 thousand nodes
// adds some 0.1 ms to the latency of its update.
class Tap {
 public:
  Tap(client::DaemonLink link, std::uint64_t session_id, KnownFields& fields)
      : link_(std::move(link)), session_id_(session_id), fields_(fields) {}

  // For play(); must not outlive the tap.
  client::DaemonLink link();
  // What passed for an observation; sent_ms after the first that was sent.
  PlayedRow row_of(const client::PlayedObservation& played) const;

 private:
  struct Passed {
    double sent_ms = 0.0;
    AnswerTime answer;
    std::string evidence;
    std::optional<double> difference_mm;
  };
  void note(const UpdateMessage& message);

  client::DaemonLink link_;
  std::uint64_t session_id_;
  KnownFields& fields_;
  std::optional<std::chrono::steady_clock::time_point> start_;
  std::map<std::uint64_t, Passed> passed_;  // by sequence of the observation
};

// t_solve on this machine, for the head that the daemon serves: client::measure_run_unit.
Result<double> measure_t_solve_ms(const std::string& endpoint, const Recording& recording);

// One pass in a session of its own: method condensed, contact, journal and all as the daemon has
// it. facts: surgery, seed, speed, pass and t_solve are given; the rest is filled in. Errors: no
// daemon (kUnavailable), the recording is of another case or model (kInvalidArgument). An
// observation that fails is a row.
Result<std::vector<surgeries::Row>> play_pass(const std::string& endpoint,
                                              const Recording& recording, PassFacts facts,
                                              KnownFields& fields);

}  // namespace brainshift::replays
