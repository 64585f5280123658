// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/session/session.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "common/core/text.hpp"

namespace brainshift::server {
namespace {

constexpr const char* kSuperseded = "another session was started before this one";
constexpr const char* kLeft = "the client that asked for the session has left";
constexpr const char* kSessionEnded = "the session ended";
constexpr const char* kStopping = "the daemon is stopping";

double seconds_of(Session::TimePoint::duration duration) {
  return std::chrono::duration<double>(duration).count();
}

}  // namespace

Job::TimePoint Job::acquired() const {
  if (request.recorded_clock) return arrived;
  return TimePoint(std::chrono::nanoseconds(observation.acquired_ns));
}

double Job::age_ms(TimePoint now, std::chrono::nanoseconds asleep_now) const {
  return std::max(0.0, 1e3 * seconds_of(now - acquired() + (asleep_now - asleep)));
}

Session::Session(std::string case_id, std::uint64_t boot_id, std::string model_id)
    : case_id_(std::move(case_id)), boot_id_(boot_id), model_id_(std::move(model_id)) {}

// ---------- the next session ----------

const std::string* Session::owner() const {
  if (asked_) return &asked_->owner;
  if (preparing_) return &preparing_->start.owner;
  if (ready_) return &ready_->start.owner;
  return running_ ? &running_->owner : nullptr;
}

void Session::answer(const Start& start, Result<SessionInfo> info) {
  events_.answers.push_back({start.ticket, std::move(info)});
}

void Session::refuse(const Start& start, const std::string& why) {
  answer(start, fail(ErrorCode::kUnavailable, why));
}

void Session::start(const SessionRequest& request, const StartTicket& ticket) {
  Start start{request, ticket, ticket.client};
  if (request.case_id != case_id_) {
    return answer(start,
                  invalid(fmt::format("start_session.case_id = {}: the loaded model is for {}",
                                      in_quotes(request.case_id), in_quotes(case_id_))));
  }
  if (stopped_) return refuse(start, kStopping);
  const std::string* current = owner();
  const bool foreign = current != nullptr && !current->empty() && *current != ticket.client;
  if (foreign && !request.takeover) {
    return refuse(start,
                  "the session belongs to another client that is connected: close that one, or "
                  "take over");
  }
  if (asked_) refuse(*asked_, kSuperseded);
  asked_ = std::move(start);
  if (preparing_) preparing_->stop.request_stop();
}

void Session::leave(const std::string& gone) {
  if (gone.empty()) return;
  if (running_ && running_->owner == gone) running_->owner.clear();
  if (ready_ && ready_->start.owner == gone) ready_->start.owner.clear();
  if (preparing_ && preparing_->start.owner == gone) preparing_->stop.request_stop();
  if (asked_ && asked_->owner == gone) refuse(*std::exchange(asked_, std::nullopt), kLeft);
}

std::optional<Preparation> Session::next_preparation() {
  if (!preparing_ && asked_) {
    preparing_ = Preparing{*std::exchange(asked_, std::nullopt), {}, false};
    if (running_ && running_->request.method != Method::kCondensed) end_running();
  }
  const bool factor_at_work = work_ && !work_->finished && work_->method != Method::kCondensed;
  if (!preparing_ || preparing_->handed_out || factor_at_work) return std::nullopt;
  const SessionRequest& request = preparing_->start.request;
  if (const auto known = models_.find({request.boundary, request.method}); known != models_.end()) {
    make_ready(std::exchange(preparing_, std::nullopt)->start, known->second.get());
    return std::nullopt;
  }
  preparing_->handed_out = true;
  return Preparation{request, preparing_->stop.get_token()};
}

void Session::prepared(Result<std::unique_ptr<SessionModel>> made) {
  const Preparing of = *std::exchange(preparing_, std::nullopt);
  const SessionRequest& request = of.start.request;
  if (stopped_) return refuse(of.start, kStopping);
  SessionModel* model = nullptr;
  if (made) model = (models_[{request.boundary, request.method}] = std::move(*made)).get();
  if (of.stop.stop_requested()) return refuse(of.start, asked_ ? kSuperseded : kLeft);
  if (!made) return answer(of.start, tl::unexpected(made.error()));
  make_ready(of.start, model);
}

void Session::make_ready(Start start, SessionModel* model) {
  if (ready_) refuse(ready_->start, kSuperseded);
  end_running();
  ready_ = Ready{std::move(start), model};
  if (!work_) begin();
}

void Session::begin() {
  const auto [start, model] = *std::exchange(ready_, std::nullopt);
  model->pipeline.reset();
  SessionInfo info = model->info;
  info.session_id = ++last_session_id_;
  info.boot_id = boot_id_;
  running_ = Running{{boot_id_, info.session_id, model_id_},
                     start.request,
                     start.owner,
                     model,
                     Sources(model->max_age_s, start.request.recorded_clock)};
  events_.begun = {start.request, info};
  answer(start, std::move(info));
}

void Session::end_running() {
  for (const auto& [source, box] : boxes_) {
    events_.decisions.push_back({running_->key.session_id, source, box.observation.sequence,
                                 Outcome::kSkipped, 0, 0, kSessionEnded});
  }
  boxes_.clear();
  running_.reset();
  if (work_) work_->stop.request_stop();
}

void Session::stop() {
  stopped_ = true;
  end_running();
  if (asked_) refuse(*std::exchange(asked_, std::nullopt), kStopping);
  if (ready_) refuse(std::exchange(ready_, std::nullopt)->start, kStopping);
  if (!preparing_) return;
  preparing_->stop.request_stop();
  if (!preparing_->handed_out) refuse(std::exchange(preparing_, std::nullopt)->start, kStopping);
}

// ---------- observations ----------

Result<Admission> Session::submit(Observation observation, TimePoint now, const std::string& client,
                                  std::chrono::nanoseconds asleep) {
  if (!running_) {
    return fail(ErrorCode::kModelNotReady, coming() ? "the session is still being prepared"
                                                    : "no session is running: start one first");
  }
  if (auto status = check_observation(observation, case_id_, running_->key); !status) {
    return tl::unexpected(status.error());
  }
  const auto waiting = boxes_.find(observation.source);
  auto admission =
      running_->sources.admit(observation, now.time_since_epoch() / std::chrono::nanoseconds(1),
                              waiting != boxes_.end(), client);
  if (!admission || admission->repeated) return admission;
  observation.daemon_ns = observation.acquired_ns = admission->daemon_ns;
  if (waiting != boxes_.end()) {
    events_.decisions.push_back(
        {running_->key.session_id, observation.source, waiting->second.observation.sequence,
         Outcome::kSuperseded, 0, 0,
         fmt::format("observation {} came before it was begun", observation.sequence)});
  }
  Box box{std::move(observation), ++arrivals_, now, asleep};
  if (waiting != boxes_.end()) {
    box.passed_over = waiting->second.passed_over;
    box.replaced = true;
  }
  std::string source = box.observation.source;
  boxes_.insert_or_assign(std::move(source), std::move(box));
  return admission;
}

bool Session::hasty(const Box& box) const {
  return box.replaced || running_->hasty.contains(box.observation.source);
}

std::map<std::string, Session::Box>::iterator Session::whose_turn() {
  const auto place = [&](const auto& entry) {
    const Box& box = entry.second;
    const bool waits_for_answers = running_->last_was_hasty && !hasty(box);
    return std::tuple(!waits_for_answers, waits_for_answers ? 0 : -box.passed_over, box.order);
  };
  return std::min_element(boxes_.begin(), boxes_.end(),
                          [&](const auto& a, const auto& b) { return place(a) < place(b); });
}

std::optional<Job> Session::next_job(TimePoint now) {
  work_.reset();
  if (ready_) begin();
  if (boxes_.empty()) return std::nullopt;
  const auto turn = whose_turn();
  Box box = std::move(turn->second);
  boxes_.erase(turn);
  for (auto& [source, other] : boxes_) ++other.passed_over;
  running_->last_was_hasty = hasty(box);
  if (box.replaced) {
    running_->hasty.insert(box.observation.source);
  } else {
    running_->hasty.erase(box.observation.source);
  }
  work_ = Work{now, running_->model->deadline_s, running_->request.method, {}, false};
  return Job{std::move(box.observation),
             box.arrived,
             now,
             running_->key,
             running_->request,
             ++running_->numbered,
             running_->model,
             work_->stop.get_token(),
             box.asleep};
}

std::optional<UpdateMessage> Session::finish(const Job& job, Result<Update> result) {
  work_->finished = true;
  Decision decision;
  decision.session_id = job.session.session_id;
  decision.source = job.observation.source;
  decision.observation_sequence = job.observation.sequence;
  if (job.stop.stop_requested()) {
    decision.outcome = Outcome::kSkipped;
    decision.reason = kSessionEnded;
    events_.decisions.push_back(std::move(decision));
    return std::nullopt;
  }
  UpdateMessage message{job.session.session_id, {}, std::nullopt, job.session.boot_id};
  Update& update = message.update;
  if (result) {
    update = std::move(*result);
    ++updates_;
  } else {
    message.error = result.error();
    update.case_id = case_id_;
    update.model_id = job.model->info.model_id;
    update.observation_sequence = job.observation.sequence;
    update.method = job.request.method;
    update.boundary = job.request.boundary;
    update.final = true;
    decision.outcome = Outcome::kFailed;
  }
  update.sequence = running_->newest_update = job.number;
  if (result && update.usable()) {
    running_->usable_before = {running_->newest_usable, running_->usable_acquired,
                               running_->usable_asleep};
    running_->newest_usable = update.sequence;
    running_->usable_acquired = job.acquired();
    running_->usable_asleep = job.asleep;
  } else {
    if (running_->newest_usable == job.number) {
      std::tie(running_->newest_usable, running_->usable_acquired, running_->usable_asleep) =
          running_->usable_before;
    }
    running_->reason = result ? update.estimate.quality.reason : message.error->message;
    decision.reason = running_->reason;
  }
  decision.update_sequence = update.sequence;
  decision.active = update.estimate.contact.active;
  events_.decisions.push_back(std::move(decision));
  return message;
}

// ---------- what has happened ----------

SessionEvents Session::take_events() {
  if (!work_ || !work_->finished) {
    const auto id = running_ ? running_->key.session_id : 0;
    const std::tuple now{phase(), id, coming() && running_};
    events_.changed = std::exchange(told_, now) != now;
  }
  return std::exchange(events_, {});
}

SessionPhase Session::phase() const {
  if (stopped_) return SessionPhase::kClosed;
  if (!running_) return coming() ? SessionPhase::kPreparing : SessionPhase::kEmpty;
  if (running_->newest_update == 0) return SessionPhase::kReady;
  return running_->newest_update == running_->newest_usable ? SessionPhase::kTracking
                                                            : SessionPhase::kDegraded;
}

Session::State Session::state(TimePoint now, std::chrono::nanoseconds asleep) const {
  State state;
  state.shared.session = {boot_id_, 0, model_id_};
  state.shared.phase = phase();
  state.busy = work_ || coming() || !boxes_.empty();
  state.updates = updates_;
  if (work_) {
    state.working_s = seconds_of(now - work_->since);
    state.deadline_s = work_->deadline_s;
  }
  if (!running_) return state;
  state.owner = running_->owner;
  state.max_age_s = running_->model->max_age_s;
  state.shared.session.session_id = running_->key.session_id;
  state.shared.preparing = coming();
  state.shared.recorded = running_->request.recorded_clock;
  state.shared.method = to_string(running_->request.method);
  state.shared.boundary = to_string(running_->request.boundary);
  state.shared.newest_update = running_->newest_update;
  state.shared.newest_usable = running_->newest_usable;
  if (running_->newest_usable > 0) {
    const auto age = now - running_->usable_acquired + (asleep - running_->usable_asleep);
    state.shared.age_ms = std::max(0.0, 1e3 * seconds_of(age));
  }
  if (state.shared.phase == SessionPhase::kDegraded) state.shared.reason = running_->reason;
  return state;
}

}  // namespace brainshift::server
