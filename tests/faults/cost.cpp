// SPDX-License-Identifier: GPL-3.0-or-later
// What safety costs in latency: two daemons that differ in one thing, asked in turns, so that what
// else the machine does meets both.
#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/faults/daemon_process.hpp"
#include "tests/faults/feed.hpp"
#include "tests/faults/settings.hpp"

namespace brainshift::faults {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr int kBlock = 20;  // updates of one daemon before the other has its turn

// One of the two: a session, and how long its answers took.
class Side {
 public:
  Side(const DaemonOptions& options, const Feed& feed)
      : feed_(feed),
        daemon_(options),
        opened_(open_session(daemon_.endpoint(), feed, false, daemon_.keys())) {
    need(opened_.client.subscribe(), "subscribe");
  }
  void ask(int times) {
    for (int i = 0; i < times; ++i) {
      const Observation observation = feed_.live(next_++);
      const auto begin = Clock::now();
      answer_to(opened_.client, observation);
      latencies_ms_.push_back(
          std::chrono::duration<double, std::milli>(Clock::now() - begin).count());
    }
  }
  void forget() { latencies_ms_.clear(); }
  const std::vector<double>& latencies_ms() const { return latencies_ms_; }

 private:
  const Feed& feed_;
  DaemonProcess daemon_;
  Opened opened_;
  std::size_t next_ = 0;
  std::vector<double> latencies_ms_;
};

// `what`: in which the second differs from the first ("journal and keys").
void compare_cost(const std::string& what, const DaemonOptions& without, const DaemonOptions& with,
                  const Settings& settings, Tally& tally) {
  const Feed feed(settings.surgery);
  Side first(without, feed), second(with, feed);
  first.ask(kBlock);
  second.ask(kBlock);
  first.forget();
  second.forget();
  for (int done = 0; done < settings.count; done += kBlock) {
    // Neither side is always the first of a pair.
    Side& one = done / kBlock % 2 == 0 ? first : second;
    Side& other = done / kBlock % 2 == 0 ? second : first;
    one.ask(kBlock);
    other.ask(kBlock);
    show_progress(what, done + kBlock, settings.count);
  }
  Rows rows(settings.work / "cost.csv", "with,latency_ms");
  for (const double each : first.latencies_ms()) rows.add({0.0, each});
  for (const double each : second.latencies_ms()) rows.add({1.0, each});
  const auto p = [](const Side& side, double share) {
    return quantile(side.latencies_ms(), share);
  };
  const auto more_pct = [&](double share) {
    return 100.0 * (p(second, share) / p(first, share) - 1);
  };
  tally.shown("updates of each daemon", double(first.latencies_ms().size()));
  tally.shown("p50 without " + what + " ms", p(first, 0.5));
  tally.shown("p99 without " + what + " ms", p(first, 0.99));
  tally.shown("p99 with " + what + " ms", p(second, 0.99));
  tally.time_at_most("p50 with " + what + " above without %", more_pct(0.5), 10.0);
  tally.time_at_most("p99 with " + what + " above without %", more_pct(0.99), 25.0);
}

DaemonOptions in_folder(const Settings& settings, const char* name) {
  DaemonOptions options;
  options.model = settings.model;
  options.folder = settings.work / name;
  fs::create_directories(options.folder);
  return options;
}

}  // namespace

void run_cost(const Settings& settings, Tally& tally) {
  const DaemonOptions plain = in_folder(settings, "plain");
  DaemonOptions safe = in_folder(settings, "journal-and-keys");
  safe.journal = safe.keys = true;
  compare_cost("journal and keys", plain, safe, settings, tally);
  fs::remove_all(safe.folder / "journal");
}

}  // namespace brainshift::faults
