// SPDX-License-Identifier: GPL-3.0-or-later
// A TCP connection to a daemon, and as much of ZeroMQ's protocol (ZMTP 3.0) as a broken or hostile
// peer needs: libzmq itself sends no half of a message.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace brainshift::test_support {

// "tcp://127.0.0.1:5555" -> 5555; throws std::runtime_error for anything else.
std::uint16_t port_of(const std::string& endpoint);

class ZmtpPeer {
 public:
  // Connects; connected() tells whether that went well. Does not wait for the daemon's bytes.
  explicit ZmtpPeer(std::uint16_t port);
  ~ZmtpPeer();
  ZmtpPeer(ZmtpPeer&& other) noexcept;
  ZmtpPeer& operator=(ZmtpPeer&& other) noexcept;

  bool connected() const { return fd_ >= 0; }
  // Greets as a DEALER without security, until the daemon has done the same.
  bool shake_hands();
  // Says the same without waiting for the daemon, which may have no room for it yet.
  bool greet();
  // One part of a message; `more`: another part is announced.
  bool send_part(std::string_view body, bool more);
  // The head of a part that claims this size; no body follows.
  bool claim_part(std::uint64_t size);
  // False when the connection is lost or takes nothing for 5 s.
  bool send_bytes(std::string_view bytes);
  // Reads what comes until the daemon closes; false after 10 s.
  bool sees_the_end() const;

 private:
  bool receive_bytes(std::size_t count);

  int fd_ = -1;
};

}  // namespace brainshift::test_support
