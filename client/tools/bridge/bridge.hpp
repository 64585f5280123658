// SPDX-License-Identifier: GPL-3.0-or-later
// `brainshift bridge`: a running brainshiftd for OpenIGTLink programs such as 3D Slicer, and
// images, transforms and models of PlusServer or 3D Slicer for brainshiftd (docs/bridge.md).
//
//   brainshiftd -> Follower -> Picture -> Hub -> OpenIGTLink clients
//   PlusServer, Slicer -> Hub -> InboundWorker (Inbox) -> Observation -> brainshiftd
//
// Three threads: the sockets (Hub; the caller of run()), the daemon's updates (Follower), and what
// comes in (InboundWorker).
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "client/lib/client_keys.hpp"
#include "client/tools/bridge/field_stream.hpp"
#include "client/tools/bridge/inbox.hpp"
#include "client/tools/bridge/socket.hpp"
#include "common/core/error.hpp"

namespace brainshift::client {

struct BridgeOptions {
  std::string endpoint = "tcp://127.0.0.1:5555";
  std::optional<ClientKeys> keys = std::nullopt;
  Address listen{"127.0.0.1", 18945};
  StreamOptions stream;
  std::optional<Address> from;
  InboxOptions inbox;
  std::string case_id = {};  // that what comes in belongs to; empty: the first that is followed
  bool json = false;
};

// kInvalidArgument names the option; options that exclude each other.
Status validate(const BridgeOptions& options);

class Bridge {
 public:
  using Tell = std::function<void(const std::string&)>;  // a line; from any thread

  // Listens, and reads the files of the options. Does not wait for the daemon.
  static Result<std::unique_ptr<Bridge>> open(const BridgeOptions& options, Tell tell);
  ~Bridge();
  Bridge(const Bridge&) = delete;
  Bridge& operator=(const Bridge&) = delete;

  Address address() const;
  // Until stop(). An error when the options can never be met.
  Status run();
  // Any thread: run() sends its clients a blank picture and returns.
  void stop();
  int stop_fd() const;  // an event descriptor; what is written to it does the same

 private:
  struct Impl;
  explicit Bridge(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace brainshift::client
