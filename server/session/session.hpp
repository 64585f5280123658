// SPDX-License-Identifier: GPL-3.0-or-later
// Session: one case under one boundary and method, as a state machine. It has no thread, calls
// nobody and waits for nothing: server/service calls it under one lock, does the work that it
// hands out, and acts on its events.
//
//   start()             asks for the next session
//   next_preparation()  hands out what is to be made ready for it (seconds to minutes, once per
//   prepared()          boundary and method) and takes the result. The running session goes on
//                       until then; one of another method than condensed ends first: it uses the
//                       factor that is at work then.
//   submit()            checks an observation and leaves it in the box of its source
//   next_job()          hands out the observation whose turn it is,
//   finish()            and turns its result into the message to publish
//   take_events()       after each of these: what is to be recorded and answered
//
//   next session   none -start-> asked -next_preparation-> preparing -prepared-> ready -> running
//   ready waits for the job that is handed out; without one it runs at once.
//
// Every source has a box for one observation: a newer one replaces an older one that has not been
// handed out, so a slow inversion never works through a backlog. A source is hasty when it sends
// another observation before its last one is begun. After a job of a hasty source the others come
// first, the one that was filled longest ago before all: who floods harms himself. Else the box
// comes first that most jobs have passed over: every source has its turn.
//
// Only a new session and stop() end a job early, whatever its method: its stop token reaches every
// iteration and every contact set. The result of such a job is not published. After an error, and
// after an unusable estimate, the usable one before it stays the valid one.
//
// A session belongs to the client that started it, until that one leaves: another client ends it
// only with `takeover`. A preparation is stopped when a later one is asked for, when its owner
// leaves, and by stop(). Every start is answered exactly once, every accepted observation decided
// exactly once, before its update is published. Not thread-safe.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/stopwatch.hpp"
#include "common/pipeline/pipeline.hpp"
#include "common/values/decision.hpp"
#include "common/values/observation.hpp"
#include "common/values/session.hpp"
#include "common/values/session_state.hpp"
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

// Who asked for a session, and where the answer goes.
struct StartTicket {
  std::string client;  // empty: nobody, and anybody may end the session
  std::uint64_t request_id = 0;
};

// What is to be made ready.
struct Preparation {
  SessionRequest request;
  std::stop_token stop;
};

// An observation to answer.
struct Job {
  using TimePoint = std::chrono::steady_clock::time_point;

  Observation observation;  // its time is the daemon's
  TimePoint arrived, begun;
  SessionKey session;
  SessionRequest request;
  std::uint64_t number = 0;  // of the update
  SessionModel* model = nullptr;
  std::stop_token stop;
  std::chrono::nanoseconds asleep{0};  // the computer so far, when the observation arrived

  // When its data were acquired, on the daemon's clock; when they arrived, of a recording.
  TimePoint acquired() const;
  // Since then, the computer's sleep included.
  double age_ms(TimePoint now, std::chrono::nanoseconds asleep_now = brainshift::asleep()) const;
};

// In the order in which they are to be acted on.
struct SessionEvents {
  struct Begun {
    SessionRequest request;
    SessionInfo info;
  };
  struct Answer {
    StartTicket ticket;
    Result<SessionInfo> info;
  };

  std::vector<Decision> decisions;  // what became of accepted observations
  std::optional<Begun> begun;       // a session
  bool changed = false;             // the phase, the session or `preparing`: see state()
  std::vector<Answer> answers;      // to start()
};

class Session {
 public:
  using TimePoint = Job::TimePoint;

  struct State {
    SessionState shared;        // valid_ms is filled in by the service
    bool busy = false;          // making a session ready, or inverting
    std::uint64_t updates = 0;  // final updates of all sessions
    std::string owner;          // of the running session; empty: nobody
    double working_s = 0.0;     // since the job was handed out; 0: there is none
    double deadline_s = 0.0;    // of that; 0: there is none
    double max_age_s = 0.0;     // of the running session; 0 without one
  };

  // boot_id, model_id: of the daemon's process and of the loaded model.
  Session(std::string case_id, std::uint64_t boot_id, std::string model_id);

  // The answer is an event. At once: kInvalidArgument for another case, kUnavailable for a session
  // that belongs to another client (both leave the running session alone) and after stop(). Later:
  // the errors of prepared(); kUnavailable when another start or stop() came first.
  void start(const SessionRequest& request, const StartTicket& ticket);
  // This client has gone: what it owns belongs to nobody.
  void leave(const std::string& gone);

  // One at a time: handed out once, and prepared() follows. Empty: nothing is asked for, its model
  // is at hand, or the job whose factor it would share has not been finished.
  std::optional<Preparation> next_preparation();
  void prepared(Result<std::unique_ptr<SessionModel>> made);

  // kModelNotReady without a running session; the errors of check_observation and of
  // Sources::admit. A repeated observation gets its receipt once more, and nothing happens.
  // Precondition: the observation's numbers are finite (wire::decode_observation).
  // asleep: how long the computer has slept so far, which `now` leaves out.
  Result<Admission> submit(Observation observation, TimePoint now, const std::string& client = {},
                           std::chrono::nanoseconds asleep = brainshift::asleep());

  // One at a time. A session that is ready begins: whatever the job before led to is published.
  std::optional<Job> next_job(TimePoint now);
  // What to publish; empty when the session has ended meanwhile: nobody hears of the result. Once
  // more for the same job, with an error: its result could not be published.
  std::optional<UpdateMessage> finish(const Job& job, Result<Update> result);

  // Ends job, preparation and session; idempotent.
  void stop();

  // `changed` waits for next_job() once a job is finished, so that its update is told first.
  SessionEvents take_events();
  // Ages count from acquisition on the daemon's clock, and while the computer sleeps.
  State state(TimePoint now, std::chrono::nanoseconds asleep = brainshift::asleep()) const;

 private:
  struct Start {
    SessionRequest request;
    StartTicket ticket;
    std::string owner;
  };
  struct Preparing {
    Start start;
    std::stop_source stop;
    bool handed_out = false;
  };
  struct Ready {
    Start start;
    SessionModel* model = nullptr;  // in models_
  };
  struct Running {
    SessionKey key;
    SessionRequest request;
    std::string owner;
    SessionModel* model = nullptr;  // in models_
    Sources sources;
    std::set<std::string> hasty = {};  // sources, by what they sent before their last job
    bool last_was_hasty = false;       // the source of the last job
    std::uint64_t numbered = 0;        // updates
    std::uint64_t newest_update = 0;
    std::uint64_t newest_usable = 0;
    // The observation that newest_usable answers: acquired, on the daemon's clock; arrived, when
    // recorded.
    TimePoint usable_acquired = {};
    std::chrono::nanoseconds usable_asleep{0};  // so far, when it arrived
    // All three, of the usable one before it.
    std::tuple<std::uint64_t, TimePoint, std::chrono::nanoseconds> usable_before = {};
    std::string reason = {};  // why the newest update is not usable
  };
  struct Box {
    Observation observation;
    std::uint64_t order = 0;
    TimePoint arrived;
    std::chrono::nanoseconds asleep{0};
    int passed_over = 0;    // by jobs of others, since the source's last one
    bool replaced = false;  // one that was not begun
  };
  struct Work {  // the job that is handed out
    TimePoint since;
    double deadline_s = 0.0;
    Method method = Method::kCondensed;
    std::stop_source stop;
    bool finished = false;
  };
  // Of the next session's boundary and method.
  using ModelKey = std::pair<Boundary, Method>;

  bool coming() const { return asked_ || preparing_ || ready_; }
  const std::string* owner() const;
  SessionPhase phase() const;
  void make_ready(Start start, SessionModel* model);
  void begin();
  void end_running();
  bool hasty(const Box& box) const;
  std::map<std::string, Box>::iterator whose_turn();
  void answer(const Start& start, Result<SessionInfo> info);
  void refuse(const Start& start, const std::string& why);

  const std::string case_id_;
  const std::uint64_t boot_id_;
  const std::string model_id_;
  std::map<ModelKey, std::unique_ptr<SessionModel>> models_;

  std::optional<Start> asked_;
  std::optional<Preparing> preparing_;
  std::optional<Ready> ready_;
  std::optional<Running> running_;
  std::map<std::string, Box> boxes_;  // by source
  std::uint64_t arrivals_ = 0;
  std::optional<Work> work_;
  std::uint64_t last_session_id_ = 0;
  std::uint64_t updates_ = 0;
  bool stopped_ = false;

  SessionEvents events_;
  std::tuple<SessionPhase, std::uint64_t, bool> told_ = {};
};

}  // namespace brainshift::server
