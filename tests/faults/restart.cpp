// SPDX-License-Identifier: GPL-3.0-or-later
// The daemon is killed and started again at the same endpoint with another patient's model, while
// viewers are connected. None of them may show its field, and each says why.
#include <chrono>
#include <csignal>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/faults/daemon_process.hpp"
#include "tests/faults/feed.hpp"
#include "tests/faults/settings.hpp"

namespace brainshift::faults {
namespace {

using Clock = std::chrono::steady_clock;
using client::Currency;
using std::chrono::milliseconds;

constexpr int kViewers = 4;

struct Watched {
  client::Client client;
  std::string model;  // that it has loaded
  int shown = 0;      // fields of another model that it was given, or called current
  int silent = 0;     // not current, and no reason
};

void look(Watched& viewer) {
  const auto message = viewer.client.next_update(milliseconds(10));
  const auto status = viewer.client.field_status();
  const auto& field = viewer.client.latest_usable();
  const bool of_another =
      (message && !message->error && message->update.model_id != viewer.model) ||
      (field && field->update.model_id != viewer.model);
  viewer.shown += of_another ? 1 : 0;
  if (status.currency != Currency::kCurrent && status.reason.empty()) ++viewer.silent;
}

// Until every viewer's currency is (or is not) kCurrent; false after 20 s.
bool all_become(std::vector<Watched>& viewers, bool current) {
  const auto deadline = Clock::now() + std::chrono::seconds(20);
  for (Watched& viewer : viewers) {
    while ((viewer.client.field_status().currency == Currency::kCurrent) != current) {
      if (Clock::now() > deadline) return false;
      look(viewer);
    }
  }
  return true;
}

}  // namespace

void run_restart(const Settings& settings, Tally& tally) {
  const Feed feed(settings.surgery);
  DaemonOptions options;
  options.model = settings.model;
  options.folder = settings.work;
  int shown = 0, silent = 0, current = 0, wrong_reason = 0, not_told = 0, usable = 0;
  for (int run = 0; run < settings.count; ++run) {
    options.endpoint = "tcp://127.0.0.1:*";
    options.model = settings.model;
    auto daemon = std::make_unique<DaemonProcess>(options);
    std::vector<Watched> viewers;
    {
      Opened opened = open_session(daemon->endpoint(), feed, false);
      need(opened.client.subscribe(), "subscribe");
      for (int i = 0; i < kViewers; ++i) {
        Watched viewer{need(client::Client::connect(daemon->endpoint()), "connect"), {}};
        viewer.model = need(viewer.client.model(), "model").model_id;
        need(viewer.client.subscribe(), "subscribe");
        viewers.push_back(std::move(viewer));
      }
      answer_to(opened.client, feed.live(0));
      if (!all_become(viewers, true)) throw std::runtime_error("no current field to begin with");
    }
    options.endpoint = daemon->endpoint();
    options.model = settings.other_model;
    daemon->end(SIGKILL);
    daemon = std::make_unique<DaemonProcess>(options);
    // The next patient's session, with fields for those who ask.
    auto client = need(client::Client::connect(daemon->endpoint()), "connect");
    SessionRequest request;
    request.case_id = need(client.status(), "status").case_id;
    const auto info = need(client.start_session(request), "start a session");
    need(client.subscribe(), "subscribe");
    const auto deadline = Clock::now() + std::chrono::seconds(3);
    for (std::size_t i = 0; Clock::now() < deadline; ++i) {
      Observation observation = feed.live(i);
      observation.case_id = request.case_id;
      usable += answer_to(client, observation).update.usable() ? 1 : 0;
      for (Watched& viewer : viewers) {
        look(viewer);
        const bool is_current = viewer.client.field_status().currency == Currency::kCurrent;
        // The lease of the field before may still hold in the first second.
        const bool lease_over = Clock::now() > deadline - milliseconds(1500);
        current += is_current && lease_over ? 1 : 0;
      }
    }
    for (Watched& viewer : viewers) {
      const std::string reason = viewer.client.field_status().reason;
      wrong_reason += reason.find(info.model_id) == std::string::npos ? 1 : 0;
      const auto& state = viewer.client.session_state();
      not_told += state && state->session.model_id == info.model_id ? 0 : 1;
      shown += viewer.shown;
      silent += viewer.silent;
    }
    show_progress("restarts", run + 1, settings.count);
  }
  tally.shown("restarts", settings.count);
  tally.shown("viewers of each", kViewers);
  tally.at_least("usable fields of the other patient", usable, settings.count);
  tally.equals("fields of the other patient that a viewer was given", shown, 0);
  tally.equals("viewers that called a field current afterwards", current, 0);
  tally.equals("viewers that gave no reason", silent, 0);
  tally.equals("viewers that did not learn of the other model", not_told, 0);
  tally.equals("viewers whose reason does not name it", wrong_reason, 0);
}

}  // namespace brainshift::faults
