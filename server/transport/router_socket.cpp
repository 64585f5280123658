// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/transport/router_socket.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <random>
#include <utility>

#include "common/wire/frame.hpp"
#include "server/transport/uninterrupted.hpp"

namespace brainshift::server {
namespace {

// No limit to what a peer has unread here: libzmq would stop reading it, and abort the process when
// the peer closes then. The guard bounds messages and bytes instead (server/guard/guard.hpp).
constexpr int kReceiveQueue = 0;
// What CURVE adds to a message.
constexpr std::size_t kEncryption = 64;

int milliseconds(std::chrono::milliseconds duration) { return static_cast<int>(duration.count()); }

void use_keys(zmq::socket_t& socket, const ServerKeys& keys) {
  socket.set(zmq::sockopt::curve_server, true);
  socket.set(zmq::sockopt::curve_secretkey, keys.secret_key);
  socket.set(zmq::sockopt::zap_domain, std::string("brainshiftd"));
}

// The socket drops its reference after sending.
zmq::message_t share(const Bytes& bytes) {
  auto* reference = new Bytes(bytes);
  auto release = [](void*, void* hint) { delete static_cast<Bytes*>(hint); };
  return {const_cast<char*>(bytes->data()), bytes->size(), release, reference};
}

}  // namespace

std::size_t max_message_bytes(const RouterOptions& options) {
  return (static_cast<std::size_t>(options.max_message_mib) << 20) + wire::kHeaderBytes;
}

RouterSocket::RouterSocket(zmq::context_t& context, const RouterOptions& options)
    : socket_(context, zmq::socket_type::router) {
  socket_.set(zmq::sockopt::router_mandatory, true);
  const pid_t own = getpid();
  if (zmq_setsockopt(socket_.handle(), ZMQ_IPC_FILTER_PID, &own, sizeof own) != 0) {
    throw zmq::error_t();
  }
  socket_.set(zmq::sockopt::linger, 0);
  socket_.set(zmq::sockopt::maxmsgsize,
              static_cast<std::int64_t>(max_message_bytes(options) + kEncryption));
  socket_.set(zmq::sockopt::rcvhwm, kReceiveQueue);
  socket_.set(zmq::sockopt::sndhwm, options.send_queue);
  socket_.set(zmq::sockopt::handshake_ivl, milliseconds(options.handshake_limit));
  socket_.set(zmq::sockopt::heartbeat_ivl, milliseconds(options.heartbeat_interval));
  socket_.set(zmq::sockopt::heartbeat_timeout, milliseconds(options.heartbeat_timeout));
  socket_.set(zmq::sockopt::heartbeat_ttl, milliseconds(options.heartbeat_timeout));
  if (options.keys) use_keys(socket_, *options.keys);
}

std::string RouterSocket::bind() {
  std::random_device entropy;
  std::string name = fmt::format("brainshiftd-{}-{:08x}{:08x}", getpid(), entropy(), entropy());
  socket_.bind("ipc://@" + name);
  return name;
}

std::optional<Incoming> RouterSocket::receive() {
  zmq::message_t routing_id;
  const auto any =
      uninterrupted([&] { return socket_.recv(routing_id, zmq::recv_flags::dontwait); });
  if (!any) return std::nullopt;
  Incoming incoming;
  incoming.peer = routing_id.to_string();
  bool more = routing_id.more();
  while (more) {
    zmq::message_t part;
    // The rest of a message is always there.
    static_cast<void>(uninterrupted([&] { return socket_.recv(part); }));
    more = part.more();
    incoming.bytes += part.size();
    if (incoming.parts++ == 0) {
      incoming.connection_fd = zmq_msg_get(part.handle(), ZMQ_SRCFD);
      if (const char* user = zmq_msg_gets(part.handle(), "User-Id")) incoming.user_id = user;
      incoming.payload = std::move(part);
    }
  }
  return incoming;
}

Sent RouterSocket::send(const std::string& peer, const Bytes& bytes) {
  constexpr auto kNow = zmq::send_flags::dontwait;
  const auto begin = [&] {
    const auto part = [&] {
      return socket_.send(zmq::buffer(peer), kNow | zmq::send_flags::sndmore);
    };
    return uninterrupted(part).has_value();
  };
  try {
    if (!begin()) {
      // libzmq takes note only now and then of what a peer has read; asked for its events, it does.
      static_cast<void>(uninterrupted([&] { return socket_.get(zmq::sockopt::events); }));
      if (!begin()) return Sent::kQueueFull;
    }
    zmq::message_t shared = share(bytes);  // stays whole where a call gives up
    const auto rest = uninterrupted([&] { return socket_.send(shared, kNow); });
    return rest ? Sent::kYes : Sent::kQueueFull;
  } catch (const zmq::error_t& error) {
    if (error.num() == EHOSTUNREACH) return Sent::kPeerGone;
    throw;
  }
}

ConnectionMonitor::ConnectionMonitor(zmq::context_t& context, zmq::socket_t& watched)
    : watched_(watched), receiver_(context, zmq::socket_type::pair) {
  constexpr const char* kAddress = "inproc://brainshiftd-connections";
  if (zmq_socket_monitor(watched.handle(), kAddress, ZMQ_EVENT_DISCONNECTED) != 0) {
    throw zmq::error_t();
  }
  receiver_.set(zmq::sockopt::linger, 0);
  receiver_.connect(kAddress);
}

std::vector<int> ConnectionMonitor::closed() {
  std::vector<int> descriptors;
  zmq::message_t event;
  const auto receive = [&](zmq::message_t& part) {
    return uninterrupted([&] { return receiver_.recv(part, zmq::recv_flags::dontwait); });
  };
  while (receive(event)) {
    // An event is 16 bits of number and 32 bits of value, followed by a frame with the address.
    if (event.size() == sizeof(std::uint16_t) + sizeof(std::int32_t)) {
      std::int32_t descriptor = -1;
      std::memcpy(&descriptor, event.data<char>() + sizeof(std::uint16_t), sizeof descriptor);
      descriptors.push_back(descriptor);
    }
    zmq::message_t address;
    static_cast<void>(receive(address));
  }
  return descriptors;
}

}  // namespace brainshift::server
