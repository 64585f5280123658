// SPDX-License-Identifier: GPL-3.0-or-later
// Plays a recording of the corpus to a running daemon, as `brainshift replay` does
// (client/tools/replay/play.hpp), and keeps what that does not: when each observation was sent, the
// daemon's own account of the time, and every field, for comparison.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "client/lib/client.hpp"
#include "common/core/error.hpp"
#include "common/core/types.hpp"
#include "tests/replays/corpus.hpp"
#include "tests/replays/replay_rows.hpp"

namespace brainshift::replays {

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
