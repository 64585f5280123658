// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/operations/service_manager.hpp"

#include <systemd/sd-daemon.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>

namespace brainshift::server {
namespace {

// Without a watchdog, only the line of status has to be brought up to date.
constexpr std::chrono::milliseconds kStatusInterval{1000};
// Two signs of life may be lost.
constexpr int kSignsPerLimit = 3;

}  // namespace

ServiceManager ServiceManager::from_environment() {
  ServiceManager manager;
  std::uint64_t limit_us = 0;
  const int watched = sd_watchdog_enabled(0, &limit_us);
  const char* socket = std::getenv("NOTIFY_SOCKET");
  if (socket == nullptr) return manager;
  manager.socket_ = socket;
  if (watched > 0) manager.watchdog_ = std::chrono::microseconds(limit_us);
  return manager;
}

void ServiceManager::send(const std::string& state) const {
  // A manager that cannot be reached is no reason to stop serving.
  if (!socket_.empty()) static_cast<void>(sd_notify(0, state.c_str()));
}

void ServiceManager::ready() { send("READY=1"); }

void ServiceManager::stopping() { send("STOPPING=1"); }

std::optional<std::chrono::milliseconds> ServiceManager::interval() const {
  if (socket_.empty()) return std::nullopt;
  if (!watchdog_) return kStatusInterval;
  const auto sign =
      std::chrono::duration_cast<std::chrono::milliseconds>(*watchdog_) / kSignsPerLimit;
  return std::min(kStatusInterval, std::max(sign, std::chrono::milliseconds(1)));
}

bool ServiceManager::due(TimePoint now) const {
  const auto interval_or_none = interval();
  return interval_or_none && now - last_turn_ >= *interval_or_none;
}

bool ServiceManager::turn(const std::string& status, const WorkerHealth& worker, TimePoint now) {
  last_turn_ = now;
  if (status != status_) {
    status_ = status;
    std::string line = "STATUS=" + status;
    std::replace(line.begin(), line.end(), '\n', ' ');  // which would begin another word
    send(line);
  }
  if (worker.hangs()) return false;
  if (watchdog_) send("WATCHDOG=1");
  return true;
}

}  // namespace brainshift::server
