// SPDX-License-Identifier: GPL-3.0-or-later
// Clocks that are wrong: sources an hour off, acquisition times that cannot be, a wall clock that
// jumps. Nothing old is taken as new, and what is right is used as if nothing had been.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include "tests/faults/daemon_process.hpp"
#include "tests/faults/feed.hpp"
#include "tests/faults/settings.hpp"

namespace brainshift::faults {
namespace {

constexpr std::int64_t kHour_ns = 3'600'000'000'000;
const std::string kFakeTime = "/usr/lib/x86_64-linux-gnu/faketime/libfaketime.so.1";

using Updates = std::vector<Update>;

// Two observations of each source; `clock_off(i)`: by how much the source of the i-th is off, ns.
template <typename ClockOff>
Updates play(client::Client& client, const Feed& feed, const ClockOff& clock_off) {
  Updates updates;
  for (std::size_t i = 0; i < 2 * feed.sources(); ++i) {
    Observation observation = feed.live(i);
    observation.acquired_ns += clock_off(i % feed.sources());
    observation.sent_ns += clock_off(i % feed.sources());
    updates.push_back(answer_to(client, observation).update);
  }
  return updates;
}

Updates with_right_clocks(const DaemonProcess& daemon, const Feed& feed) {
  Opened opened = open_session(daemon.endpoint(), feed, false);
  need(opened.client.subscribe(), "subscribe");
  return play(opened.client, feed, [](std::size_t) { return std::int64_t{0}; });
}

double oldest_source_s(const Updates& updates) {
  double most = 0.0;
  for (const Update& update : updates) {
    for (const auto& source : update.estimate.sources) {
      most = std::max(most, std::abs(source.age_s));
    }
  }
  return most;
}

void sources_off(const DaemonProcess& daemon, const Feed& feed, const Updates& expected,
                 Tally& tally) {
  Opened opened = open_session(daemon.endpoint(), feed, false);
  need(opened.client.subscribe(), "subscribe");
  const auto updates = play(opened.client, feed, [](std::size_t source) {
    return source % 2 == 0 ? kHour_ns : -kHour_ns;
  });
  tally.equals("sources off by an hour either way: fields with other bits",
               differing(updates, expected), 0);
  tally.at_most("sources off by an hour either way: largest age s", oldest_source_s(updates), 5.0);
}

// Acquisition times that an observation handed over now cannot have.
std::vector<std::int64_t> impossible_times() {
  using Limits = std::numeric_limits<std::int64_t>;
  const std::int64_t now = monotonic_ns();
  return {Limits::min(),  Limits::min() + 1, Limits::max(), Limits::max() - 1, -1,
          now - kHour_ns, now + kHour_ns};
}

// Every impossible time, with and without the time of handing over, before and after a good one.
void impossible(const DaemonProcess& daemon, const Feed& feed, const Updates& expected, Rows& rows,
                Tally& tally) {
  Opened opened = open_session(daemon.endpoint(), feed, false);
  need(opened.client.subscribe(), "subscribe");
  int sent = 0, accepted = 0;
  const auto try_all = [&](std::size_t i, bool stated) {
    std::vector<std::int64_t> times = impossible_times();
    if (stated) times.push_back(0);
    for (const std::int64_t acquired_ns : times) {
      Observation observation = feed.live(i);
      observation.acquired_ns = acquired_ns;
      if (!stated) observation.sent_ns = 0;
      const bool taken = opened.client.submit(observation).has_value();
      ++sent;
      accepted += taken ? 1 : 0;
      rows.add({double(acquired_ns), double(stated), double(i), double(taken)});
    }
  };
  // A source's first observation says how old it is by sent_ns alone.
  for (std::size_t i = 0; i < feed.sources(); ++i) try_all(i, true);
  Updates updates;
  for (std::size_t i = 0; i < 2 * feed.sources(); ++i) {
    if (i >= feed.sources()) {
      try_all(i, true);
      try_all(i, false);
    }
    updates.push_back(answer_to(opened.client, feed.live(i)).update);
  }
  tally.shown("observations with impossible times", sent);
  tally.equals("observations with impossible times that were accepted", accepted, 0);
  tally.equals("impossible times: later fields with other bits", differing(updates, expected), 0);
}

void wall_clock(const Settings& settings, const Feed& feed, const Updates& expected, Tally& tally) {
#ifdef BRAINSHIFT_SANITIZED
  tally.left_out("wall clock off by an hour: a sanitizer must be the first library of the daemon");
  return;
#endif
  if (!std::filesystem::exists(kFakeTime)) {
    tally.left_out("wall clock off by an hour: Debian's package faketime is not installed");
    return;
  }
  const auto offset = settings.work / "offset";
  const auto set = [&](const char* text) { std::ofstream(offset) << text << '\n'; };
  set("+0");
  DaemonOptions options;
  options.model = settings.model;
  options.folder = settings.work;
  options.journal = true;
  options.environment = {"LD_PRELOAD=" + kFakeTime, "FAKETIME_TIMESTAMP_FILE=" + offset.string(),
                         "FAKETIME_NO_CACHE=1", "FAKETIME_DONT_FAKE_MONOTONIC=1"};
  const DaemonProcess daemon(options);
  Opened opened = open_session(daemon.endpoint(), feed, false);
  need(opened.client.subscribe(), "subscribe");
  Updates updates;
  int not_current = 0;
  for (std::size_t i = 0; i < 2 * feed.sources(); ++i) {
    set(std::array{"+3600", "-3600", "+0"}[i % 3]);
    updates.push_back(answer_to(opened.client, feed.live(i)).update);
    const auto status = opened.client.field_status();
    if (status.currency != client::Currency::kCurrent || status.age_s > 60.0) ++not_current;
  }
  tally.equals("wall clock off by an hour: fields with other bits", differing(updates, expected),
               0);
  tally.equals("wall clock off by an hour: fields not current", not_current, 0);
}

}  // namespace

void run_clocks(const Settings& settings, Tally& tally) {
  const Feed feed(settings.surgery);
  const DaemonProcess daemon({.model = settings.model, .folder = settings.work});
  const Updates expected = with_right_clocks(daemon, feed);
  Rows rows(settings.work / "clocks.csv", "acquired_ns,sent_stated,observation,accepted");
  sources_off(daemon, feed, expected, tally);
  impossible(daemon, feed, expected, rows, tally);
  wall_clock(settings, feed, expected, tally);
}

}  // namespace brainshift::faults
