// SPDX-License-Identifier: GPL-3.0-or-later
// The file of an ipc endpoint. libzmq removes whatever lies at its path and makes a socket there
// that the umask alone protects.
#pragma once

#include <sys/types.h>

#include <string>

#include "common/core/error.hpp"

namespace brainshift::server {

// Ok if binding the endpoint ends nothing: there is no file at an ipc endpoint's path, or a socket
// that nobody listens to any more, and its folder exists. Ok for every other endpoint.
// kInvalidArgument; kNotFound for the folder; kUnavailable for a daemon that runs.
Status check_ipc_path(const std::string& endpoint);

// While it lives, what this process creates is readable and writable for its own account alone,
// from the first moment. The umask belongs to the whole process: no other thread may create files
// meanwhile.
class OwnerOnly {
 public:
  OwnerOnly();
  ~OwnerOnly();
  OwnerOnly(const OwnerOnly&) = delete;
  OwnerOnly& operator=(const OwnerOnly&) = delete;

 private:
  mode_t before_;
};

}  // namespace brainshift::server
