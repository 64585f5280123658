// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/transport/router.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <exception>
#include <utility>
#include <zmq.hpp>

#include "common/wire/convert.hpp"
#include "server/guard/zmtp_stream.hpp"
#include "server/transport/peers.hpp"
#include "server/transport/router_socket.hpp"
#include "server/transport/zap_handler.hpp"

namespace brainshift::server {
namespace {

// Requests handled before pushes get their turn.
constexpr int kRequestsPerTurn = 64;
// Requests that ask how the daemon fares and nothing else. They are answered when every place for a
// client is taken: that is when somebody asks.
bool only_looks(wire::MessageType type) {
  return type == wire::MessageType::kStatusRequest || type == wire::MessageType::kReportRequest;
}

// How often a full peer is tried again while it is owed a final update.
constexpr std::chrono::milliseconds kRetryInterval{20};
// How often the handler is told that the loop turns.
constexpr std::chrono::milliseconds kTurnInterval{100};
constexpr std::size_t kMaxParts = ZmtpStream::Bounds{}.parts;

Bytes error_frame(std::uint64_t request_id, const Error& error) {
  return framed(wire::MessageType::kErrorReply, request_id, wire::encode(error));
}

Roles roles_of(const RouterOptions& options) {
  if (!options.keys) return std::nullopt;
  return options.keys->roles;
}

}  // namespace

struct Router::Impl {
  Impl(const RouterOptions& given, Listener listener)
      : options(given),
        socket(context, options),
        monitor(context, socket.zmq()),
        gate(roles_of(given), given.limits),
        peers(static_cast<std::size_t>(given.max_clients)) {
    if (options.keys) zap.emplace(context, options.keys->names);
    GuardOptions guarding;
    guarding.max_message_bytes = max_message_bytes(options);
    guarding.held_bytes = options.held_bytes;
    guarding.max_connections = options.max_connections;
    guarding.patience = options.patience;
    guard.emplace(std::move(listener), socket.bind(), guarding);
  }

  void answer(const Incoming& incoming) {
    const auto complain = [&](const Error& error) { reply(incoming.peer, error_frame(0, error)); };
    if (incoming.parts != 1) {
      return complain({ErrorCode::kProtocol,
                       fmt::format("a message has 1 part, this one has {}", incoming.parts)});
    }
    const auto frame = wire::decode_frame(incoming.payload.to_string_view());
    if (!frame) {
      spdlog::debug("malformed frame: {}", frame.error().message);
      return complain(frame.error());
    }
    const Peer* known = peers.find(incoming.peer);
    if (known == nullptr || known->connection_fd != incoming.connection_fd) {
      if (Status entered = enter(incoming, only_looks(frame->type)); !entered) {
        return complain(entered.error());
      }
    }
    std::optional<Reply> answer;
    try {
      if (Status may = gate.admit(caller_of(incoming), *frame, std::chrono::steady_clock::now());
          !may) {
        answer = Reply{wire::MessageType::kErrorReply, wire::encode(may.error())};
      } else {
        if (frame->type == wire::MessageType::kReportRequest) turned();
        answer = handler->handle(incoming.peer, *frame);
      }
    } catch (const std::exception& exception) {
      spdlog::error("request failed type={} reason=\"{}\"", static_cast<int>(frame->type),
                    exception.what());
      const Error error{ErrorCode::kInternal, "the request failed unexpectedly"};
      answer = Reply{wire::MessageType::kErrorReply, wire::encode(error)};
    }
    if (!answer) return;
    reply(incoming.peer, framed(answer->type, frame->request_id, answer->payload));
    if (answer->subscription) subscribe(incoming.peer, *answer);
  }

  // With keys a message counts for its key, without for its connection.
  const std::string& caller_of(const Incoming& incoming) const {
    return options.keys ? incoming.user_id : incoming.peer;
  }

  // The peer of a first message that is well-formed is added; one that only looks need not find a
  // place.
  Status enter(const Incoming& incoming, bool looks) {
    const std::string& caller = caller_of(incoming);
    if (peers.find(incoming.peer) == nullptr) {
      if (Status more = gate.enter(caller, peers.connections_of(caller)); !more) return more;
    }
    Peer* peer = peers.add(incoming.peer, incoming.connection_fd);
    if (peer == nullptr) {
      if (looks) return {};
      return fail(ErrorCode::kUnavailable,
                  fmt::format("{} clients are connected already", options.max_clients));
    }
    peer->caller = caller;
    guard->served(incoming.connection_fd);
    return {};
  }

  void subscribe(const std::string& routing_id, const Reply& answer) {
    Peer* peer = peers.find(routing_id);
    if (peer == nullptr) return;  // gone: the reply found no route
    if (!peer->viewer) peer->viewer.emplace();
    const bool anew = peer->viewer->renew(*answer.subscription, answer.selection);
    if (anew && answer.session == session) {
      if (last_final) peer->viewer->owe_usable(last_final);
      if (failure_since) peer->viewer->owe_failure(failure_since);
    }
    pay(routing_id);
  }

  void reply(const std::string& routing_id, const Bytes& bytes) {
    Peer* peer = peers.find(routing_id);
    const bool behind = peer != nullptr && !peer->replies.empty();
    const Sent sent = behind ? Sent::kQueueFull : socket.send(routing_id, bytes);
    if (sent == Sent::kYes) return;
    if (sent == Sent::kPeerGone) {
      spdlog::debug("reply lost: the peer is gone");
      return remove(routing_id);
    }
    if (peer != nullptr && peer->may_wait(bytes)) {
      peer->replies.push_back(bytes);
      peer->reply_bytes += bytes->size();
    } else {
      spdlog::debug("reply lost: the peer does not read");
    }
  }

  void deliver(const Outgoing& message) {
    if (message.delivery == Delivery::kReply) return reply(message.peer, message.bytes);
    if (message.session != session) {
      forget_session();
      session = message.session;
    }
    if (message.delivery == Delivery::kFinal) {
      last_final = message.bytes;
      failure_since.reset();
    }
    if (message.delivery == Delivery::kFailure) failure_since = message.bytes;
    for (auto next = peers.all().begin(); next != peers.all().end();) {
      auto& [routing_id, peer] = *next++;  // which may be removed here
      if (!peer.viewer) continue;
      switch (message.delivery) {
        case Delivery::kReply: break;
        case Delivery::kState: reply(routing_id, message.bytes); break;
        case Delivery::kIterate: iterate(routing_id, *peer.viewer, message.bytes); break;
        case Delivery::kFinal:
          peer.viewer->owe_usable(message.bytes);
          pay(routing_id);
          break;
        case Delivery::kFailure:
          peer.viewer->owe_failure(message.bytes);
          pay(routing_id);
          break;
      }
    }
  }

  void forget_session() {
    last_final.reset();
    failure_since.reset();
    parcels.forget_session();
    for (auto& [routing_id, peer] : peers.all()) {
      if (peer.viewer) peer.viewer->owe_nothing();
    }
  }

  void iterate(const std::string& routing_id, Viewer& viewer, const Bytes& bytes) {
    if (!viewer.may_iterate()) return;
    const auto parcel = parcels.make(bytes, viewer.selection(), viewer.held());
    if (!parcel) return;
    const Sent sent = socket.send(routing_id, parcel->bytes);
    if (sent == Sent::kYes) viewer.iterate_sent();
    if (sent == Sent::kPeerGone) remove(routing_id);
  }

  void pay_owed() {
    std::vector<std::string> all;
    for (const auto& [routing_id, peer] : peers.all()) all.push_back(routing_id);
    for (const std::string& routing_id : all) pay(routing_id);
  }

  // Replies first: they tell a viewer what to make of the updates behind them.
  void pay(const std::string& routing_id) {
    Peer* peer = peers.find(routing_id);
    if (peer == nullptr) return;
    while (!peer->replies.empty()) {
      const Sent sent = socket.send(routing_id, peer->replies.front());
      if (sent == Sent::kQueueFull) return;
      if (sent == Sent::kPeerGone) return remove(routing_id);
      peer->reply_bytes -= peer->replies.front()->size();
      peer->replies.pop_front();
    }
    if (!peer->viewer) return;
    Viewer& viewer = *peer->viewer;
    while (const Bytes next = viewer.next()) {
      const auto parcel = parcels.make(next, viewer.selection(), viewer.held());
      if (!parcel) return;  // in the next turn
      const Sent sent = socket.send(routing_id, parcel->bytes);
      if (sent == Sent::kQueueFull) return;
      if (sent == Sent::kPeerGone) return remove(routing_id);
      viewer.sent(parcel->held);
    }
  }

  // The name may be the removed peer's own: it is copied first.
  void remove(const std::string& routing_id) {
    // NOLINTNEXTLINE(performance-unnecessary-copy-initialization)
    const std::string name = routing_id;
    if (peers.find(name) == nullptr) return;
    peers.remove(name);
    gate.left(name);
    handler->left(name);
  }

  void forget_closed() {
    for (const int descriptor : monitor.closed()) {
      for (const std::string& name : peers.remove_connection(descriptor)) {
        spdlog::debug("peer left");
        gate.left(name);
        handler->left(name);
      }
    }
  }

  // What libzmq refuses ends the loop; anything else costs this step.
  template <typename Function>
  static void step(const char* what, Function&& function) {
    try {
      function();
    } catch (const zmq::error_t&) {
      throw;
    } catch (const std::exception& exception) {
      spdlog::error("{} failed: {}", what, exception.what());
    }
  }

  void turned() {
    last_turn = std::chrono::steady_clock::now();
    const GuardCounts counts = guard->counts();
    const Refusals& refusals = gate.refusals();
    handler->turned(peers, {counts.accepted, counts.closed_for_breach, counts.closed_for_memory,
                            counts.closed_for_silence, counts.closed_for_room, guard->held_bytes(),
                            zap ? zap->refused() : 0, refusals.not_allowed, refusals.connections,
                            refusals.observations, refusals.session_starts});
  }

  std::chrono::milliseconds longest_wait() const {
    if (parcels.spent()) return std::chrono::milliseconds(0);
    const auto idle = options.longest_wait;
    if (!peers.anything_owed()) return idle;
    return idle.count() < 0 ? kRetryInterval : std::min(idle, kRetryInterval);
  }

  RouterOptions options;
  zmq::context_t context;
  std::optional<ZapHandler> zap;  // with keys
  RouterSocket socket;
  ConnectionMonitor monitor;
  Gate gate;
  Peers peers;
  Parcels parcels;
  // What a late subscriber of `session` gets: the last usable field, and the newest failure since.
  std::uint64_t session = 0;
  Bytes last_final, failure_since;
  RequestHandler* handler = nullptr;                     // of run()
  std::chrono::steady_clock::time_point last_turn = {};  // that the handler was told of
  std::optional<Guard> guard;                            // the last: peers go before the socket
};

Router::Router(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Router::Router(Router&&) noexcept = default;
Router& Router::operator=(Router&&) noexcept = default;
Router::~Router() = default;

const std::string& Router::endpoint() const { return impl_->guard->endpoint(); }
GuardCounts Router::guard_counts() const { return impl_->guard->counts(); }

Result<Router> Router::bind(const RouterOptions& options) {
  auto listener = Listener::open(options.endpoint);
  if (!listener) return tl::unexpected(listener.error());
  try {
    return Router(std::make_unique<Impl>(options, std::move(*listener)));
  } catch (const std::exception& error) {  // zmq::error_t, std::system_error
    return fail(ErrorCode::kUnavailable,
                fmt::format("endpoint {}: {}", options.endpoint, error.what()));
  }
}

Status Router::run(RequestHandler& handler, Outbox& outbox, int stop_fd) {
  Impl& self = *impl_;
  self.handler = &handler;
  zmq::pollitem_t items[] = {{self.socket.zmq().handle(), 0, ZMQ_POLLIN, 0},
                             {self.monitor.socket().handle(), 0, ZMQ_POLLIN, 0},
                             {nullptr, outbox.fd(), ZMQ_POLLIN, 0},
                             {nullptr, stop_fd, ZMQ_POLLIN, 0}};
  try {
    while (true) {
      if (zmq_poll(items, 4, self.longest_wait().count()) < 0) {
        if (zmq_errno() == EINTR) continue;
        throw zmq::error_t();
      }
      if (items[3].revents != 0) return {};
      self.parcels.begin_turn();
      self.forget_closed();
      for (int served = 0; items[0].revents != 0 && served < kRequestsPerTurn; ++served) {
        const auto incoming = self.socket.receive();
        if (!incoming) break;
        self.guard->delivered(incoming->connection_fd, incoming->bytes, incoming->parts);
        self.forget_closed();  // before the peer is looked up, see ConnectionMonitor
        self.step("an answer", [&] { self.answer(*incoming); });
        // With CURVE the guard cannot count the parts before.
        if (incoming->parts > kMaxParts) self.guard->close(incoming->connection_fd);
      }
      self.step("a delivery", [&] {
        for (const Outgoing& message : outbox.take()) {
          self.step("a delivery", [&] { self.deliver(message); });
        }
      });
      if (self.peers.anything_owed()) self.step("a delivery", [&] { self.pay_owed(); });
      if (std::chrono::steady_clock::now() - self.last_turn >= kTurnInterval) {
        self.step("a report", [&] { self.turned(); });
      }
    }
  } catch (const zmq::error_t& error) {
    return fail(ErrorCode::kInternal, fmt::format("endpoint {}: {}", endpoint(), error.what()));
  }
}

}  // namespace brainshift::server
