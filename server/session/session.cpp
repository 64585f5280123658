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

}  // namespace

Session::Session(std::string case_id, SessionHooks hooks)
    : case_id_(std::move(case_id)),
      hooks_(std::move(hooks)),
      worker_([this](const std::stop_token& stop) { work(stop); }) {}

Session::~Session() { stop(); }

void Session::start(const wire::SessionRequest& request, const StartDone& done) {
  if (request.case_id != case_id_) {
    done(fail(ErrorCode::kInvalidArgument,
              fmt::format("start_session.case_id = {}: the loaded model is for {}",
                          in_quotes(request.case_id), in_quotes(case_id_))));
    return;
  }
  std::optional<PendingStart> superseded;
  bool refused = false;
  {
    const std::lock_guard lock(mutex_);
    refused = stopped_;
    if (!refused) {
      superseded = std::exchange(pending_start_, PendingStart{request, done});
      running_.reset();
      boxes_.clear();
      run_stop_.request_stop();
    }
  }
  if (refused) {
    done(fail(ErrorCode::kUnavailable, "the daemon is stopping"));
    return;
  }
  wake_.notify_all();
  if (superseded) {
    superseded->done(fail(ErrorCode::kUnavailable, "another session was started before this one"));
  }
}

Result<wire::ObservationReceipt> Session::submit(Observation observation,
                                                 const std::function<void()>& on_accepted) {
  wire::ObservationReceipt receipt;
  {
    const std::lock_guard lock(mutex_);
    if (!running_) {
      return fail(ErrorCode::kModelNotReady, busy_ || pending_start_
                                                 ? "the session is still being prepared"
                                                 : "no session is running: start one first");
    }
    auto& last_sequence = running_->last_sequence;
    const auto last = last_sequence.find(observation.source);
    auto status =
        check_observation(observation, case_id_, last != last_sequence.end() ? last->second : 0);
    if (!status) return tl::unexpected(status.error());
    if (last == last_sequence.end() && last_sequence.size() >= kMaxSources) {
      return fail(ErrorCode::kUnavailable,
                  fmt::format("observation.source = {}: {} other sources have observed already",
                              in_quotes(observation.source), last_sequence.size()));
    }
    receipt.observation_sequence = observation.sequence;
    receipt.replaced_pending = boxes_.count(observation.source) > 0;
    last_sequence[observation.source] = observation.sequence;
    if (on_accepted) on_accepted();
    const std::string source = observation.source;
    boxes_.insert_or_assign(source, Box{std::move(observation), ++arrivals_});
  }
  wake_.notify_all();
  return receipt;
}

Session::State Session::state() const {
  const std::lock_guard lock(mutex_);
  State state;
  state.session_id = running_ ? running_->session_id : 0;
  state.busy = busy_ || pending_start_.has_value() || !boxes_.empty();
  state.updates = updates_;
  return state;
}

void Session::stop() {
  std::optional<PendingStart> abandoned;
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
    abandoned = std::exchange(pending_start_, std::nullopt);
    running_.reset();
    boxes_.clear();
    run_stop_.request_stop();
  }
  if (abandoned) abandoned->done(fail(ErrorCode::kUnavailable, "the daemon is stopping"));
  if (worker_.joinable()) {
    worker_.request_stop();
    wake_.notify_all();
    worker_.join();
  }
}

void Session::work(const std::stop_token& stop) {
  while (true) {
    std::optional<PendingStart> start;
    std::optional<Observation> observation;
    {
      std::unique_lock lock(mutex_);
      busy_ = false;
      wake_.wait(lock, stop, [&] { return pending_start_ || !boxes_.empty(); });
      if (stop.stop_requested()) return;
      busy_ = true;
      run_stop_ = std::stop_source();
      if (pending_start_) {
        start = std::exchange(pending_start_, std::nullopt);
      } else {
        const auto oldest = std::min_element(
            boxes_.begin(), boxes_.end(),
            [](const auto& a, const auto& b) { return a.second.arrival < b.second.arrival; });
        observation = std::move(oldest->second.observation);
        boxes_.erase(oldest);
      }
    }
    if (start) make_ready(*start);
    if (observation) process(*observation);
  }
}

Result<SessionModel*> Session::model_for(const wire::SessionRequest& request) {
  const std::tuple key{request.boundary, request.method, request.measure_full_solve};
  if (const auto found = models_.find(key); found != models_.end()) return found->second.get();
  auto made =
      guarded(ErrorCode::kInternal, kUnexpected, [&] { return hooks_.make_model(request); });
  if (!made) return tl::unexpected(made.error());
  return models_.emplace(key, std::move(*made)).first->second.get();
}

void Session::make_ready(const PendingStart& start) {
  const auto model = model_for(start.request);
  if (!model) {
    start.done(tl::unexpected(model.error()));
    return;
  }
  (*model)->pipeline.reset();
  wire::SessionInfo info = (*model)->info;
  {
    const std::lock_guard lock(mutex_);
    info.session_id = ++last_session_id_;
  }
  if (hooks_.on_ready) hooks_.on_ready(start.request, info);
  bool superseded = false;
  {
    const std::lock_guard lock(mutex_);
    superseded = stopped_ || pending_start_.has_value();
    if (!superseded) running_ = Running{info.session_id, start.request, *model, {}, 0};
  }
  if (superseded) {
    start.done(fail(ErrorCode::kUnavailable, "another session was started before this one"));
  } else {
    start.done(info);
  }
}

void Session::process(const Observation& observation) {
  Running session;
  RunOptions options;
  {
    const std::lock_guard lock(mutex_);
    if (!running_) return;  // replaced between taking the observation and here
    ++running_->published;
    session = *running_;
    options.stop = run_stop_.get_token();
  }
  wire::UpdateMessage message;
  message.session_id = session.session_id;
  if (session.request.publish_iterates) {
    options.on_iterate = [&](Update iterate) {
      iterate.sequence = session.published;
      hooks_.publish({session.session_id, std::move(iterate), std::nullopt});
    };
  }
  auto result = guarded(ErrorCode::kInternal, kUnexpected,
                        [&] { return session.model->pipeline.run(observation, options); });
  if (options.stop.stop_requested()) return;

  if (result) {
    message.update = std::move(*result);
  } else {
    message.error = result.error();
    message.update.case_id = case_id_;
    message.update.model_id = session.model->info.model_id;
    message.update.observation_sequence = observation.sequence;
    message.update.method = session.request.method;
    message.update.boundary = session.request.boundary;
    message.update.final = true;
  }
  message.update.sequence = session.published;
  {
    const std::lock_guard lock(mutex_);
    if (result) ++updates_;
  }
  hooks_.publish(std::move(message));
}

}  // namespace brainshift::server
