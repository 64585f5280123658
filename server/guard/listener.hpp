// SPDX-License-Identifier: GPL-3.0-or-later
// Listener: a listening socket at an endpoint as ZeroMQ writes it, tcp://HOST:PORT or ipc://PATH.
// HOST is an address, a name, an interface of this machine, or *; PORT may be *.
#pragma once

#include <string>

#include "common/core/error.hpp"

namespace brainshift::server {

class Listener {
 public:
  // kInvalidArgument for a text that is no such endpoint; kUnavailable when it cannot be bound. The
  // sentence names the endpoint. A file at an ipc path is replaced (check_ipc_path comes first).
  static Result<Listener> open(const std::string& endpoint);
  Listener(Listener&& other) noexcept;
  Listener& operator=(Listener&&) = delete;
  ~Listener();  // closes it, and removes the socket of an ipc path

  int fd() const { return fd_; }
  // With the port that was taken.
  const std::string& endpoint() const { return endpoint_; }

 private:
  Listener(int fd, std::string endpoint) : fd_(fd), endpoint_(std::move(endpoint)) {}
  static Result<Listener> open_tcp(const std::string& endpoint);
  static Result<Listener> open_ipc(const std::string& endpoint);

  int fd_;
  std::string endpoint_;
};

}  // namespace brainshift::server
