// SPDX-License-Identifier: GPL-3.0-or-later
// A network that swallows everything without closing: the viewer's field stops being current within
// a second, and becomes current again when the network does. The same for a cut connection.
#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>

#include "tests/faults/daemon_process.hpp"
#include "tests/faults/feed.hpp"
#include "tests/faults/need.hpp"
#include "tests/faults/raw_peer.hpp"
#include "tests/faults/settings.hpp"
#include "tests/faults/tcp_proxy.hpp"

namespace brainshift::faults {
namespace {

using Clock = std::chrono::steady_clock;
using client::Currency;
using std::chrono::milliseconds;

// s until the field is current; `most_s` when it never is.
double seconds_until_current(client::Client& viewer, double most_s) {
  const auto begin = Clock::now();
  const auto passed = [&] { return std::chrono::duration<double>(Clock::now() - begin).count(); };
  while (viewer.field_status().currency != Currency::kCurrent && passed() < most_s) {
    const auto asked = Clock::now();
    static_cast<void>(viewer.next_update(milliseconds(10)));
    // After a loss the call returns at once.
    std::this_thread::sleep_until(asked + milliseconds(5));
  }
  return passed();
}

// s after which the field was still called current, at the last.
double seconds_still_current(client::Client& viewer) {
  const auto begin = Clock::now();
  double last_s = 0.0;
  while (last_s < 10.0) {
    const auto looked = Clock::now();
    if (viewer.field_status().currency != Currency::kCurrent) break;
    last_s = std::chrono::duration<double>(looked - begin).count();
    static_cast<void>(viewer.next_update(milliseconds(1)));
  }
  return last_s;
}

// s of the next `over_s` in which the field is not current.
double seconds_not_current(client::Client& viewer, double over_s) {
  const auto end = Clock::now() + std::chrono::duration<double>(over_s);
  double sum_s = 0.0;
  while (Clock::now() < end) {
    const auto asked = Clock::now();
    static_cast<void>(viewer.next_update(milliseconds(10)));
    std::this_thread::sleep_until(asked + milliseconds(5));
    if (viewer.field_status().currency == Currency::kCurrent) continue;
    sum_s += std::chrono::duration<double>(Clock::now() - asked).count();
  }
  return sum_s;
}

}  // namespace

void run_half_open(const Settings& settings, Tally& tally) {
  const Feed feed(settings.surgery);
  const DaemonProcess daemon({.model = settings.model, .folder = settings.work});
  Opened opened = open_session(daemon.endpoint(), feed, false);
  need(opened.client.subscribe(), "subscribe");
  answer_to(opened.client, feed.live(0));

  TcpProxy proxy(port_of(daemon.endpoint()));
  auto viewer = need(client::Client::connect(proxy.endpoint()), "connect");
  need(viewer.subscribe(), "subscribe");
  double noticed_s = 0.0, healed_s = 0.0, cut_s = 0.0, delayed_s = 0.0;
  int unreasoned = 0;
  Rows rows(settings.work / "half-open.csv",
            "run,still_current_s,healed_s,not_current_after_cut_s");
  if (seconds_until_current(viewer, 10.0) >= 10.0) throw std::runtime_error("no current field");
  for (int run = 0; run < settings.count; ++run) {
    // Not at the same phase of the renewals each time.
    std::this_thread::sleep_for(milliseconds(37 * run % 250));
    proxy.stall(true);
    const double noticed = seconds_still_current(viewer);
    unreasoned += viewer.field_status().reason.empty() ? 1 : 0;
    proxy.stall(false);
    const double healed = seconds_until_current(viewer, 30.0);
    proxy.cut();
    const double after_cut = seconds_not_current(viewer, 2.0);
    rows.add({double(run), noticed, healed, after_cut});
    noticed_s = std::max(noticed_s, noticed);
    healed_s = std::max(healed_s, healed);
    cut_s = std::max(cut_s, after_cut);
    show_progress("half-open", run + 1, settings.count);
  }
  proxy.delay(milliseconds(100));
  delayed_s = seconds_not_current(viewer, 3.0);
  tally.shown("half-open connections", settings.count);
  tally.at_most("longest called current after the connection went half-open s", noticed_s, 1.0);
  tally.equals("without a reason to show", unreasoned, 0);
  tally.shown("slowest return to current after it s", healed_s);
  tally.shown("longest time not current after a cut s", cut_s);
  tally.shown("time not current in 3 s with a delay of 100 ms each way s", delayed_s);
}

}  // namespace brainshift::faults
