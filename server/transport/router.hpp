// SPDX-License-Identifier: GPL-3.0-or-later
// Router: the daemon's socket. One thread polls a ZeroMQ ROUTER socket, the outbox and a stop
// descriptor; it decodes frames, asks the handler, sends replies and pushes updates. It never waits
// for a peer.
//
// Peers may be hostile or broken: message size, number of parts and number of peers are capped; a
// frame that does not decode gets an ErrorReply (kProtocol) and takes nobody's place; half-open
// peers fall to heartbeats and unfinished handshakes to a short limit.
//
// A subscriber grants credit: the daemon sends at most `window` updates ahead of those that it says
// it has received, so that no queue on the way can age a picture. What does not fit is replaced by
// what is newer: it is owed the newest usable field and the newest failure since, and nothing else.
// That is also what a late subscriber receives. Nothing of a session is kept once the next one has
// begun, and nobody gets a field of a session that has ended. One that chose a part of every field
// gets it cut from these bytes when they are about to be sent (Parcels); a turn of the loop cuts a
// bounded number, so that neither choices nor viewers that do not read delay anybody.
//
// Requests that only look (status, report) are answered without a place too: a daemon whose places
// are all taken still says that it lives.
//
// Peers do not reach libzmq's socket: the guard passes their bytes on to it, and bounds what they
// make it keep (server/guard/guard.hpp). With keys libzmq asks the ZAP handler whom to admit, and
// the gate asks every request whether its key may (server/security).
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/core/error.hpp"
#include "common/values/session_state.hpp"
#include "common/wire/frame.hpp"
#include "common/wire/report.hpp"
#include "server/guard/guard.hpp"
#include "server/transport/outbox.hpp"
#include "server/transport/router_options.hpp"

namespace brainshift::server {

class Peers;

struct Reply {
  wire::MessageType type = wire::MessageType::kErrorReply;
  std::string payload;
  std::optional<Subscription> subscription = std::nullopt;  // the peer's, from now on
  // With a subscription: the running session, whose last usable update the peer gets first.
  std::uint64_t session = 0;
  SelectionPtr selection = nullptr;  // with a subscription: its choice on the loaded model
};

// Answers requests; called on the router's thread and must not block.
class RequestHandler {
 public:
  virtual ~RequestHandler() = default;
  // No value: the reply follows through the outbox.
  virtual std::optional<Reply> handle(const std::string& peer, const wire::Frame& frame) = 0;
  // The peer's connection has closed. Peers that come back have another name.
  virtual void left(const std::string& peer) = 0;
  // How peers and door stand: before every ReportRequest, and while the router's loop turns, at
  // most every 100 ms.
  virtual void turned(const Peers&, const wire::DoorFigures&) {}
};

class Router {
 public:
  // kInvalidArgument for a text that is not an endpoint, kUnavailable when it cannot be bound (in
  // use, no such interface, no permission). The sentence names the endpoint.
  static Result<Router> bind(const RouterOptions& options);
  Router(Router&&) noexcept;
  Router& operator=(Router&&) noexcept;
  ~Router();

  // Where it listens; the actual port when the options asked for any.
  const std::string& endpoint() const;
  GuardCounts guard_counts() const;

  // Serves until `stop_fd` is readable.
  Status run(RequestHandler& handler, Outbox& outbox, int stop_fd);

 private:
  struct Impl;
  explicit Router(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace brainshift::server
