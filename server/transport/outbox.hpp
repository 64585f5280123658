// SPDX-License-Identifier: GPL-3.0-or-later
// Outbox: messages on their way from the worker thread to the transport thread, with a file
// descriptor that becomes readable while something waits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <vector>

#include "server/delivery/parcels.hpp"

namespace brainshift::server {

enum class Delivery {
  kReply,    // to one peer
  kFinal,    // to every subscriber: a usable field; kept for those who come late
  kFailure,  // to every subscriber: an observation that became no estimate, or no usable one
  kIterate,  // to every subscriber; may be lost
  kState,    // to every subscriber: a SessionState
};

struct Outgoing {
  Delivery delivery = Delivery::kReply;
  std::string peer;  // routing id; kReply only
  Bytes bytes;
  std::uint64_t session = 0;  // that it belongs to; not of replies
};

// Thread-safe. Only the newest kMaxIterates iterates wait; nothing else is ever dropped here.
class Outbox {
 public:
  Outbox();  // throws std::system_error when the kernel gives no event descriptor
  ~Outbox();
  Outbox(const Outbox&) = delete;
  Outbox& operator=(const Outbox&) = delete;

  void post(Outgoing message);
  // Everything that waits, in order of posting; clears the descriptor.
  std::vector<Outgoing> take();
  int fd() const { return fd_; }

  static constexpr std::size_t kMaxIterates = 4;

 private:
  int fd_ = -1;
  std::mutex mutex_;
  std::deque<Outgoing> queue_;
  std::size_t iterates_ = 0;
};

}  // namespace brainshift::server
