// SPDX-License-Identifier: GPL-3.0-or-later
// Viewers that do not read, and many that do: what they get, and what it costs the others.
#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tests/faults/daemon_process.hpp"
#include "tests/faults/feed.hpp"
#include "tests/faults/need.hpp"
#include "tests/faults/settings.hpp"
#include "tests/faults/viewer.hpp"

namespace brainshift::faults {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;
using Viewers = std::vector<std::unique_ptr<Viewer>>;

constexpr Seconds kPeriod{0.1};                // of the observations
constexpr std::chrono::milliseconds kLook{2};  // how often
constexpr Seconds kPatience{10.0};             // for what must arrive

Viewers join(const std::string& endpoint, int count, const ViewerOptions& options) {
  Viewers viewers;
  for (int i = 0; i < count; ++i) viewers.push_back(std::make_unique<Viewer>(endpoint, options));
  return viewers;
}

// Until every viewer has answers to the last observation, or the patience ends.
void settle(const Viewers& viewers, const PacedSource& source) {
  const auto deadline = Clock::now() + kPatience;
  const std::uint64_t last = source.sent().rbegin()->first;
  for (const auto& viewer : viewers) {
    while (Clock::now() < deadline) {
      const auto arrivals = viewer->arrivals();
      if (!arrivals.empty() && arrivals.back().observation >= last) break;
      std::this_thread::sleep_for(kLook);
    }
  }
}

// Sends for a while and adds the latencies of all viewers.
void measure(PacedSource& source, const Viewers& viewers, double seconds,
             std::vector<double>& latencies) {
  const auto begin = Clock::now();
  source.send_for(Seconds(seconds), kPeriod);
  settle(viewers, source);
  for (const auto& viewer : viewers) {
    const auto more = latencies_ms(source, viewer->arrivals(), begin, Clock::now());
    latencies.insert(latencies.end(), more.begin(), more.end());
  }
}

// The first observations of a session pay for what later ones reuse.
void warm_up(PacedSource& source, const std::string& endpoint) {
  const Viewers viewers = join(endpoint, 1, {});
  std::vector<double> ignored;
  measure(source, viewers, 1.0, ignored);
}

void write_rows(const Settings& settings, const char* name, const std::vector<double>& without,
                const std::vector<double>& with) {
  Rows rows(settings.work / name, "with,latency_ms");
  for (const double latency : without) rows.add({0.0, latency});
  for (const double latency : with) rows.add({1.0, latency});
}

void compare_p99(Tally& tally, const std::vector<double>& without, const std::vector<double>& with,
                 double most_times) {
  tally.shown("updates that were timed without", static_cast<double>(without.size()));
  tally.shown("updates that were timed with", static_cast<double>(with.size()));
  tally.shown("p50 without ms", quantile(without, 0.5));
  tally.shown("p50 with ms", quantile(with, 0.5));
  tally.shown("p99 without ms", quantile(without, 0.99));
  tally.shown("p99 with ms", quantile(with, 0.99));
  tally.time_at_most("p99 with over p99 without", quantile(with, 0.99) / quantile(without, 0.99),
                     most_times);
}

}  // namespace

// In turns: two viewers, and the same with a third that does not read for `seconds`.
void run_stalled_viewer(const Settings& settings, Tally& tally) {
  const Feed feed(settings.surgery);
  const DaemonProcess daemon({.model = settings.model, .folder = settings.work});
  Opened opened = open_session(daemon.endpoint(), feed, false);
  PacedSource source(opened.client, feed);
  warm_up(source, daemon.endpoint());

  Viewer sleeper(daemon.endpoint());
  const Viewers others = join(daemon.endpoint(), 2, {});
  std::vector<double> without, with;
  int outdated = 0;
  for (int round = 0; round < settings.count; ++round) {
    measure(source, others, settings.seconds, without);
    sleeper.pause(true);
    measure(source, others, settings.seconds, with);
    // What the others have is out: the sleeper's first update may not be older.
    const std::uint64_t newest = std::max(others[0]->newest_update(), others[1]->newest_update());
    const std::size_t before = sleeper.arrivals().size();
    sleeper.pause(false);
    const auto deadline = Clock::now() + kPatience;
    while (sleeper.arrivals().size() == before && Clock::now() < deadline) {
      std::this_thread::sleep_for(kLook);
    }
    const auto arrivals = sleeper.arrivals();
    outdated += arrivals.size() > before && arrivals[before].update >= newest ? 0 : 1;
    show_progress("stalled viewer", round + 1, settings.count);
  }
  write_rows(settings, "stalled-viewer.csv", without, with);
  tally.shown("s without reading", settings.seconds);
  tally.equals("first updates after it that were not the newest", outdated, 0);
  compare_p99(tally, without, with, 1.2);
}

// In turns: one viewer of a region of interest, and 16.
void run_many_viewers(const Settings& settings, Tally& tally) {
  constexpr int kMany = 16, kRounds = 5;
  constexpr double kMargin_mm = 40.0;
  ViewerOptions options;
  options.choice.region = TumourRegion{kMargin_mm};
  const Feed feed(settings.surgery);
  const DaemonProcess daemon({.model = settings.model, .folder = settings.work});
  Opened opened = open_session(daemon.endpoint(), feed, false);
  PacedSource source(opened.client, feed);
  warm_up(source, daemon.endpoint());
  std::vector<double> one, many;
  for (int round = 0; round < kRounds; ++round) {
    measure(source, join(daemon.endpoint(), 1, options), settings.seconds, one);
    measure(source, join(daemon.endpoint(), kMany, options), settings.seconds, many);
    show_progress("many viewers", round + 1, kRounds);
  }
  write_rows(settings, "many-viewers.csv", one, many);
  tally.shown("viewers", kMany);
  tally.shown("margin of the region about the tumour mm", kMargin_mm);
  compare_p99(tally, one, many, 1.5);
}

}  // namespace brainshift::faults
