// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/session/session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/core/guarded.hpp"
#include "server/session/observation_rules.hpp"

namespace brainshift::server {
namespace {

// A throwing library must cost one observation, not the daemon.
constexpr const char* kUnexpected = "unexpected failure";
constexpr const char* kSuperseded = "another session was started before this one";
constexpr const char* kLeft = "the client that asked for the session has left";
constexpr const char* kSessionEnded = "the session ended";
constexpr const char* kStopping = "the daemon is stopping";

Result<SessionInfo> unavailable(const std::string& why) {
  return fail(ErrorCode::kUnavailable, why);
}

std::int64_t monotonic_ns(std::chrono::steady_clock::time_point time) {
  return time.time_since_epoch() / std::chrono::nanoseconds(1);
}

double seconds_since(std::chrono::steady_clock::time_point time) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - time).count();
}

}  // namespace

Session::Session(std::string case_id, SessionHooks hooks, std::uint64_t boot_id,
                 std::string model_id)
    : case_id_(std::move(case_id)),
      hooks_(std::move(hooks)),
      boot_id_(boot_id),
      model_id_(std::move(model_id)),
      preparer_([this](const std::stop_token& stop) { prepare(stop); }),
      worker_([this](const std::stop_token& stop) { work(stop); }) {}

Session::~Session() { stop(); }

const std::string* Session::owner() const {
  if (pending_start_) return &pending_start_->owner;
  if (preparing_) return &*preparing_;
  if (prepared_) return &prepared_->start.owner;
  return running_ ? &running_->owner : nullptr;
}

// Of the session that runs, or has just ended: the worker begins the next one only after this.
void Session::decide(const Observation& observation, Outcome outcome, std::string reason,
                     const Update* answer) const {
  if (!hooks_.decided) return;
  Decision decision;
  decision.session_id = last_session_id_;
  decision.source = observation.source;
  decision.observation_sequence = observation.sequence;
  decision.outcome = outcome;
  decision.reason = std::move(reason);
  if (answer != nullptr) {
    decision.update_sequence = answer->sequence;
    decision.active = answer->estimate.contact.active;
  }
  hooks_.decided(decision);
}

void Session::end_running() {
  for (const auto& [source, box] : boxes_) {
    decide(box.observation, Outcome::kSkipped, kSessionEnded);
  }
  boxes_.clear();
  running_.reset();
  run_stop_.request_stop();
}

void Session::changed() const {
  if (hooks_.on_change) hooks_.on_change();
}

void Session::start(const SessionRequest& request, const StartDone& done,
                    const std::string& asking) {
  if (request.case_id != case_id_) {
    done(fail(ErrorCode::kInvalidArgument,
              fmt::format("start_session.case_id = {}: the loaded model is for {}",
                          in_quotes(request.case_id), in_quotes(case_id_))));
    return;
  }
  std::optional<PendingStart> superseded;
  const char* refusal = nullptr;
  {
    const std::lock_guard lock(mutex_);
    const std::string* current = owner();
    const bool foreign = current != nullptr && !current->empty() && *current != asking;
    if (stopped_) {
      refusal = kStopping;
    } else if (foreign && !request.takeover) {
      refusal =
          "the session belongs to another client that is connected: close that one, or take over";
    } else {
      superseded = std::exchange(pending_start_, PendingStart{request, done, asking});
      prepare_stop_.request_stop();
    }
  }
  if (refusal != nullptr) {
    done(unavailable(refusal));
    return;
  }
  wake_.notify_all();
  if (superseded) superseded->done(unavailable(kSuperseded));
}

void Session::leave(const std::string& gone) {
  if (gone.empty()) return;
  std::optional<PendingStart> abandoned;
  {
    const std::lock_guard lock(mutex_);
    if (running_ && running_->owner == gone) running_->owner.clear();
    if (prepared_ && prepared_->start.owner == gone) prepared_->start.owner.clear();
    if (pending_start_ && pending_start_->owner == gone) {
      abandoned = std::exchange(pending_start_, std::nullopt);
    }
    if (preparing_ && *preparing_ == gone) prepare_stop_.request_stop();
  }
  if (abandoned) abandoned->done(unavailable(kLeft));
}

Result<ObservationReceipt> Session::submit(Observation observation, const OnAccepted& on_accepted) {
  ObservationReceipt receipt;
  {
    const std::lock_guard lock(mutex_);
    if (!running_) {
      const bool coming = pending_start_ || preparing_ || prepared_;
      return fail(ErrorCode::kModelNotReady, coming ? "the session is still being prepared"
                                                    : "no session is running: start one first");
    }
    if (auto status = check_observation(observation, case_id_, running_->key); !status) {
      return tl::unexpected(status.error());
    }
    const TimePoint arrived = std::chrono::steady_clock::now();
    const auto admission = running_->sources.admit(observation, monotonic_ns(arrived),
                                                   boxes_.count(observation.source) > 0);
    if (!admission) return tl::unexpected(admission.error());
    receipt = admission->receipt;
    if (admission->repeated) return receipt;
    observation.daemon_ns = admission->daemon_ns;
    if (on_accepted) on_accepted(observation);
    observation.acquired_ns = observation.daemon_ns;  // one clock for all sources from here on
    const std::string name = observation.source;
    if (receipt.replaced_pending) {
      decide(boxes_[name].observation, Outcome::kSuperseded,
             fmt::format("observation {} came before it was begun", observation.sequence));
    }
    boxes_.insert_or_assign(name, Box{std::move(observation), ++arrivals_, arrived});
  }
  wake_.notify_all();
  return receipt;
}

SessionState Session::shared_state() const {
  SessionState state;
  state.session = {boot_id_, running_ ? running_->key.session_id : 0, model_id_};
  const bool coming = pending_start_ || preparing_ || prepared_;
  state.preparing = coming && running_.has_value();
  if (stopped_) {
    state.phase = SessionPhase::kClosed;
  } else if (!running_) {
    state.phase = coming ? SessionPhase::kPreparing : SessionPhase::kEmpty;
  } else if (running_->newest_update == 0) {
    state.phase = SessionPhase::kReady;
  } else if (running_->newest_update == running_->newest_usable) {
    state.phase = SessionPhase::kTracking;
  } else {
    state.phase = SessionPhase::kDegraded;
    state.reason = running_->reason;
  }
  if (running_) {
    state.newest_update = running_->newest_update;
    state.newest_usable = running_->newest_usable;
    if (running_->newest_usable > 0) {
      state.age_ms = 1e3 * seconds_since(running_->usable_arrived);
    }
  }
  return state;
}

Session::State Session::state() const {
  const std::lock_guard lock(mutex_);
  State state;
  state.shared = shared_state();
  state.busy = working_ || pending_start_ || preparing_ || prepared_ || !boxes_.empty();
  state.updates = updates_;
  if (working_) {
    state.working_s = seconds_since(working_since_);
    state.deadline_s = deadline_s_;
  }
  if (running_) {
    state.owner = running_->owner;
    state.max_age_s = running_->model->max_age_s;
  }
  return state;
}

void Session::stop() {
  std::optional<PendingStart> abandoned;
  std::optional<Prepared> prepared;
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
    abandoned = std::exchange(pending_start_, std::nullopt);
    prepared = std::exchange(prepared_, std::nullopt);
    end_running();
    prepare_stop_.request_stop();
  }
  if (abandoned) abandoned->done(unavailable(kStopping));
  if (prepared) prepared->start.done(unavailable(kStopping));
  const bool first = worker_.joinable();
  for (std::jthread* thread : {&preparer_, &worker_}) thread->request_stop();
  wake_.notify_all();
  for (std::jthread* thread : {&preparer_, &worker_}) {
    if (thread->joinable()) thread->join();
  }
  if (first) changed();
}

// ---------- preparer ----------

void Session::prepare(const std::stop_token& stop) {
  while (true) {
    std::optional<PendingStart> start;
    std::stop_token cancelled;
    {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, stop, [&] { return pending_start_.has_value(); });
      if (stop.stop_requested()) return;
      start = std::exchange(pending_start_, std::nullopt);
      preparing_ = start->owner;
      prepare_stop_ = std::stop_source();
      cancelled = prepare_stop_.get_token();
      if (running_ && running_->request.method != Method::kCondensed) {
        end_running();
        wake_.wait(lock, stop, [&] { return !working_; });
      }
    }
    changed();
    const auto model = model_for(start->request, cancelled);
    std::optional<Error> refusal;
    std::optional<Prepared> overtaken;
    {
      const std::lock_guard lock(mutex_);
      preparing_.reset();
      if (stopped_) {
        refusal = Error{ErrorCode::kUnavailable, kStopping};
      } else if (cancelled.stop_requested()) {
        refusal = Error{ErrorCode::kUnavailable, pending_start_ ? kSuperseded : kLeft};
      } else if (!model) {
        refusal = model.error();
      } else {
        overtaken = std::exchange(prepared_, Prepared{*start, *model});
        end_running();
      }
    }
    if (refusal) start->done(tl::unexpected(*refusal));
    if (overtaken) overtaken->start.done(unavailable(kSuperseded));
    wake_.notify_all();
    changed();
  }
}

Result<SessionModel*> Session::model_for(const SessionRequest& request,
                                         const std::stop_token& stop) {
  const std::tuple key{request.boundary, request.method, request.measure_full_solve};
  if (const auto found = models_.find(key); found != models_.end()) return found->second.get();
  auto made =
      guarded(ErrorCode::kInternal, kUnexpected, [&] { return hooks_.make_model(request, stop); });
  if (!made) return tl::unexpected(made.error());
  return models_.emplace(key, std::move(*made)).first->second.get();
}

// ---------- worker ----------

void Session::work(const std::stop_token& stop) {
  while (true) {
    std::optional<Prepared> prepared;
    std::optional<Box> box;
    {
      std::unique_lock lock(mutex_);
      working_ = false;
      wake_.notify_all();
      wake_.wait(lock, stop, [&] { return prepared_ || !boxes_.empty(); });
      if (stop.stop_requested()) return;
      run_stop_ = std::stop_source();
      if (prepared_) {
        prepared = std::exchange(prepared_, std::nullopt);
      } else {
        const auto oldest = std::min_element(
            boxes_.begin(), boxes_.end(),
            [](const auto& a, const auto& b) { return a.second.order < b.second.order; });
        box = std::move(oldest->second);
        boxes_.erase(oldest);
      }
      working_ = true;
      working_since_ = std::chrono::steady_clock::now();
      deadline_s_ = box && running_ ? running_->model->deadline_s : 0.0;
    }
    if (prepared) begin(*prepared);
    if (box) process(*box);
  }
}

void Session::begin(const Prepared& prepared) {
  const auto& [start, model] = prepared;
  model->pipeline.reset();
  SessionInfo info = model->info;
  {
    const std::lock_guard lock(mutex_);
    info.session_id = ++last_session_id_;
    info.boot_id = boot_id_;
  }
  if (hooks_.on_ready) hooks_.on_ready(start.request, info);
  bool superseded = false;
  {
    const std::lock_guard lock(mutex_);
    superseded = stopped_ || prepared_.has_value();
    if (!superseded) {
      running_ = Running{{boot_id_, info.session_id, model_id_},
                         start.request,
                         start.owner,
                         model,
                         Sources(model->max_age_s, start.request.recorded_clock)};
    }
  }
  if (superseded) {
    start.done(unavailable(kSuperseded));
  } else {
    changed();
    start.done(info);
  }
}

void Session::process(const Box& box) {
  const Handled handled{box.arrived, std::chrono::steady_clock::now()};
  const Observation& observation = box.observation;
  SessionKey key;
  SessionRequest request;
  SessionModel* model = nullptr;
  std::uint64_t number = 0;
  pipeline::RunOptions options;
  {
    const std::lock_guard lock(mutex_);
    if (!running_) {  // ended between taking the observation and here
      decide(observation, Outcome::kSkipped, kSessionEnded);
      return;
    }
    number = ++running_->published;
    key = running_->key;
    request = running_->request;
    model = running_->model;
    options.stop = run_stop_.get_token();
  }
  if (request.publish_iterates) {
    options.on_iterate = [&](Update iterate) {
      iterate.sequence = number;
      hooks_.publish({key.session_id, std::move(iterate), std::nullopt, boot_id_}, handled);
    };
  }
  auto result = guarded(ErrorCode::kInternal, kUnexpected,
                        [&] { return model->pipeline.run(observation, options); });

  UpdateMessage message;
  message.session_id = key.session_id;
  message.boot_id = boot_id_;
  if (result) {
    message.update = std::move(*result);
  } else {
    message.error = result.error();
    message.update.case_id = case_id_;
    message.update.model_id = model->info.model_id;
    message.update.observation_sequence = observation.sequence;
    message.update.method = request.method;
    message.update.boundary = request.boundary;
    message.update.final = true;
  }
  message.update.sequence = number;
  const auto phase = state().shared.phase;
  if (!finish(box, message, options.stop)) return;
  hooks_.publish(std::move(message), handled);
  if (state().shared.phase != phase) changed();
}

// False when the session has ended meanwhile: nobody hears of the message.
bool Session::finish(const Box& box, const UpdateMessage& message, const std::stop_token& stop) {
  const std::lock_guard lock(mutex_);
  if (stop.stop_requested() || !running_) {
    decide(box.observation, Outcome::kSkipped, kSessionEnded);
    return false;
  }
  running_->newest_update = message.update.sequence;
  if (!message.error) ++updates_;
  if (!message.error && message.update.usable()) {
    running_->newest_usable = message.update.sequence;
    running_->usable_arrived = box.arrived;
  } else {
    running_->reason =
        message.error ? message.error->message : message.update.estimate.quality.reason;
  }
  decide(box.observation, message.error ? Outcome::kFailed : Outcome::kUsed,
         running_->newest_usable == message.update.sequence ? std::string() : running_->reason,
         &message.update);
  return true;
}

}  // namespace brainshift::server
