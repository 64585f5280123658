// SPDX-License-Identifier: GPL-3.0-or-later
// What Service says of itself.
#include <fmt/format.h>

#include <filesystem>
#include <system_error>
#include <utility>

#include "server/operations/process_figures.hpp"
#include "server/service/service.hpp"
#include "server/transport/peers.hpp"

namespace brainshift::server {
namespace {

namespace fs = std::filesystem;

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
