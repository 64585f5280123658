// SPDX-License-Identifier: GPL-3.0-or-later
// Viewers that do not read, and many that do: what they get, and what it costs the others.
#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/faults/daemon_process.hpp"
#include "tests/faults/feed.hpp"
#include "tests/faults/settings.hpp"

namespace brainshift::faults {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr Seconds kPeriod{0.1};                // of the observations
constexpr std::chrono::milliseconds kLook{2};  // how often
constexpr Seconds kPatience{10.0};             // for what must arrive

struct Arrival {
  std::uint64_t observation = 0;  // sequence
  std::uint64_t update = 0;       // sequence
  Clock::time_point at;
};

// A viewer on a thread of its own, which notes what it received and when.
class Viewer {
 public:
  explicit Viewer(const std::string& endpoint, const FieldChoice& choice = {})
      : client_(need(client::Client::connect(endpoint), "connect")) {
    need(client_.subscribe(1, choice), "subscribe");
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
  ~Viewer() {
    thread_.request_stop();
    thread_.join();
  }
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  // Stops reading; returns when it has stopped. False: it reads again.
  void pause(bool paused) {
    std::unique_lock lock(mutex_);
    paused_ = paused;
    changed_.notify_all();
    if (paused) changed_.wait(lock, [&] { return !reading_; });
  }
  // Final updates so far, in order of arrival.
  std::vector<Arrival> arrivals() const {
    const std::lock_guard lock(mutex_);
    return arrivals_;
  }
  std::uint64_t newest_update() const {
    const std::lock_guard lock(mutex_);
    return arrivals_.empty() ? 0 : arrivals_.back().update;
  }

 private:
  void run(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      {
        std::unique_lock lock(mutex_);
        reading_ = !paused_;
        changed_.notify_all();
        if (!changed_.wait(lock, stop, [&] { return !paused_; })) return;
        reading_ = true;
      }
      const auto message = client_.next_update(std::chrono::milliseconds(100));
      if (!message || message->error || !message->update.final) continue;
      const std::lock_guard lock(mutex_);
      arrivals_.push_back(
          {message->update.observation_sequence, message->update.sequence, Clock::now()});
    }
  }

  client::Client client_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  bool paused_ = false;
  bool reading_ = true;
  std::vector<Arrival> arrivals_;
  std::jthread thread_;
};

// Sends the observations of a feed, one every kPeriod, on the caller's thread.
class PacedSource {
 public:
  PacedSource(client::Client& client, const Feed& feed) : client_(client), feed_(feed) {}

  void send_for(Seconds duration) {
    const auto begin = Clock::now();
    for (int i = 0; i * kPeriod < duration; ++i) {
      std::this_thread::sleep_until(begin +
                                    std::chrono::duration_cast<Clock::duration>(i * kPeriod));
      const Observation observation = feed_.live(next_++);
      sent_[observation.sequence] = Clock::now();
      need(client_.submit(observation), "submit");
    }
  }
  std::uint64_t last() const { return sent_.rbegin()->first; }
  // ms from hand-over to arrival, of the arrivals that answer what was sent in [from, until).
  std::vector<double> latencies_ms(const std::vector<Arrival>& arrivals, Clock::time_point from,
                                   Clock::time_point until) const {
    std::vector<double> latencies;
    for (const Arrival& arrival : arrivals) {
      const auto sent = sent_.find(arrival.observation);
      if (sent == sent_.end() || sent->second < from || sent->second >= until) continue;
      latencies.push_back(
          std::chrono::duration<double, std::milli>(arrival.at - sent->second).count());
    }
    return latencies;
  }

 private:
  client::Client& client_;
  const Feed& feed_;
  std::size_t next_ = 0;
  std::map<std::uint64_t, Clock::time_point> sent_;  // when each was handed over, by sequence
};

using Viewers = std::vector<std::unique_ptr<Viewer>>;

Viewers join(const std::string& endpoint, int count, const FieldChoice& choice = {}) {
  Viewers viewers;
  for (int i = 0; i < count; ++i) viewers.push_back(std::make_unique<Viewer>(endpoint, choice));
  return viewers;
}

// Until every viewer has answers to the last observation, or the patience ends.
void settle(const Viewers& viewers, const PacedSource& source) {
  const auto deadline = Clock::now() + kPatience;
  for (const auto& viewer : viewers) {
    while (Clock::now() < deadline) {
      const auto arrivals = viewer->arrivals();
      if (!arrivals.empty() && arrivals.back().observation >= source.last()) break;
      std::this_thread::sleep_for(kLook);
    }
  }
}

// Sends for a while and adds the latencies of all viewers.
void measure(PacedSource& source, const Viewers& viewers, double seconds,
             std::vector<double>& latencies) {
  const auto begin = Clock::now();
  source.send_for(Seconds(seconds));
  settle(viewers, source);
  for (const auto& viewer : viewers) {
    const auto more = source.latencies_ms(viewer->arrivals(), begin, Clock::now());
    latencies.insert(latencies.end(), more.begin(), more.end());
  }
}

// The first observations of a session pay for what later ones reuse.
void warm_up(PacedSource& source, const std::string& endpoint) {
  const Viewers viewers = join(endpoint, 1);
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
  const Viewers others = join(daemon.endpoint(), 2);
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
  const FieldChoice near{.region = TumourRegion{kMargin_mm}};
  const Feed feed(settings.surgery);
  const DaemonProcess daemon({.model = settings.model, .folder = settings.work});
  Opened opened = open_session(daemon.endpoint(), feed, false);
  PacedSource source(opened.client, feed);
  warm_up(source, daemon.endpoint());
  std::vector<double> one, many;
  for (int round = 0; round < kRounds; ++round) {
    measure(source, join(daemon.endpoint(), 1, near), settings.seconds, one);
    measure(source, join(daemon.endpoint(), kMany, near), settings.seconds, many);
    show_progress("many viewers", round + 1, kRounds);
  }
  write_rows(settings, "many-viewers.csv", one, many);
  tally.shown("viewers", kMany);
  tally.shown("margin of the region about the tumour mm", kMargin_mm);
  compare_p99(tally, one, many, 1.5);
}

}  // namespace brainshift::faults
