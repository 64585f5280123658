// SPDX-License-Identifier: GPL-3.0-or-later
// ZmtpStream: what a peer sends, followed frame by frame without being kept (ZMTP 3, ZeroMQ RFC
// 23).
//
//   greeting   64 bytes: signature, version, mechanism
//   frame      1 byte of flags (1 more parts follow, 2 long, 4 command), size in 1 or 8 bytes, body
//
// libzmq keeps a message of many parts until its last part has come, however many there are: an
// empty part takes 2 bytes on the wire and 64 in its memory. So this refuses a message of too many
// parts or bytes before libzmq sees the end of it, and says what every frame will cost.
//
// With CURVE the flag for more parts is encrypted: every part looks like a message of its own. Its
// cost is bounded by who counts what was delivered (guard.hpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace brainshift::server {

class ZmtpStream {
 public:
  struct Bounds {
    std::size_t message_bytes = 16u << 20;  // of all parts of a message
    std::size_t parts = 1024;               // of a message
    std::size_t command_bytes = 64u << 10;
  };
  // What libzmq keeps for a part beside its bytes.
  static constexpr std::size_t kPartCost = 96;

  explicit ZmtpStream(const Bounds& bounds) : bounds_(bounds) {}

  // Takes the next bytes in. A sentence when the peer breaks ZMTP or a bound, else empty; nothing
  // may be taken in after a sentence.
  std::string take(std::span<const std::uint8_t> bytes);

  // What libzmq may hold of what has come: bytes of data frames as far as they have come, with
  // their headers, and kPartCost for each. Grows only.
  std::uint64_t cost() const { return cost_; }
  // Messages that have come whole; with CURVE every part counts as one. Grows only.
  std::uint64_t messages() const { return messages_; }
  // The mechanism is CURVE; known once the greeting has come.
  bool encrypted() const { return encrypted_; }
  // The routing id that the peer chose for itself, as far as it shows: empty with CURVE, and before
  // the handshake.
  const std::string& routing_id() const { return routing_id_; }

 private:
  enum class Stage { kGreeting, kFlags, kShortSize, kLongSize, kBody };

  std::string greeting(std::uint8_t byte);
  std::string flags(std::uint8_t byte);
  std::string size_complete();
  void body_complete();
  void keep_command(std::span<const std::uint8_t> bytes);

  static constexpr std::size_t kGreetingBytes = 64;

  Bounds bounds_;
  Stage stage_ = Stage::kGreeting;
  std::size_t position_ = 0;  // in the greeting, or in the size
  std::uint8_t flags_ = 0;
  std::uint64_t size_ = 0;  // of the frame; then what is missing of its body
  std::size_t parts_ = 0;   // of the message under way
  std::uint64_t message_bytes_ = 0;
  std::uint64_t cost_ = 0;
  std::uint64_t messages_ = 0;
  std::string mechanism_;
  bool encrypted_ = false;
  std::string command_;  // the first one
  bool first_command_ = true;
  std::string routing_id_;
};

}  // namespace brainshift::server
