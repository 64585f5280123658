// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/faults/viewer.hpp"

#include <algorithm>

#include "tests/faults/need.hpp"

namespace brainshift::faults {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

Viewer::Viewer(const std::string& endpoint, const ViewerOptions& options)
    : client_(need(client::Client::connect(endpoint), "connect")) {
  need(client_.subscribe(options.window, options.choice), "subscribe");
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

Viewer::~Viewer() {
  thread_.request_stop();
  thread_.join();
}

void Viewer::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    {
      std::unique_lock lock(mutex_);
      reading_ = !paused_;
      changed_.notify_all();
      if (!changed_.wait(lock, stop, [&] { return !paused_; })) return;
      reading_ = true;
    }
    const auto message = client_.next_update(milliseconds(100));
    if (!message || message->error || !message->update.final) continue;
    const std::lock_guard lock(mutex_);
    arrivals_.push_back(
        {message->update.observation_sequence, message->update.sequence, Clock::now()});
  }
}

void Viewer::pause(bool paused) {
  std::unique_lock lock(mutex_);
  paused_ = paused;
  changed_.notify_all();
  if (paused) changed_.wait(lock, [&] { return !reading_; });
}

std::vector<Arrival> Viewer::arrivals() const {
  const std::lock_guard lock(mutex_);
  return arrivals_;
}

std::uint64_t Viewer::newest_update() const {
  const std::lock_guard lock(mutex_);
  return arrivals_.empty() ? 0 : arrivals_.back().update;
}

void PacedSource::send_for(std::chrono::duration<double> duration,
                           std::chrono::duration<double> period) {
  const auto begin = Clock::now();
  for (int i = 0; i * period < duration; ++i) {
    std::this_thread::sleep_until(begin + std::chrono::duration_cast<Clock::duration>(i * period));
    const Observation observation = feed_.live(next_++);
    sent_[observation.sequence] = Clock::now();
    need(client_.submit(observation), "submit");
  }
}

std::vector<double> latencies_ms(const PacedSource& source, const std::vector<Arrival>& arrivals,
                                 SteadyTime from, SteadyTime until) {
  std::vector<double> latencies;
  for (const Arrival& arrival : arrivals) {
    const auto sent = source.sent().find(arrival.observation);
    if (sent == source.sent().end() || sent->second < from || sent->second >= until) continue;
    latencies.push_back(
        std::chrono::duration<double, std::milli>(arrival.at - sent->second).count());
  }
  return latencies;
}

}  // namespace brainshift::faults
