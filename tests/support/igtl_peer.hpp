// SPDX-License-Identifier: GPL-3.0-or-later
// The other side of an OpenIGTLink connection, for tests: a plain socket on the loopback interface
// that waits for what it is asked for, with a limit.
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "common/igtl/message.hpp"
#include "common/igtl/stream_reader.hpp"

namespace brainshift::test_support {

// A message with the header version that its header had.
struct Received {
  igtl::Header header;
  igtl::Message message;
};

class IgtlPeer {
 public:
  static constexpr std::chrono::milliseconds kLimit{10000};

  explicit IgtlPeer(int descriptor) : descriptor_(descriptor) {}
  // Connects to 127.0.0.1. receive_buffer: of the system, bytes; 0: as it likes.
  static IgtlPeer connect(std::uint16_t port, int receive_buffer = 0) {
    IgtlPeer peer(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    if (receive_buffer > 0) {
      ::setsockopt(peer.descriptor_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    }
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(peer.descriptor_, reinterpret_cast<sockaddr*>(&address), sizeof address),
              0);
    return peer;
  }
  IgtlPeer(IgtlPeer&& other) noexcept
      : descriptor_(std::exchange(other.descriptor_, -1)),
        reader_(std::move(other.reader_)),
        unread_(std::move(other.unread_)) {}
  IgtlPeer& operator=(IgtlPeer&&) = delete;
  ~IgtlPeer() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }

  void send(const igtl::Envelope& envelope, const igtl::Content& content) {
    std::string bytes;
    const auto encoded = igtl::encode(envelope, content, bytes);
    ASSERT_TRUE(encoded) << encoded.error().message;
    send(bytes);
  }
  void send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t sent = ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent <= 0) return;  // the other side has closed: receive() will tell
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    }
  }

  // The next message; nothing when the limit is over or the other side has closed.
  std::optional<Received> receive(std::chrono::milliseconds limit = kLimit) {
    const auto deadline = std::chrono::steady_clock::now() + limit;
    while (true) {
      std::string_view bytes = unread_;
      const auto packet = reader_.read(bytes);
      unread_.erase(0, unread_.size() - bytes.size());
      if (!packet) {
        ADD_FAILURE() << packet.error().message;
        return std::nullopt;
      }
      if (*packet) {
        auto message = igtl::decode((*packet)->header, (*packet)->body);
        if (!message) {
          ADD_FAILURE() << message.error().message;
          return std::nullopt;
        }
        return Received{(*packet)->header, std::move(*message)};
      }
      if (!read_more(deadline)) return std::nullopt;
    }
  }
  // The next message of this device; messages of others are dropped.
  std::optional<Received> receive_from(std::string_view device,
                                       std::chrono::milliseconds limit = kLimit) {
    const auto deadline = std::chrono::steady_clock::now() + limit;
    while (true) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
          deadline - std::chrono::steady_clock::now());
      auto received = receive(std::max(left, std::chrono::milliseconds(0)));
      if (!received || received->message.envelope.device == device) return received;
    }
  }

 private:
  bool read_more(std::chrono::steady_clock::time_point deadline) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
        deadline - std::chrono::steady_clock::now());
    pollfd polled{descriptor_, POLLIN, 0};
    if (left.count() <= 0 || ::poll(&polled, 1, static_cast<int>(left.count())) <= 0) return false;
    std::array<char, 64 * 1024> buffer;
    const ssize_t count = ::recv(descriptor_, buffer.data(), buffer.size(), 0);
    if (count <= 0) return false;
    unread_.append(buffer.data(), static_cast<std::size_t>(count));
    return true;
  }

  int descriptor_ = -1;
  igtl::StreamReader reader_;
  std::string unread_;
};

// Listens on a port of 127.0.0.1 that the system chooses, and accepts.
class IgtlListener {
 public:
  IgtlListener() : descriptor_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::bind(descriptor_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(::listen(descriptor_, 1), 0);
  }
  ~IgtlListener() { ::close(descriptor_); }
  IgtlListener(const IgtlListener&) = delete;
  IgtlListener& operator=(const IgtlListener&) = delete;

  std::uint16_t port() const {
    sockaddr_in address{};
    socklen_t size = sizeof address;
    ::getsockname(descriptor_, reinterpret_cast<sockaddr*>(&address), &size);
    return ntohs(address.sin_port);
  }
  // Waits for a connection.
  IgtlPeer accept() {
    pollfd polled{descriptor_, POLLIN, 0};
    EXPECT_EQ(::poll(&polled, 1, 10000), 1) << "nobody connects";
    return IgtlPeer(::accept4(descriptor_, nullptr, nullptr, SOCK_CLOEXEC));
  }

 private:
  int descriptor_;
};

}  // namespace brainshift::test_support
