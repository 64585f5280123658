// SPDX-License-Identifier: GPL-3.0-or-later
// Too many connections: raw ones that never speak, peers that speak badly and stay, and a daemon
// with few descriptors. A client of good will is served all the same, nothing spins, nothing leaks.
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <string>
#include <thread>

#include "tests/faults/daemon_process.hpp"
#include "tests/faults/feed.hpp"
#include "tests/faults/settings.hpp"
#include "tests/support/zmtp_peer.hpp"

namespace brainshift::faults {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::seconds;
using test_support::port_of;
using test_support::ZmtpPeer;

constexpr int kHeld = 400;       // raw connections at a time
constexpr double kIdle_s = 5.0;  // over which processor time is taken
constexpr double kMaxIdle_s = 0.25;
constexpr double kMaxWait_s = 2.0;

double idle_cpu_s(const DaemonProcess& daemon) {
  const double before = daemon.cpu_s();
  std::this_thread::sleep_for(std::chrono::duration<double>(kIdle_s));
  return daemon.cpu_s() - before;
}

// Descriptors above `before` that the daemon still has after a while.
int leaked(const DaemonProcess& daemon, int before) {
  const auto deadline = Clock::now() + seconds(15);
  while (daemon.descriptors() > before && Clock::now() < deadline) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return std::max(0, daemon.descriptors() - before);
}

// The slowest of a few answers to new clients.
double slowest_answer_s(const std::string& endpoint) {
  double slowest = 0.0;
  for (int i = 0; i < 3; ++i) slowest = std::max(slowest, answered_within_s(endpoint));
  return slowest;
}

void raw_connections(const Settings& settings, Tally& tally) {
  const DaemonProcess daemon({.model = settings.model, .folder = settings.work});
  answered_within_s(daemon.endpoint());
  const int before = daemon.descriptors();
  std::deque<ZmtpPeer> held;
  double slowest_s = 0.0;
  int refused = 0;
  for (int i = 0; i < settings.count; ++i) {
    held.emplace_back(port_of(daemon.endpoint()));
    refused += held.back().connected() ? 0 : 1;
    if (held.size() > kHeld) held.pop_front();
    if (i % 500 == 499) slowest_s = std::max(slowest_s, answered_within_s(daemon.endpoint()));
    show_progress("raw connections", i + 1, settings.count);
  }
  slowest_s = std::max(slowest_s, slowest_answer_s(daemon.endpoint()));
  held.clear();
  tally.shown("raw connections", settings.count);
  tally.shown("of them refused by the kernel", refused);
  tally.at_most("raw connections: slowest answer to a client s", slowest_s, kMaxWait_s);
  tally.equals("raw connections: descriptors left behind", leaked(daemon, before), 0);
  tally.cost_at_most("raw connections: processor time of 5 idle s", idle_cpu_s(daemon), kMaxIdle_s);
}

// As many as the daemon serves clients. Each says one byte that is no message, and stays.
void bad_peers(const Settings& settings, Tally& tally) {
  constexpr int kPeers = 32;
  const DaemonProcess daemon(
      {.model = settings.model, .folder = settings.work, .max_clients = kPeers});
  answered_within_s(daemon.endpoint());
  const int before = daemon.descriptors();
  std::deque<ZmtpPeer> peers;
  for (int i = 0; i < kPeers; ++i) {
    peers.emplace_back(port_of(daemon.endpoint()));
    if (peers.back().shake_hands()) peers.back().send_part("x", false);
  }
  tally.shown("bad peers that stay", kPeers);
  tally.at_most("bad peers: slowest answer to a client s", slowest_answer_s(daemon.endpoint()),
                kMaxWait_s);
  tally.cost_at_most("bad peers: processor time of 5 idle s", idle_cpu_s(daemon), kMaxIdle_s);
  peers.clear();
  tally.equals("bad peers: descriptors left behind", leaked(daemon, before), 0);
}

// More connections than the daemon may have descriptors. Each greets as a peer does and stays
// silent, so that no limit on handshakes drops it.
void few_descriptors(const Settings& settings, Tally& tally) {
  constexpr int kLimit = 256, kConnections = 300;
  constexpr int kJournal = 3;  // file, log and its index, open until the next session
  const Feed feed(settings.surgery);
  const DaemonProcess daemon({.model = settings.model,
                              .folder = settings.work,
                              .journal = true,
                              .max_descriptors = kLimit});
  answered_within_s(daemon.endpoint());
  const int before = daemon.descriptors();
  std::deque<ZmtpPeer> held;
  for (int i = 0; i < kConnections; ++i) {
    held.emplace_back(port_of(daemon.endpoint()));
    held.back().greet();
  }
  // Heartbeats drop silent peers after 5 s: what is crowded is the time until then.
  const auto begin = Clock::now();
  const double cpu_before_s = daemon.cpu_s();
  const double waited_s = answered_within_s(daemon.endpoint());
  std::this_thread::sleep_until(begin + seconds(3));
  const double passed_s = std::chrono::duration<double>(Clock::now() - begin).count();
  const double busy_pct = 100.0 * (daemon.cpu_s() - cpu_before_s) / passed_s;
  tally.shown("few descriptors: limit", kLimit);
  tally.shown("few descriptors: silent peers", kConnections);
  tally.shown("few descriptors: in use then", daemon.descriptors());
  tally.at_most("few descriptors: slowest answer to a client s", waited_s, kMaxWait_s);
  tally.cost_at_most("few descriptors: processor time while crowded % of a core", busy_pct,
                     100.0 * kMaxIdle_s / kIdle_s);
  bool records = false;
  if (waited_s <= kMaxWait_s) {
    // The journal opens its files when a session starts.
    Opened opened = open_session(daemon.endpoint(), feed, false);
    const auto deadline = Clock::now() + seconds(2);
    while (!records && Clock::now() < deadline) {
      need(opened.client.subscribe(), "subscribe");
      const auto& state = opened.client.session_state();
      records = state && state->recording && state->recording->recording;
    }
  }
  tally.equals("few descriptors: a session records", records ? 1 : 0, 1);
  held.clear();
  tally.equals("few descriptors: left behind beside the journal's three",
               leaked(daemon, before + kJournal), 0);
}

}  // namespace

void run_crowds(const Settings& settings, Tally& tally) {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
  raw_connections(settings, tally);
  bad_peers(settings, tally);
  few_descriptors(settings, tally);
}

}  // namespace brainshift::faults
