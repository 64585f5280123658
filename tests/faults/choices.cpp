// SPDX-License-Identifier: GPL-3.0-or-later
// One viewer that changes its choice without end: memory stays.
#include <algorithm>
#include <chrono>
#include <random>

#include "tests/faults/daemon_process.hpp"
#include "tests/faults/feed.hpp"
#include "tests/faults/settings.hpp"

namespace brainshift::faults {

void run_choices(const Settings& settings, Tally& tally) {
  const Feed feed(settings.surgery);
  const DaemonProcess daemon({.model = settings.model, .folder = settings.work, .log = false});
  Opened opened = open_session(daemon.endpoint(), feed, false);
  need(opened.client.subscribe(), "subscribe");
  for (std::size_t i = 0; i < 2 * feed.sources(); ++i) answer_to(opened.client, feed.live(i));
  auto viewer = need(client::Client::connect(daemon.endpoint()), "connect");
  const auto model = need(viewer.model(), "model");

  Rows rows(settings.work / "choices.csv", "choices,resident_mib");
  std::mt19937 random(settings.seed);
  const auto between = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random()) / 4294967296.0;
  };
  double idle_mib = 0.0, most_mib = 0.0;
  int taken = 0, fields = 0;
  for (int i = 0; i < settings.count; ++i) {
    const auto node = static_cast<Eigen::Index>(random() % model.mesh.num_nodes());
    // A viewer of any such choice costs something: growth is counted from the 100th.
    if (i == std::min(100, settings.count / 2)) idle_mib = daemon.resident_mib();
    FieldChoice choice{.region = BallRegion{model.mesh.nodes.col(node), between(20.0, 90.0)}};
    choice.spacing_mm = i % 3 == 0 ? between(1.0, 10.0) : 0.0;
    choice.tolerance_mm = i % 2 == 0 ? between(0.01, 1.0) : 0.0;
    taken += viewer.subscribe(1, choice) ? 1 : 0;
    const auto message = viewer.next_update(std::chrono::milliseconds(i % 8 == 0 ? 100 : 1));
    fields += message && !message->error ? 1 : 0;
    if (i % 50 == 49) answer_to(opened.client, feed.live(2 * feed.sources() + i / 50));
    if (idle_mib > 0.0 && i % 100 == 99) {
      most_mib = std::max(most_mib, daemon.resident_mib());
      rows.add({double(i + 1), daemon.resident_mib()});
    }
    show_progress("choices", i + 1, settings.count);
  }
  tally.at_least("different choices of one viewer that were taken", taken, settings.count);
  tally.shown("fields that it received", fields);
  tally.equals("crashes", daemon.runs() ? 0 : 1, 0);
  tally.cost_at_most("growth of resident memory MiB", most_mib - idle_mib, 32.0);
}

}  // namespace brainshift::faults
