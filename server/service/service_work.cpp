// SPDX-License-Identifier: GPL-3.0-or-later
// What Service does on its own threads, and with what the session says.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <utility>

#include "common/core/guarded.hpp"
#include "common/core/text.hpp"
#include "common/wire/convert.hpp"
#include "server/guard/sheltered.hpp"
#include "server/service/service.hpp"

namespace brainshift::server {
namespace {

using Clock = std::chrono::steady_clock;
using wire::MessageType;

// A throwing library must cost one observation, not the daemon.
constexpr const char* kUnexpected = "unexpected failure";
// Before a step that failed is tried again.
constexpr std::chrono::milliseconds kPause{10};

RecordingState recording_state(const Recorded& recorded) {
  RecordingState state;
  state.recording = recorded.recording;
  state.reason = recorded.reason;
  for (const auto& [source, held] : recorded.held.observations) {
    const auto lost = recorded.missing.observations.find(source);
    const bool none_lost = lost == recorded.missing.observations.end();
    state.sources.push_back({source, held.last, none_lost ? 0 : lost->second.last});
  }
  return state;
}

}  // namespace

void Service::repeat(const std::stop_token& stop, void (Service::*step)(const std::stop_token&)) {
  while (!stop.stop_requested()) {
    if (sheltered("a step of the session", [&] { (this->*step)(stop); })) continue;
    std::unique_lock lock(mutex_);  // what failed may fail again
    wake_.wait_for(lock, stop, kPause, [] { return false; });
  }
  {
    const std::lock_guard lock(mutex_);
    --at_work_;
  }
  wake_.notify_all();
}

void Service::prepare(const std::stop_token& stop) {
  std::optional<Preparation> preparation;
  {
    std::unique_lock lock(mutex_);
    const bool any = wake_.wait(lock, stop, [&] {
      preparation = session_->next_preparation();
      act();
      return preparation.has_value();
    });
    if (!any) return;
  }
  auto made = guarded(ErrorCode::kInternal, kUnexpected,
                      [&] { return options_.make_model(preparation->request, preparation->stop); });
  const std::lock_guard lock(mutex_);
  session_->prepared(std::move(made));
  act();
}

void Service::work(const std::stop_token& stop) {
  std::optional<Job> job;
  {
    std::unique_lock lock(mutex_);
    const bool any = wake_.wait(lock, stop, [&] {
      job = session_->next_job(Clock::now());
      act();
      return job.has_value();
    });
    if (!any) return;
  }
  pipeline::RunOptions options;
  options.stop = job->stop;
  if (job->request.publish_iterates) {
    options.on_iterate = [&](Update iterate) {
      iterate.sequence = job->number;
      const SessionKey& of = job->session;
      publish({of.session_id, std::move(iterate), std::nullopt, of.boot_id}, *job);
    };
  }
  auto result = guarded(ErrorCode::kInternal, kUnexpected,
                        [&] { return job->model->pipeline.run(job->observation, options); });
  const Status told = guarded(ErrorCode::kInternal, kUnexpected, [&]() -> Status {
    answer(*job, std::move(result));
    return {};
  });
  if (told) return;
  spdlog::error("an update could not be published: {}", told.error().message);
  answer(*job, tl::unexpected(told.error()));  // which takes little memory
}

void Service::answer(const Job& job, Result<Update> result) {
  std::optional<UpdateMessage> message;
  {
    const std::lock_guard lock(mutex_);
    message = session_->finish(job, std::move(result));
    act();
  }
  wake_.notify_all();  // a preparation may wait for the factor
  if (message) publish(std::move(*message), job);
}

void Service::act() {
  SessionEvents events = session_->take_events();
  for (const Decision& decision : events.decisions) {
    sheltered("a decision", [&] {
      counters_.decided(decision);
      if (!journal_) return;
      journal_->append(
          {io::RecordKind::kDecision, decision.observation_sequence, 0, wire::encode(decision)});
    });
  }
  if (events.begun) {
    sheltered("the journal", [&] { begin_journal(events.begun->request, events.begun->info); });
  }
  if (events.changed) sheltered("a message to the subscribers", [&] { push_state(); });
  for (const SessionEvents::Answer& answer : events.answers) {
    sheltered("an answer", [&] { reply(answer.ticket, answer.info); });
  }
}

SessionState Service::state_now() const {
  SessionState state;
  if (session_) state = session_->state(Clock::now()).shared;
  state.session.boot_id = options_.boot_id;
  if (journal_) state.recording = recording_state(journal_->recorded());
  state.valid_ms = static_cast<std::uint32_t>(kValidity.count());
  state.aged_after_ms = static_cast<std::uint32_t>(options_.aged_after.count());
  state.expired_after_ms = static_cast<std::uint32_t>(options_.expired_after.count());
  return state;
}

void Service::push_state() {
  const SessionState state = state_now();
  Bytes frame = framed(MessageType::kSessionState, 0, wire::encode(state));
  outbox_.post({Delivery::kState, {}, std::move(frame), state.session.session_id});
}

void Service::reply(const StartTicket& ticket, const Result<SessionInfo>& info) {
  Bytes bytes;
  if (info) {
    spdlog::info("session ready session={} prepare_s={:.2f}", info->session_id, info->prepare_s);
    bytes = framed(MessageType::kStartSessionReply, ticket.request_id, wire::encode(*info));
  } else {
    spdlog::warn("session refused code={} reason=\"{}\"", to_string(info.error().code),
                 info.error().message);
    bytes = framed(MessageType::kErrorReply, ticket.request_id, wire::encode(info.error()));
  }
  outbox_.post({Delivery::kReply, ticket.client, std::move(bytes)});
}

void Service::begin_journal(const SessionRequest& request, const SessionInfo& info) {
  if (!journal_) return;
  const auto path = journal_path(options_.journal_dir, request.case_id,
                                 fmt::format("{}-{}", utc_now("%Y%m%dT%H%M%SZ"), info.session_id));
  journal_->begin(path,
                  {.case_id = request.case_id,
                   .model_id = info.model_id,
                   .case_file = options_.case_file.string(),
                   .scenario = "recorded",
                   .seed = std::nullopt,
                   .method = std::string(to_string(request.method)),
                   .boundary = std::string(to_string(request.boundary)),
                   .created_utc = utc_now(),
                   .software = "brainshiftd " + options_.version,
                   .build = options_.build,
                   .machine = options_.machine,
                   .blas_kernel = options_.blas_kernel},
                  info.session_id);
  spdlog::info("journal {}", path.string());
}

void Service::publish(UpdateMessage message, const Job& job) {
  Update& update = message.update;
  const bool estimated = update.final && !message.error;
  if (journal_) {
    if (const auto journal = journal_->status(); !journal) {
      update.left_out.push_back({"journal", journal.error().message,
                                 "none in the estimate: this update is not recorded"});
    }
  }
  const Stopwatch encoding;
  std::string payload = wire::encode_without_timings(message);
  if (estimated) {
    update.timings.encode_ms = encoding.milliseconds();
    update.timings.journal_ms = journal_ms_;
  }
  if (update.final) {
    const double ms = std::chrono::duration<double, std::milli>(Clock::now() - job.arrived).count();
    update.answer_time = usual_time_.answer(message.session_id, ms, estimated);
    update.answer_time.age_ms = job.age_ms(Clock::now());
  }
  wire::append_timings(update, payload);
  Bytes frame = framed(MessageType::kUpdate, 0, payload);
  if (estimated && journal_) {
    journal_->append({io::RecordKind::kUpdate, update.sequence, 0, std::move(payload)});
  }
  // An unusable field travels as a failure does: everyone is told, nobody keeps it.
  const Delivery delivery = !update.final     ? Delivery::kIterate
                            : update.usable() ? Delivery::kFinal
                                              : Delivery::kFailure;
  if (estimated && !update.usable()) {
    spdlog::warn("unusable update sequence={} reason=\"{}\"", update.sequence,
                 update.estimate.quality.reason);
  }
  outbox_.post({delivery, {}, std::move(frame), message.session_id});
  if (!update.final) {
    counters_.iterate();
  } else if (!estimated) {
    counters_.failed();
  } else {
    counters_.answered({job.arrived, job.begun, Clock::now(), update.timings, update.usable(),
                        update.answer_time.late()});
  }
}

}  // namespace brainshift::server
