// SPDX-License-Identifier: GPL-3.0-or-later
// Session: one case under one boundary and method, worked on by one thread.
//
//   start()   ends the running session and makes the next one ready on the worker (seconds, once
//             per boundary and method)
//   submit()  checks an observation and leaves it in the box of its source; never waits
//   worker    takes the observation that arrived first, runs the pipeline, hands the message to
//             `publish`
//
// Every source has a box for one observation: a newer one replaces an older one that has not
// started, so a slow inversion never works through a backlog. Only a new session and stop() end a
// running inversion early, whatever its method: their stop token reaches every iteration and every
// contact set. The result of such an inversion is not published. After an error, and after an
// unusable estimate, the usable one before it stays the valid one. All members may be called from
// any thread, except inside the hooks.
#pragma once

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
#include "common/values/observation.hpp"
#include "common/wire/convert.hpp"
#include "server/pipeline/pipeline.hpp"

namespace brainshift::server {

// All that a session of one method and boundary needs: what its clients are told, and the pipeline
// with its state. The session keeps it for the next session of the same kind, and resets it then.
struct SessionModel {
  wire::SessionInfo info;  // session_id is filled in by the session
  Pipeline pipeline;
};
using MakeSessionModel =
    std::function<Result<std::unique_ptr<SessionModel>>(const wire::SessionRequest&)>;

// Called on the worker thread, one at a time.
struct SessionHooks {
  MakeSessionModel make_model;
  // A session is ready; called before its start is answered. May be empty.
  std::function<void(const wire::SessionRequest&, const wire::SessionInfo&)> on_ready;
  // An iterate, a final update, or the error that an observation ended in.
  std::function<void(wire::UpdateMessage)> publish;
};

class Session {
 public:
  using StartDone = std::function<void(Result<wire::SessionInfo>)>;

  struct State {
    std::uint64_t session_id = 0;  // 0: none is running
    bool busy = false;             // making a session ready, or inverting
    std::uint64_t updates = 0;     // final updates of all sessions
  };

  Session(std::string case_id, SessionHooks hooks);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  // `done` is called exactly once: on the calling thread for another case (kInvalidArgument, the
  // running session goes on), else on the worker; kUnavailable when a later start or stop() came
  // first.
  void start(const wire::SessionRequest& request, const StartDone& done);

  // kModelNotReady without a running session; the errors of check_observation; kUnavailable when
  // kMaxSources other sources have observed. `on_accepted` is called once before the worker can see
  // an accepted observation; it must be quick and must not call back. Precondition: the
  // observation's numbers are finite (wire::decode_observation).
  Result<wire::ObservationReceipt> submit(Observation observation,
                                          const std::function<void()>& on_accepted = {});

  State state() const;

  // Ends the inversion and the worker; idempotent.
  void stop();

  static constexpr std::size_t kMaxSources = 16;

 private:
  struct PendingStart {
    wire::SessionRequest request;
    StartDone done;
  };
  struct Running {
    std::uint64_t session_id = 0;
    wire::SessionRequest request;
    SessionModel* model = nullptr;                       // in models_
    std::map<std::string, std::uint64_t> last_sequence;  // by source
    std::uint64_t published = 0;                         // number of the last message's update
  };

  void work(const std::stop_token& stop);
  void make_ready(const PendingStart& start);
  Result<SessionModel*> model_for(const wire::SessionRequest& request);
  void process(const Observation& observation);

  const std::string case_id_;
  const SessionHooks hooks_;
  // By boundary, method and whether a full solve was measured; worker only.
  std::map<std::tuple<Boundary, Method, bool>, std::unique_ptr<SessionModel>> models_;

  mutable std::mutex mutex_;
  std::condition_variable_any wake_;
  std::optional<PendingStart> pending_start_;
  std::optional<Running> running_;
  struct Box {
    Observation observation;
    std::uint64_t arrival = 0;
  };
  std::map<std::string, Box> boxes_;  // by source
  std::uint64_t arrivals_ = 0;
  std::stop_source run_stop_;  // of the inversion in progress
  std::uint64_t last_session_id_ = 0;
  std::uint64_t updates_ = 0;
  bool busy_ = false;
  bool stopped_ = false;

  std::jthread worker_;  // last: it uses everything above
};

}  // namespace brainshift::server
