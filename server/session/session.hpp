// SPDX-License-Identifier: GPL-3.0-or-later
// Session: one case under one boundary and method; two threads.
//
//   start()    asks for the next session
//   preparer   makes its model ready (seconds to minutes, once per boundary and method) while the
//              running session goes on; then that one ends and the new one begins. A session of
//              another method than condensed ends first: it uses the factor that is at work then.
//   submit()   checks an observation and leaves it in the box of its source; never waits
//   worker     takes the observation that arrived first, runs the pipeline, hands the message to
//              `publish`
//
// Every source has a box for one observation: a newer one replaces an older one that has not
// started, so a slow inversion never works through a backlog. Only a new session and stop() end a
// running inversion early, whatever its method: their stop token reaches every iteration and every
// contact set. The result of such an inversion is not published. After an error, and after an
// unusable estimate, the usable one before it stays the valid one.
//
// A session belongs to the client that started it, until that one leaves: another client ends it
// only with `takeover`. A preparation ends when a later one is asked for, when its owner leaves,
// and at stop(). All members may be called from any thread, except inside the hooks.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <tuple>

#include "common/core/error.hpp"
#include "common/pipeline/pipeline.hpp"
#include "common/values/observation.hpp"
#include "common/values/session_state.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/decision.hpp"
#include "server/session/sources.hpp"

namespace brainshift::server {

// Of the methods that compare and are not for surgery: their updates take minutes.
inline constexpr double kNoDeadline_s = 3600.0;

// All that a session of one method and boundary needs: what its clients are told, and the pipeline
// with its state. The session keeps it for the next session of the same kind, and resets it then.
struct SessionModel {
  SessionInfo info;  // boot_id and session_id are filled in by the session
  pipeline::Pipeline pipeline;
  double max_age_s = CaseConfig{}.sensing.max_age_s;  // older observations are not used
  double deadline_s = kNoDeadline_s;                  // an inversion ends by itself then
};
// On the preparer's thread, one at a time. kUnavailable when stopped.
using MakeSessionModel = std::function<Result<std::unique_ptr<SessionModel>>(
    const SessionRequest&, const std::stop_token&)>;

// The way of an observation to its answer, monotonic clock.
struct Handled {
  using TimePoint = std::chrono::steady_clock::time_point;

  TimePoint arrived;  // at the session
  TimePoint begun;    // by the worker
};

// Called one at a time, but for on_change and decided.
struct SessionHooks {
  MakeSessionModel make_model;
  // A session is ready; called before its start is answered. May be empty.
  std::function<void(const SessionRequest&, const SessionInfo&)> on_ready;
  // On the worker: an iterate, a final update, or the error that an observation ended in.
  std::function<void(UpdateMessage, const Handled&)> publish;
  // The phase, the session or `preparing` has changed: ask state(). Called without a lock, on any
  // thread, after the update that changed it. May be empty.
  std::function<void()> on_change;
  // What became of an accepted observation; once for each, before its update is published. Called
  // on any thread and under the session's lock: it must be quick and must not call back. May be
  // empty.
  std::function<void(const Decision&)> decided;
};

class Session {
 public:
  using StartDone = std::function<void(Result<SessionInfo>)>;

  struct State {
    SessionState shared;        // valid_ms is filled in by the service
    bool busy = false;          // making a session ready, or inverting
    std::uint64_t updates = 0;  // final updates of all sessions
    std::string owner;          // of the running session; empty: nobody
    double working_s = 0.0;     // since the worker began what it does now; 0: it waits
    double deadline_s = 0.0;    // of that; 0: it waits, or begins a session
    double max_age_s = 0.0;     // of the running session; 0 without one
  };

  // boot_id, model_id: of the daemon's process and of the loaded model.
  Session(std::string case_id, SessionHooks hooks, std::uint64_t boot_id, std::string model_id);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  // asking: the client; empty: nobody, and anybody may end it. `done` is called exactly once. On
  // the calling thread: kInvalidArgument for another case, kUnavailable for a session that belongs
  // to another client (both leave the running session alone) and after stop(). Else on the preparer
  // or the worker; kUnavailable when a later start or stop() came first.
  void start(const SessionRequest& request, const StartDone& done, const std::string& asking = {});

  // This client has gone: what it owns belongs to nobody.
  void leave(const std::string& gone);

  // Called once before the worker can see an accepted observation; must be quick and must not call
  // back. The observation's daemon_ns is set.
  using OnAccepted = std::function<void(const Observation&)>;

  // kModelNotReady without a running session; the errors of check_observation and of
  // Sources::admit. The source's last observation once more gets its receipt once more, and nothing
  // happens. Precondition: the observation's numbers are finite (wire::decode_observation).
  Result<ObservationReceipt> submit(Observation observation, const OnAccepted& on_accepted = {});

  State state() const;

  // Ends the inversion, the preparation and both threads; idempotent.
  void stop();

 private:
  using TimePoint = std::chrono::steady_clock::time_point;

  struct PendingStart {
    SessionRequest request;
    StartDone done;
    std::string owner;
  };
  struct Prepared {
    PendingStart start;
    SessionModel* model = nullptr;  // in models_
  };
  struct Running {
    SessionKey key;
    SessionRequest request;
    std::string owner;
    SessionModel* model = nullptr;  // in models_
    Sources sources;
    std::uint64_t published = 0;  // number of the last message's update
    std::uint64_t newest_update = 0;
    std::uint64_t newest_usable = 0;
    TimePoint usable_arrived = {};  // the observation that newest_usable answers
    std::string reason = {};        // why the newest update is not usable
  };
  struct Box {
    Observation observation;
    std::uint64_t order = 0;
    TimePoint arrived;
  };

  void prepare(const std::stop_token& stop);
  void work(const std::stop_token& stop);
  void begin(const Prepared& prepared);
  Result<SessionModel*> model_for(const SessionRequest& request, const std::stop_token& stop);
  void process(const Box& box);
  bool finish(const Box& box, const UpdateMessage& message, const std::stop_token& stop);
  // With the mutex held.
  const std::string* owner() const;
  void end_running();
  SessionState shared_state() const;
  void changed() const;
  void decide(const Observation& observation, Outcome outcome, std::string reason,
              const Update* answer = nullptr) const;

  const std::string case_id_;
  const SessionHooks hooks_;
  const std::uint64_t boot_id_;
  const std::string model_id_;
  // By boundary, method and whether a full solve was measured; preparer only.
  std::map<std::tuple<Boundary, Method, bool>, std::unique_ptr<SessionModel>> models_;

  mutable std::mutex mutex_;
  std::condition_variable_any wake_;
  std::optional<PendingStart> pending_start_;
  std::optional<std::string> preparing_;  // the owner of what the preparer works on
  std::stop_source prepare_stop_;         // of that
  std::optional<Prepared> prepared_;      // on its way to the worker
  std::optional<Running> running_;
  std::map<std::string, Box> boxes_;  // by source
  std::uint64_t arrivals_ = 0;
  std::stop_source run_stop_;  // of the inversion in progress
  std::uint64_t last_session_id_ = 0;
  std::uint64_t updates_ = 0;
  bool working_ = false;  // the worker
  TimePoint working_since_ = {};
  double deadline_s_ = 0.0;  // of what it works on
  bool stopped_ = false;

  std::jthread preparer_;  // the threads last: they use everything above
  std::jthread worker_;
};

}  // namespace brainshift::server
