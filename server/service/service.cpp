// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/service/service.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <random>
#include <utility>

#include "common/core/utc_time.hpp"
#include "server/session/observation_rules.hpp"

namespace brainshift::server {
namespace {

using wire::MessageType;

Reply error_reply(const Error& error) { return {MessageType::kErrorReply, wire::encode(error)}; }

Error no_model() { return {ErrorCode::kModelNotReady, "no model is loaded"}; }

Reply model_not_ready() { return error_reply(no_model()); }

io::SurgeryRecord record(io::RecordKind kind, std::uint64_t sequence, std::string payload) {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return {kind, sequence, now / std::chrono::nanoseconds(1), std::move(payload)};
}

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

ServiceOptions with_boot_id(ServiceOptions options) {
  std::random_device entropy;
  while (options.boot_id == 0) {
    options.boot_id = (static_cast<std::uint64_t>(entropy()) << 32) | entropy();
  }
  return options;
}

}  // namespace

Service::Service(ServiceOptions options, Outbox& outbox)
    : options_(with_boot_id(std::move(options))), outbox_(outbox) {
  if (!options_.journal_dir.empty()) {
    Journal::Options journal;
    journal.open = options_.open_journal;
    journal.on_error = [this](const Error& error) {
      spdlog::error("{}", error.message);
      push_state();
    };
    journal.on_resumed = [this](const auto& path) {
      spdlog::info("journal {}", path.string());
      push_state();
    };
    journal_ = std::make_unique<Journal>(std::move(journal));
  }
  if (options_.model) {
    selections_.emplace(options_.model);
    SessionHooks hooks;
    hooks.make_model = options_.make_model;
    hooks.on_ready = [this](const auto& request, const auto& info) {
      begin_journal(request, info);
    };
    hooks.publish = [this](UpdateMessage message, const Handled& handled) {
      publish(std::move(message), handled);
    };
    hooks.decided = [this](const Decision& decision) {
      counters_.decided(decision);
      record_decision(decision);
    };
    hooks.on_change = [this] { push_state(); };
    session_ = std::make_unique<Session>(options_.model->case_id, std::move(hooks),
                                         options_.boot_id, options_.model->model_id);
  }
}

Service::~Service() { stop(); }

void Service::stop() {
  if (session_) session_->stop();
  if (journal_) journal_->stop();
}

std::optional<Reply> Service::handle(const std::string& peer, const wire::Frame& frame) {
  switch (frame.type) {
    case MessageType::kStatusRequest:
      if (auto empty = wire::decode_empty(frame.payload, "StatusRequest"); !empty) {
        return error_reply(empty.error());
      }
      return Reply{MessageType::kStatusReply, wire::encode(status())};
    case MessageType::kReportRequest:
      if (auto empty = wire::decode_empty(frame.payload, "ReportRequest"); !empty) {
        return error_reply(empty.error());
      }
      return Reply{MessageType::kReportReply, wire::encode(report())};
    case MessageType::kSubscribeRequest: return subscribe(frame);
    case MessageType::kStartSessionRequest: return start_session(peer, frame);
    case MessageType::kModelRequest:
      if (auto empty = wire::decode_empty(frame.payload, "ModelRequest"); !empty) {
        return error_reply(empty.error());
      }
      if (!options_.model) return model_not_ready();
      if (encoded_model_.empty()) encoded_model_ = wire::encode(*options_.model);
      return Reply{MessageType::kModelReply, encoded_model_};
    case MessageType::kObservation: return observe(frame);
    default: break;
  }
  return error_reply({ErrorCode::kProtocol, fmt::format("message type {} is not a request",
                                                        static_cast<int>(frame.type))});
}

std::optional<Reply> Service::start_session(const std::string& peer, const wire::Frame& frame) {
  if (!session_) return model_not_ready();
  const auto request = wire::decode_session_request(frame.payload);
  if (!request) return error_reply(request.error());
  const auto done = [this, peer, id = frame.request_id](Result<SessionInfo> info) {
    std::string bytes;
    if (info) {
      spdlog::info("session ready session={} prepare_s={:.2f}", info->session_id, info->prepare_s);
      bytes = wire::encode_frame(MessageType::kStartSessionReply, id, wire::encode(*info));
    } else {
      spdlog::warn("session refused code={} reason=\"{}\"", to_string(info.error().code),
                   info.error().message);
      bytes = wire::encode_frame(MessageType::kErrorReply, id, wire::encode(info.error()));
    }
    outbox_.post({Delivery::kReply, peer, std::make_shared<const std::string>(std::move(bytes))});
  };
  session_->start(*request, done, peer);
  return std::nullopt;
}

Reply Service::observe(const wire::Frame& frame) {
  const auto arrived = std::chrono::steady_clock::now();
  const auto refuse = [&](const std::string& source, const Error& error) {
    counters_.refused(source, arrived);
    return error_reply(error);
  };
  if (!session_) return refuse({}, no_model());
  auto observation = wire::decode_observation(frame.payload);
  if (!observation) return refuse({}, observation.error());
  const std::uint64_t sequence = observation->sequence;
  const bool plain = observation->daemon_ns == 0;
  const std::string source = observation->source;
  // Queued before the worker can answer it, so that the journal holds cause before effect.
  bool is_new = false;
  const auto receipt = session_->submit(std::move(*observation), [&](const Observation& accepted) {
    is_new = true;
    counters_.accepted(source, arrived);
    if (!journal_) return;
    const Stopwatch watch;
    // A client has no business with daemon_ns: what it put there is left out.
    std::string payload = plain ? std::string(frame.payload) : wire::encode(accepted);
    if (plain) wire::append_daemon_time(accepted.daemon_ns, payload);
    journal_->append(record(io::RecordKind::kObservation, sequence, std::move(payload)), source);
    journal_ms_ = watch.milliseconds();
  });
  if (!receipt) {
    spdlog::debug("observation refused sequence={} code={} reason=\"{}\"", sequence,
                  to_string(receipt.error().code), receipt.error().message);
    return refuse(source, receipt.error());
  }
  if (!is_new) counters_.repeated(source, arrived);
  return {MessageType::kObservationReply, wire::encode(*receipt)};
}

Reply Service::subscribe(const wire::Frame& frame) {
  const auto subscription = wire::decode_subscription(frame.payload);
  if (!subscription) return error_reply(subscription.error());
  Result<SelectionPtr> selection;
  if (selections_) selection = selections_->resolve(subscription->choice);
  if (!selection) return error_reply(selection.error());
  const SessionState state = session_state();
  return {MessageType::kSessionState, wire::encode(state), *subscription, state.session.session_id,
          *selection};
}

SessionState Service::session_state() const {
  SessionState state;
  if (session_) state = session_->state().shared;
  state.session.boot_id = options_.boot_id;
  if (journal_) state.recording = recording_state(journal_->recorded());
  state.valid_ms = static_cast<std::uint32_t>(kValidity.count());
  return state;
}

// In the order in which they were taken: an older one must not be the last.
void Service::push_state() {
  const std::lock_guard lock(push_mutex_);
  const SessionState state = session_state();
  auto frame = std::make_shared<const std::string>(
      wire::encode_frame(MessageType::kSessionState, 0, wire::encode(state)));
  outbox_.post({Delivery::kState, {}, std::move(frame), state.session.session_id});
}

void Service::left(const std::string& peer) {
  if (session_) session_->leave(peer);
}

DaemonStatus Service::status() const {
  DaemonStatus status;
  status.version = options_.version;
  status.uptime_ms = static_cast<std::uint64_t>(uptime_.milliseconds());
  status.build = options_.build;
  status.machine = options_.machine;
  status.blas_kernel = options_.blas_kernel;
  if (!session_) return status;
  const Session::State state = session_->state();
  status.model_ready = true;
  status.case_id = options_.model->case_id;
  status.model_id = options_.model->model_id;
  status.busy = state.busy;
  status.updates = state.updates;
  return status;
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

void Service::record_decision(const Decision& decision) {
  if (!journal_) return;
  journal_->append(
      record(io::RecordKind::kDecision, decision.observation_sequence, wire::encode(decision)));
}

void Service::publish(UpdateMessage message, const Handled& handled) {
  using Clock = std::chrono::steady_clock;
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
    const double ms =
        std::chrono::duration<double, std::milli>(Clock::now() - handled.arrived).count();
    update.answer_time = {ms, usual_time_.of(message.session_id)};
    if (estimated) usual_time_.add(ms);
  }
  wire::append_timings(update, payload);
  auto frame =
      std::make_shared<const std::string>(wire::encode_frame(MessageType::kUpdate, 0, payload));
  if (estimated && journal_) {
    journal_->append(record(io::RecordKind::kUpdate, update.sequence, std::move(payload)));
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
    counters_.answered({handled.arrived, handled.begun, Clock::now(), update.timings,
                        update.usable(), update.answer_time.late()});
  }
}

}  // namespace brainshift::server
