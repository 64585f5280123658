// SPDX-License-Identifier: GPL-3.0-or-later
// InboundWorker: hands observations made of OpenIGTLink messages to the daemon. Private to
// client/bridge.
//
// Messages wait in a queue of limited size; the oldest gives way, and is counted. A thread of
// its own takes them, makes observations (Inbox), and submits them over a connection of its own, so
// that neither tracing nor a slow daemon holds up what is sent to OpenIGTLink clients.
//
// What comes in is of one patient: of `case_id`, and of the first model of it that the daemon
// serves. Nothing is submitted to another one, after a restart of the daemon for instance.
//
// Sequence numbers begin at the milliseconds since 1970, so that they count on when the bridge is
// started again within a session. Times are of this computer's monotonic clock.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>

#include "client/lib/client.hpp"
#include "client/tools/bridge/follower.hpp"
#include "client/tools/bridge/inbox.hpp"

namespace brainshift::client {

// The observation that is submitted. kInvalidArgument: a tumour boundary more than 100 mm from the
// tumour, as `brainshift import` refuses it. Pure, but for the clock.
Result<Observation> observation_of(const Found& found, const Followed& followed,
                                   std::uint64_t sequence);

class InboundWorker {
 public:
  static constexpr std::size_t kMaxQueuedBytes = std::size_t{256} << 20;

  InboundWorker(Inbox inbox, std::string endpoint, std::optional<ClientKeys> keys,
                std::function<void(const std::string&)> tell, std::string case_id = {});

  // Any thread.
  void post(igtl::Message&& message);
  void follow(const Followed& followed);
  // Until it is told to stop.
  void run(const std::stop_token& stop);

 private:
  struct Item {
    igtl::Message message;
    Inbox::TimePoint arrived;
    std::size_t bytes = 0;
  };
  void deal_with(const Taken& taken, const std::stop_token& stop);
  Status submit(const Found& found, const std::stop_token& stop);
  std::uint64_t next_sequence(const std::string& source);

  Inbox inbox_;
  std::string endpoint_;
  std::optional<ClientKeys> keys_;
  std::function<void(const std::string&)> tell_;
  std::optional<Client> client_;
  std::map<std::string, std::uint64_t> sequences_;
  const std::chrono::steady_clock::time_point begun_ = std::chrono::steady_clock::now();

  std::mutex mutex_;  // of all below
  std::condition_variable_any news_;
  std::deque<Item> queue_;
  std::size_t queued_bytes_ = 0;
  std::uint64_t dropped_ = 0;
  int lost_images_ = 0;  // of these
  Followed followed_;
  std::string pinned_case_, pinned_model_;  // empty: none yet
};

}  // namespace brainshift::client
