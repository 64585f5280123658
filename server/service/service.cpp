// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/service/service.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <functional>
#include <random>
#include <system_error>
#include <utility>

#include "server/guard/sheltered.hpp"
#include "server/operations/process_figures.hpp"
#include "server/transport/peers.hpp"

namespace brainshift::server {
namespace {

using wire::MessageType;
namespace fs = std::filesystem;

Reply error_reply(const Error& error) { return {MessageType::kErrorReply, wire::encode(error)}; }

Error no_model() { return {ErrorCode::kModelNotReady, "no model is loaded"}; }

Reply model_not_ready() { return error_reply(no_model()); }

ServiceOptions with_boot_id(ServiceOptions options) {
  std::random_device entropy;
  while (options.boot_id == 0) {
    options.boot_id = (static_cast<std::uint64_t>(entropy()) << 32) | entropy();
  }
  return options;
}

std::string hexadecimal(const std::string& bytes) {
  std::string text;
  for (const char byte : bytes) text += fmt::format("{:02x}", static_cast<unsigned char>(byte));
  return text;
}

std::uint64_t bytes_of(const fs::path& file) {
  std::error_code failed;
  const std::uintmax_t bytes = fs::file_size(file, failed);
  return failed ? 0 : bytes;
}

std::uint64_t count(const RecordRanges& ranges) {
  std::uint64_t sum = ranges.updates.count;
  for (const auto& [source, range] : ranges.observations) sum += range.count;
  return sum;
}

}  // namespace

Service::Service(ServiceOptions options, Outbox& outbox)
    : options_(with_boot_id(std::move(options))), outbox_(outbox) {
  if (!options_.journal_dir.empty()) {
    Journal::Options journal;
    journal.open = options_.open_journal;
    journal.max_session_bytes = options_.journal_bytes;
    journal.on_error = [this](const Error& error) {
      spdlog::error("{}", error.message);
      sheltered("a message to the subscribers", [&] {
        const std::lock_guard lock(mutex_);
        push_state();
      });
    };
    journal.on_resumed = [this](const auto& path) {
      spdlog::info("journal {}", path.string());
      sheltered("a message to the subscribers", [&] {
        const std::lock_guard lock(mutex_);
        push_state();
      });
    };
    journal_ = std::make_unique<Journal>(std::move(journal));
  }
  if (options_.model) {
    selections_.emplace(options_.model);
    session_.emplace(options_.model->case_id, options_.boot_id, options_.model->model_id);
    at_work_ = 2;
    preparer_ = std::jthread(std::bind_front(&Service::repeat, this), &Service::prepare);
    worker_ = std::jthread(std::bind_front(&Service::repeat, this), &Service::work);
  }
}

Service::~Service() { stop(); }

bool Service::stop(std::chrono::milliseconds grace) {
  bool ended = true;
  if (session_) {
    std::unique_lock lock(mutex_);
    sheltered("the end of the session", [&] {
      session_->stop();
      act();
    });
    preparer_.request_stop();
    worker_.request_stop();
    ended = wake_.wait_for(lock, grace, [&] { return at_work_ == 0; });
  }
  for (std::jthread* thread : {&preparer_, &worker_}) {
    if (ended && thread->joinable()) thread->join();
  }
  if (journal_) journal_->stop();
  return ended;
}

// ---------- requests ----------

std::optional<Reply> Service::handle(const std::string& peer, const wire::Frame& frame) {
  const auto empty = [&](const char* name) { return wire::decode_empty(frame.payload, name); };
  switch (frame.type) {
    case MessageType::kStatusRequest:
      if (auto ok = empty("StatusRequest"); !ok) return error_reply(ok.error());
      return Reply{MessageType::kStatusReply, wire::encode(status())};
    case MessageType::kReportRequest:
      if (auto ok = empty("ReportRequest"); !ok) return error_reply(ok.error());
      return Reply{MessageType::kReportReply, wire::encode(report())};
    case MessageType::kSubscribeRequest: return subscribe(frame);
    case MessageType::kStartSessionRequest: {
      if (!session_) return model_not_ready();
      const auto request = wire::decode_session_request(frame.payload);
      if (!request) return error_reply(request.error());
      const std::lock_guard lock(mutex_);
      session_->start(*request, {peer, frame.request_id});
      act();
      wake_.notify_all();
      return std::nullopt;
    }
    case MessageType::kModelRequest:
      if (auto ok = empty("ModelRequest"); !ok) return error_reply(ok.error());
      if (!options_.model) return model_not_ready();
      if (encoded_model_.empty()) encoded_model_ = wire::encode(*options_.model);
      return Reply{MessageType::kModelReply, encoded_model_};
    case MessageType::kObservation: return observe(peer, frame);
    default: break;
  }
  return error_reply({ErrorCode::kProtocol, fmt::format("message type {} is not a request",
                                                        static_cast<int>(frame.type))});
}

Reply Service::observe(const std::string& peer, const wire::Frame& frame) {
  const auto arrived = std::chrono::steady_clock::now();
  const auto refuse = [&](const std::string& source, const Error& error) {
    counters_.refused(source, arrived);
    return error_reply(error);
  };
  if (!session_) return refuse({}, no_model());
  auto observation = wire::decode_observation(frame.payload);
  if (!observation) return refuse({}, observation.error());
  const std::uint64_t sequence = observation->sequence;
  const std::string source = observation->source;
  std::string given;  // the payload without the time that only a daemon may add
  if (std::exchange(observation->daemon_ns, 0) != 0) given = wire::encode(*observation);

  const std::lock_guard lock(mutex_);
  const auto admission = session_->submit(std::move(*observation), arrived, peer);
  if (!admission) {
    spdlog::debug("observation refused sequence={} code={} reason=\"{}\"", sequence,
                  to_string(admission.error().code), admission.error().message);
    return refuse(source, admission.error());
  }
  if (admission->repeated) {
    counters_.repeated(source, arrived);
    return {MessageType::kObservationReply, wire::encode(admission->receipt)};
  }
  counters_.accepted(source, arrived);
  // Queued before the worker can answer it, so that the journal holds cause before effect.
  if (journal_) {
    const Stopwatch watch;
    std::string payload = given.empty() ? std::string(frame.payload) : std::move(given);
    wire::append_daemon_time(admission->daemon_ns, payload);
    journal_->append({io::RecordKind::kObservation, sequence, 0, std::move(payload)}, source);
    journal_ms_ = watch.milliseconds();
  }
  act();
  wake_.notify_all();
  return {MessageType::kObservationReply, wire::encode(admission->receipt)};
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

void Service::left(const std::string& peer) {
  if (!session_) return;
  const std::lock_guard lock(mutex_);
  session_->leave(peer);
  act();
}

SessionState Service::session_state() const {
  const std::lock_guard lock(mutex_);
  return state_now();
}

DaemonStatus Service::status() const {
  DaemonStatus status;
  status.version = options_.version;
  status.uptime_ms = static_cast<std::uint64_t>(uptime_.milliseconds());
  status.build = options_.build;
  status.machine = options_.machine;
  status.blas_kernel = options_.blas_kernel;
  if (!session_) return status;
  const std::lock_guard lock(mutex_);
  const Session::State state = session_->state(std::chrono::steady_clock::now());
  status.model_ready = true;
  status.case_id = options_.model->case_id;
  status.model_id = options_.model->model_id;
  status.busy = state.busy;
  status.updates = state.updates;
  return status;
}

// ---------- what it says of itself ----------

// No allocation once there is room: routing ids are short, and the figures are written over.
void Service::turned(const Peers& peers, const wire::DoorFigures& door) {
  {
    const std::lock_guard lock(viewers_mutex_);
    door_ = door;
    clients_ = static_cast<std::uint32_t>(peers.all().size());
    viewers_.resize(clients_);
    std::size_t viewers = 0;
    for (const auto& [routing_id, peer] : peers.all()) {
      if (!peer.viewer) continue;
      wire::ViewerFigures& figures = viewers_[viewers++];
      figures.peer = routing_id;
      figures.window = peer.viewer->subscription().window;
      figures.sent = peer.viewer->updates_sent();
      figures.received = peer.viewer->subscription().received;
      figures.owed = static_cast<std::uint32_t>(peer.viewer->owed());
      figures.replies_waiting = static_cast<std::uint32_t>(peer.replies.size());
    }
    viewers_.resize(viewers);
  }
  if (options_.on_turn) options_.on_turn();
}

WorkerHealth Service::worker_health() const {
  WorkerHealth health;
  health.limit = ServiceManager::kGrace;
  if (!session_) return health;
  const std::lock_guard lock(mutex_);
  const Session::State state = session_->state(std::chrono::steady_clock::now());
  health.working = std::chrono::duration<double>(state.working_s);
  health.limit += std::chrono::duration<double>(state.deadline_s);
  return health;
}

std::optional<wire::JournalFigures> Service::journal_figures() const {
  if (!journal_) return std::nullopt;
  const Recorded recorded = journal_->recorded();
  const fs::path log = recorded.file.string() + "-wal";
  return wire::JournalFigures{recorded.recording,     recorded.reason,
                              recorded.file.string(), bytes_of(recorded.file) + bytes_of(log),
                              recorded.records,       count(recorded.missing)};
}

wire::DaemonReport Service::report() const {
  wire::DaemonReport report;
  report.version = options_.version;
  report.build = options_.build;
  report.machine = options_.machine;
  report.blas_kernel = options_.blas_kernel;
  report.uptime_ms = static_cast<std::uint64_t>(uptime_.milliseconds());
  report.limit_ms = 1e3 * std::chrono::duration<double>(ServiceManager::kGrace).count();
  {
    const std::lock_guard lock(mutex_);
    report.session = state_now();
    if (session_) {
      const Session::State state = session_->state(std::chrono::steady_clock::now());
      report.model_ready = true;
      report.case_id = options_.model->case_id;
      report.owner = hexadecimal(state.owner);
      report.max_age_s = state.max_age_s;
      report.working_ms = 1e3 * state.working_s;
      report.limit_ms += 1e3 * state.deadline_s;
    }
  }
  counters_.report(report, std::chrono::steady_clock::now());
  {
    const std::lock_guard lock(viewers_mutex_);
    report.clients = clients_;
    report.viewers = viewers_;
    report.door = door_;
  }
  for (wire::ViewerFigures& viewer : report.viewers) viewer.peer = hexadecimal(viewer.peer);
  report.journal = journal_figures();
  if (options_.log_lines_lost) report.log_lines_lost = options_.log_lines_lost();
  report.process = process_figures();
  return report;
}

}  // namespace brainshift::server
