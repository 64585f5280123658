// SPDX-License-Identifier: GPL-3.0-or-later
// The bridge's connections. Private to client/bridge.
//
// Peer: one OpenIGTLink client of the bridge's server.
//
// Version: the peer gets version 1 until its first message of header version 2, and version 2 from
// then on. What is shown then is sent once more, so that the peer has its metadata.
//
// Newest only: a peer that reads slowly holds the broadcast that is being written and the newest
// one that waits; older ones are replaced, and counted. A broadcast is written to its end before
// the next begins, so that a slow peer gets all devices of it and not always the first ones. A
// blank one waits for the end of a message only.
//
// Belongs to one thread.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>

#include "client/tools/bridge/broadcast.hpp"
#include "client/tools/bridge/socket.hpp"
#include "common/core/error.hpp"
#include "common/igtl/message.hpp"
#include "common/igtl/stream_reader.hpp"

namespace brainshift::client {

class Peer {
 public:
  // Answers to requests that may wait; a peer that asks for more without reading is cut off.
  static constexpr std::size_t kMaxReplies = 16;
  // Taken with one look at the socket, so that no peer keeps the others waiting.
  static constexpr std::size_t kMaxReadAtOnce = 4u << 20;

  Peer(Socket socket, igtl::StreamLimits limits);

  int descriptor() const { return socket_.descriptor(); }
  const std::string& name() const { return name_; }
  std::uint16_t version() const { return version_; }
  std::uint64_t replaced() const { return replaced_; }

  // The newest picture, or its state alone. The state alone never takes a picture's place.
  void offer(const BroadcastPtr& broadcast);
  // An answer to this peer alone, before the next message of a broadcast. kUnavailable: too many.
  Status reply(const igtl::Envelope& envelope, const igtl::Content& content);

  bool wants_to_write() const;
  // Since when it has taken nothing of what waits for it; nothing: it has all of it.
  std::optional<std::chrono::steady_clock::time_point> unread_since() const;
  // Writes what the socket takes. kUnavailable: the peer is gone.
  Status write();
  // Reads what has come, and hands on each message that is understood. One that is not is told; an
  // image is then handed on empty, since images are counted. kUnavailable: the peer is gone;
  // kProtocol: it does not talk OpenIGTLink.
  using Sink = std::function<void(igtl::Message&&)>;
  struct Sinks {
    Sink take;
    std::function<void(const std::string& sentence)> tell;
  };
  Status read(const Sinks& sinks);

 private:
  void take_version(std::uint16_t version);
  // The next message to write; false when there is none.
  bool next_message();

  Socket socket_;
  std::string name_;
  igtl::StreamReader reader_;
  std::uint16_t version_ = 1;
  std::uint64_t replaced_ = 0;
  std::uint64_t refused_ = 0;  // messages that could not be understood

  BroadcastPtr shown_;    // the newest picture that was offered
  BroadcastPtr current_;  // being written
  std::size_t next_ = 0;  // of its messages
  BroadcastPtr waiting_picture_;
  BroadcastPtr waiting_state_;
  BroadcastPtr state_;  // the newest since `shown_`; null: none
  std::deque<std::string> replies_;

  // The message that is being written: a reply of its own, or one of current_.
  std::string reply_bytes_;
  BroadcastPtr holder_;
  std::string_view message_;
  std::chrono::steady_clock::time_point taken_;  // when it took some, or something began to wait
};

// Upstream: the bridge as an OpenIGTLink client of PlusServer or 3D Slicer.
//
// It connects, sends a STATUS of version 2, so that PlusServer answers with version 2 (it starts
// with version 1 for every client), and reads. It asks for nothing: a GET_STATUS, which has no
// content, crashes OpenIGTLink's receivers. It connects again by itself. Belongs to one thread.
class Upstream {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  // Between two attempts.
  static constexpr std::chrono::milliseconds kRetry{500};

  Upstream(Address address, igtl::StreamLimits limits);

  // -1 while there is no connection under way.
  int descriptor() const { return socket_ ? socket_->descriptor() : -1; }
  bool wants_to_write() const { return socket_ && (!connected_ || !unsent_.empty()); }

  // Begins to connect when it is time. A sentence when something is to be told.
  std::optional<std::string> tend(TimePoint now);
  // Goes on with the socket, which is ready.
  std::optional<std::string> ready(bool readable, bool writable, TimePoint now,
                                   const Peer::Sinks& sinks);

 private:
  std::optional<std::string> lost(const Error& error, TimePoint now);
  Status write();

  Address address_;
  igtl::StreamLimits limits_;
  std::optional<Socket> socket_;
  std::optional<igtl::StreamReader> reader_;
  bool connected_ = false;
  bool told_ = false;  // that there is no connection
  std::uint64_t refused_ = 0;
  std::string unsent_;
  TimePoint next_attempt_{};
};

}  // namespace brainshift::client
