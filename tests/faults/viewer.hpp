// SPDX-License-Identifier: GPL-3.0-or-later
// A viewer on a thread of its own, which notes what it received and when; and a source that sends
// at a steady pace.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "client/lib/client.hpp"
#include "tests/faults/feed.hpp"

namespace brainshift::faults {

using SteadyTime = std::chrono::steady_clock::time_point;

// How a viewer subscribes.
struct ViewerOptions {
  std::uint32_t window = 1;
  FieldChoice choice = {};
};

struct Arrival {
  std::uint64_t observation = 0;  // sequence
  std::uint64_t update = 0;       // sequence
  SteadyTime at;
};

class Viewer {
 public:
  explicit Viewer(const std::string& endpoint, const ViewerOptions& options = {});
  ~Viewer();
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  // Stops reading; returns when it has stopped. False: it reads again.
  void pause(bool paused);
  // Final updates so far, in order of arrival.
  std::vector<Arrival> arrivals() const;
  std::uint64_t newest_update() const;

 private:
  void run(const std::stop_token& stop);

  client::Client client_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  bool paused_ = false;
  bool reading_ = true;
  std::vector<Arrival> arrivals_;
  std::jthread thread_;
};

// Sends the observations of a feed, one every `period`, on the caller's thread.
class PacedSource {
 public:
  PacedSource(client::Client& client, const Feed& feed) : client_(client), feed_(feed) {}

  void send_for(std::chrono::duration<double> duration, std::chrono::duration<double> period);
  // When each was handed over, by sequence.
  const std::map<std::uint64_t, SteadyTime>& sent() const { return sent_; }

 private:
  client::Client& client_;
  const Feed& feed_;
  std::size_t next_ = 0;
  std::map<std::uint64_t, SteadyTime> sent_;
};

// ms from hand-over to arrival, of the arrivals that answer what was sent in [from, until).
std::vector<double> latencies_ms(const PacedSource& source, const std::vector<Arrival>& arrivals,
                                 SteadyTime from, SteadyTime until);

}  // namespace brainshift::faults
