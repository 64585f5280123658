// SPDX-License-Identifier: GPL-3.0-or-later
// Peer: one OpenIGTLink client of the bridge's server. Private to client/bridge.
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

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
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
  static constexpr std::size_t kMostReadAtOnce = 4u << 20;

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
  // Writes what the socket takes. kUnavailable: the peer is gone.
  Status write();
  // Reads what has come, and hands on each message that is understood. kUnavailable: the peer is
  // gone; kProtocol: it does not talk OpenIGTLink.
  using Sink = std::function<void(igtl::Message&&)>;
  Status read(const Sink& sink);
  // Messages that were well framed, and could not be understood.
  std::uint64_t not_understood() const { return not_understood_; }

 private:
  void take_version(std::uint16_t version);
  // The next message to write; false when there is none.
  bool next_message();

  Socket socket_;
  std::string name_;
  igtl::StreamReader reader_;
  std::uint16_t version_ = 1;
  std::uint64_t replaced_ = 0;
  std::uint64_t not_understood_ = 0;

  BroadcastPtr shown_;    // the newest picture that was offered
  BroadcastPtr current_;  // being written
  std::size_t next_ = 0;  // of its messages
  BroadcastPtr waiting_picture_;
  BroadcastPtr waiting_state_;
  std::deque<std::string> replies_;

  // The message that is being written: a reply of its own, or one of current_.
  std::string reply_bytes_;
  BroadcastPtr holder_;
  std::string_view message_;
};

}  // namespace brainshift::client
