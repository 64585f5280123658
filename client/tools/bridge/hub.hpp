// SPDX-License-Identifier: GPL-3.0-or-later
// Hub: the OpenIGTLink sockets of the bridge, in one thread: the server with its clients, and the
// connection to PlusServer or 3D Slicer.
//
// post() hands over pictures from any thread. run() serves until it is told to stop; then it sends
// every client a blank picture first.
//
// The follower posts once a second. When it has not for `silence`, the hub blanks by itself.
//
// Messages without a time that came while this process stood still (SIGSTOP) are of nobody knows
// when: they are dropped with a note.
//
// Requests: GET_STATUS is answered with the newest STATUS and its age by now, GET_CAPABIL with the
// types that are sent. Other messages go to the sink, in the hub's thread; types that nobody wants
// are read and dropped.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "client/tools/bridge/peer.hpp"
#include "common/core/error.hpp"
#include "common/core/stopwatch.hpp"

namespace brainshift::client {

struct HubOptions {
  Address listen{"127.0.0.1", 18945};
  std::optional<Address> from;
  // Each may hold two pictures. A further client takes the place of the one that has not read what
  // waits for it for the longest, `unread` at least; else it is turned away.
  std::size_t max_peers = 16;
  std::chrono::milliseconds unread{5000};
  // What is kept of the messages of own clients, and of `from`.
  igtl::StreamLimits from_peers;
  igtl::StreamLimits from_upstream;
  // Of the follower, which posts once a second.
  std::chrono::milliseconds silence{3000};
};

class Hub {
 public:
  using Tell = std::function<void(const std::string&)>;  // a sentence for people
  using Sink = Peer::Sink;
  static constexpr std::chrono::milliseconds kStandstill{1000};

  // Listens. Errors of Socket::listen.
  static Result<std::unique_ptr<Hub>> open(const HubOptions& options, Tell tell, Sink sink);
  ~Hub();
  Hub(const Hub&) = delete;
  Hub& operator=(const Hub&) = delete;

  Address address() const { return listener_.local(); }

  // Any thread. The newest picture replaces one that was not taken over yet.
  void post(PicturePtr picture, Broadcast::Part part);
  // Any thread; of the moment.
  int peers() const { return peer_count_; }
  std::uint64_t replaced() const { return replaced_; }

  // Serves until stop_descriptor is readable; then sends a blank picture, waits for it to be taken
  // for a second at most, and returns.
  Status run(int stop_descriptor);

 private:
  Hub(Socket listener, const HubOptions& options, Tell tell, Sink sink);
  struct Pending {
    PicturePtr whole;
    PicturePtr state;
    BootClock::time_point posted;  // the newest of the two
  };
  void wake();
  void take_posts();
  void offer(PicturePtr picture, Broadcast::Part part);
  void accept_peers();
  void make_room();
  void drop(std::unique_ptr<Peer>& peer, const std::string& why);
  void serve_peers(const std::vector<short>& events);
  Status answer(Peer& peer, igtl::Message&& message);
  void say_goodbye();
  // What is known of the follower's word by now.
  ShownState state_now() const;
  void blank_in_silence();
  void watch_standstill(bool anything_came);
  void hand_on(igtl::Message&& message);

  HubOptions options_;
  Tell tell_;
  Sink sink_;
  Socket listener_;
  int wake_descriptor_ = -1;
  std::vector<std::unique_ptr<Peer>> peers_;
  std::optional<Upstream> upstream_;
  std::uint32_t message_id_ = 0;
  BroadcastPtr newest_picture_;
  BroadcastPtr newest_state_broadcast_;  // since the picture; null: none
  PicturePtr newest_state_;
  BootClock::time_point heard_ = BootClock::now();   // of the follower
  BootClock::time_point turned_ = BootClock::now();  // the loop
  bool stood_still_ = false;
  BroadcastPtr hidden_;  // what a blank picture of the hub's own stands for
  std::atomic<int> peer_count_{0};
  std::atomic<std::uint64_t> replaced_{0};
  std::uint64_t replaced_of_gone_ = 0;

  std::mutex mutex_;
  Pending pending_;  // behind the mutex
};

}  // namespace brainshift::client
