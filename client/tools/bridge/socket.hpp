// SPDX-License-Identifier: GPL-3.0-or-later
// A TCP socket that never waits, and its address. Private to client/tools/bridge, but for the
// address.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/core/error.hpp"

namespace brainshift::client {

// Where a socket listens or connects to, as it is written on a command line:
//   127.0.0.1:18945    [::1]:18945    slicer.local:18944    :18945 (this computer only)
struct Address {
  std::string host = "127.0.0.1";  // a name or a number, without brackets
  std::uint16_t port = 0;          // 0: the system chooses one

  bool operator==(const Address&) const = default;
};

// kInvalidArgument: names the option, its text and what it must be.
Result<Address> parse_address(std::string_view option, std::string_view text);
// "127.0.0.1:18945", "[::1]:18945".
std::string to_string(const Address& address);
// Only programs of this computer reach it. A name other than localhost counts as no loopback.
bool is_loopback(const Address& address);

// One thread polls the descriptors and calls read() and write() when they are ready. The send
// buffer is kept small (kSendBuffer): what lies in it can no longer be replaced by something newer.
class Socket {
 public:
  static constexpr int kSendBuffer = 512 * 1024;

  // Listens. kInvalidArgument: a host that is no address of this computer; kUnavailable: the port
  // is taken. The sentence names the address.
  static Result<Socket> listen(const Address& address);
  // Begins to connect; writable when it has connected or failed: look at connected(). kUnavailable.
  static Result<Socket> connect(const Address& address);

  explicit Socket(int descriptor) : descriptor_(descriptor) {}
  Socket(Socket&& other) noexcept;
  Socket& operator=(Socket&& other) noexcept;
  ~Socket();

  int descriptor() const { return descriptor_; }
  // The address that it is bound to; the peer's address of an accepted one.
  Address local() const;
  std::string peer_name() const;

  // The next connection that waits; none when no more do.
  std::optional<Socket> accept();
  // Of connect(), once writable. kUnavailable with the system's reason.
  Status connected() const;
  // Bytes read into the buffer: 0 when there are none now. kUnavailable: the peer has closed or the
  // connection is lost.
  Result<std::size_t> read(char* buffer, std::size_t size);
  // Bytes taken: 0 when there is no room now. kUnavailable as above.
  Result<std::size_t> write(std::string_view bytes);

 private:
  int descriptor_ = -1;
};

}  // namespace brainshift::client
