// SPDX-License-Identifier: GPL-3.0-or-later
// ServiceManager: tells systemd how the daemon is (sd_notify(3)): ready, a line of status, alive,
// stopping. Does nothing in a process that systemd did not start.
//
// "Alive" is said by the transport thread while it turns, and only as long as the worker is known
// to work: systemd ends and restarts a daemon of which one of the two hangs (WatchdogSec of
// docker/brainshiftd.service). A worker that is busy hangs once it is busy for longer than the
// running session's update may take, and kGrace. A preparation runs on another thread, takes as
// long as it takes, and is never a hang.
#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace brainshift::server {

// Of the session's worker.
struct WorkerHealth {
  std::chrono::duration<double> working{0.0};  // at what it does now; 0: it waits
  std::chrono::duration<double> limit{0.0};    // above which it hangs

  bool hangs() const { return working > limit; }
};

class ServiceManager {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  // What an update needs beside its inversion, or a session to begin: registration, journal,
  // pages that were swapped out. Far above what was ever measured.
  static constexpr std::chrono::seconds kGrace{10};

  // From $NOTIFY_SOCKET, $WATCHDOG_USEC and $WATCHDOG_PID.
  static ServiceManager from_environment();

  // Clients can connect, and the model is there.
  void ready();
  void stopping();

  // How long may pass between two turns; none: systemd wants to hear nothing.
  std::optional<std::chrono::milliseconds> interval() const;
  // Whether interval() has passed since the last turn that was due.
  bool due(TimePoint now) const;
  // Says what has changed of the status, and that the daemon is alive, unless the worker hangs.
  // Returns false when it hangs.
  bool turn(const std::string& status, const WorkerHealth& worker, TimePoint now);

 private:
  void send(const std::string& state) const;

  std::string socket_;  // empty: nobody listens
  std::optional<std::chrono::microseconds> watchdog_;
  std::string status_;
  TimePoint last_turn_ = {};
};

}  // namespace brainshift::server
