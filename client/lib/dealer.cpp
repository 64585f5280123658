// SPDX-License-Identifier: Apache-2.0
#include "client/lib/dealer.hpp"

#include <zmq.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "common/wire/frame.hpp"

namespace brainshift::client {
namespace {

constexpr const char* kMonitorAddress = "inproc://connection";  // per context, and so per Dealer
// Updates waiting in the socket: 64 of 2 MiB. The daemon decides what a slow reader misses.
constexpr int kReceiveHighWaterMark = 64;
constexpr int kSendHighWaterMark = 16;
constexpr int kReconnectMs = 50;
constexpr int kReconnectMaxMs = 1000;
constexpr int kHandshakeMs = 5000;
constexpr int kMissedHeartbeats = 3;
constexpr std::size_t kKeyCharacters = 40;
constexpr int kHandshakeFailed = ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL |
                                 ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL |
                                 ZMQ_EVENT_HANDSHAKE_FAILED_AUTH;

long remaining_ms(Deadline deadline) {
  const auto left =
      std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
  return std::max<long>(0, static_cast<long>(left.count()));
}

bool set_option(void* socket, int option, int value) {
  return zmq_setsockopt(socket, option, &value, sizeof value) == 0;
}

bool set_options(void* socket, int heartbeat_ms) {
  const std::array<std::pair<int, int>, 10> options = {{
      {ZMQ_LINGER, 0},
      {ZMQ_IMMEDIATE, 1},
      {ZMQ_HEARTBEAT_IVL, heartbeat_ms},
      {ZMQ_HEARTBEAT_TIMEOUT, kMissedHeartbeats * heartbeat_ms},
      {ZMQ_HANDSHAKE_IVL, kHandshakeMs},
      {ZMQ_RECONNECT_IVL, kReconnectMs},
      {ZMQ_RECONNECT_IVL_MAX, kReconnectMaxMs},
      {ZMQ_RCVHWM, kReceiveHighWaterMark},
      {ZMQ_SNDHWM, kSendHighWaterMark},
      {ZMQ_RCVTIMEO, 0},
  }};
  const bool set = std::all_of(options.begin(), options.end(), [&](const auto& option) {
    return set_option(socket, option.first, option.second);
  });
  const auto max_bytes = static_cast<std::int64_t>(wire::kHeaderBytes + wire::kMaxPayloadBytes);
  return set && zmq_setsockopt(socket, ZMQ_MAXMSGSIZE, &max_bytes, sizeof max_bytes) == 0;
}

// A zmq_msg_t that closes itself.
class Message {
 public:
  Message() { zmq_msg_init(&message_); }
  Message(const Message&) = delete;
  Message& operator=(const Message&) = delete;
  ~Message() { zmq_msg_close(&message_); }

  // A signal is no failure.
  bool receive(void* socket) {
    int size = -1;
    do {
      size = zmq_msg_recv(&message_, socket, ZMQ_DONTWAIT);
    } while (size < 0 && errno == EINTR);
    return size >= 0;
  }
  bool more() const { return zmq_msg_more(&message_) != 0; }
  std::string bytes() {
    return {static_cast<const char*>(zmq_msg_data(&message_)), zmq_msg_size(&message_)};
  }

 private:
  zmq_msg_t message_;
};

// Discards what follows a message's first part.
void drain_parts(void* socket) {
  Message part;
  while (part.receive(socket) && part.more()) {
  }
}

}  // namespace

Result<std::unique_ptr<Dealer>> Dealer::connect(const std::string& endpoint,
                                                std::chrono::milliseconds heartbeat_interval,
                                                const std::optional<ClientKeys>& keys) {
  std::unique_ptr<Dealer> dealer(new Dealer());
  Dealer& self = *dealer;
  self.endpoint_ = endpoint;
  self.context_ = zmq_ctx_new();
  if (self.context_ != nullptr) self.socket_ = zmq_socket(self.context_, ZMQ_DEALER);
  if (self.socket_ == nullptr ||
      !set_options(self.socket_, static_cast<int>(heartbeat_interval.count()))) {
    return fail(ErrorCode::kInternal, endpoint + ": cannot open a socket: " + zmq_strerror(errno));
  }
  Status ready = keys ? self.set_keys(*keys) : Status();
  if (ready) ready = self.open_monitor();
  if (!ready) return tl::unexpected(ready.error());
  if (zmq_connect(self.socket_, endpoint.c_str()) != 0) {
    return invalid("endpoint " + endpoint + ": " + zmq_strerror(errno) +
                   " (e.g. tcp://127.0.0.1:5555)");
  }
  return dealer;
}

Status Dealer::set_keys(const ClientKeys& keys) {
  const std::pair<int, std::pair<const char*, const std::string*>> options[] = {
      {ZMQ_CURVE_SERVERKEY, {"keys.server_public_key", &keys.server_public_key}},
      {ZMQ_CURVE_PUBLICKEY, {"keys.public_key", &keys.public_key}},
      {ZMQ_CURVE_SECRETKEY, {"keys.secret_key", &keys.secret_key}}};
  for (const auto& [option, named] : options) {
    const auto& [name, key] = named;
    // ZeroMQ takes 40 characters with the zero behind them.
    if (key->size() != kKeyCharacters ||
        zmq_setsockopt(socket_, option, key->c_str(), kKeyCharacters + 1) != 0) {
      return invalid(std::string(name) + ": must be a key of 40 characters in Z85");
    }
  }
  keys_ = true;
  return {};
}

// Which of the two ends has the wrong key shows only in part: a daemon does not say why it hangs up
// on a stranger.
std::string Dealer::no_daemon() const {
  std::string sentence = "no daemon at " + endpoint_;
  if (handshake_failure_ == ZMQ_EVENT_HANDSHAKE_FAILED_AUTH) {
    return "the daemon at " + endpoint_ +
           " does not admit this client's key: is it in its allow-list?";
  }
  if (handshake_failure_ != 0 && keys_) {
    return sentence + " that accepts these keys: its own key may be another one, or it uses none";
  }
  if (handshake_failure_ != 0) return sentence + " that talks without keys: it may ask for keys";
  if (keys_) sentence += ", or its key is not the one that was given";
  return sentence;
}

Status Dealer::open_monitor() {
  monitor_ = zmq_socket(context_, ZMQ_PAIR);
  if (monitor_ == nullptr || !set_option(monitor_, ZMQ_LINGER, 0) ||
      zmq_socket_monitor(
          socket_, kMonitorAddress,
          ZMQ_EVENT_DISCONNECTED | ZMQ_EVENT_HANDSHAKE_SUCCEEDED | kHandshakeFailed) != 0 ||
      zmq_connect(monitor_, kMonitorAddress) != 0) {
    return fail(ErrorCode::kInternal,
                endpoint_ + ": cannot watch the connection: " + zmq_strerror(errno));
  }
  return {};
}

Dealer::~Dealer() {
  if (socket_ != nullptr) zmq_close(socket_);
  if (monitor_ != nullptr) zmq_close(monitor_);
  if (context_ != nullptr) zmq_ctx_term(context_);
}

bool Dealer::read_monitor() {
  bool lost = false;
  Message event;
  while (event.receive(monitor_)) {
    // First part: the event's number in 16 bits, then its value; second part: the endpoint.
    if (!event.more()) continue;
    const std::string bytes = event.bytes();
    std::uint16_t number = 0;
    if (bytes.size() >= sizeof number) std::memcpy(&number, bytes.data(), sizeof number);
    if ((number & kHandshakeFailed) != 0) handshake_failure_ = number;
    if (number == ZMQ_EVENT_HANDSHAKE_SUCCEEDED) handshake_failure_ = 0;
    connected_ = number == ZMQ_EVENT_HANDSHAKE_SUCCEEDED;
    if (number != ZMQ_EVENT_DISCONNECTED) continue;
    lost = true;
    ++losses_;
  }
  return lost;
}

Status Dealer::send(std::string_view message, Deadline deadline) {
  do {
    // The monitor reports a loss before the socket has dropped the pipe of the lost connection, and
    // a message into that pipe would vanish. So a message waits for the next handshake. A loss that
    // the monitor has not reported yet ends receive().
    (void)read_monitor();
    zmq_pollitem_t ready{connected_ ? socket_ : monitor_, 0,
                         static_cast<short>(connected_ ? ZMQ_POLLOUT : ZMQ_POLLIN), 0};
    zmq_poll(&ready, 1, remaining_ms(deadline));
    if (!connected_) continue;
    if (zmq_send(socket_, message.data(), message.size(), ZMQ_DONTWAIT) >= 0) return {};
    if (errno != EAGAIN && errno != EINTR) {
      return fail(ErrorCode::kUnavailable, endpoint_ + ": cannot send: " + zmq_strerror(errno));
    }
  } while (remaining_ms(deadline) > 0);
  return fail(ErrorCode::kUnavailable, no_daemon());
}

bool Dealer::readable() const {
  zmq_pollitem_t item{socket_, 0, ZMQ_POLLIN, 0};
  return zmq_poll(&item, 1, 0) == 1;
}

Result<std::string> Dealer::receive(Deadline deadline) {
  while (true) {
    std::array<zmq_pollitem_t, 2> items = {
        {{socket_, 0, ZMQ_POLLIN, 0}, {monitor_, 0, ZMQ_POLLIN, 0}}};
    zmq_poll(items.data(), static_cast<int>(items.size()), remaining_ms(deadline));
    // What arrived before the connection was lost is still good.
    if ((items[0].revents & ZMQ_POLLIN) != 0) return receive_waiting();
    if ((items[1].revents & ZMQ_POLLIN) != 0) {
      if (!read_monitor()) continue;
      return fail(ErrorCode::kUnavailable, "lost the connection to " + endpoint_);
    }
    if (remaining_ms(deadline) == 0) {
      return fail(ErrorCode::kUnavailable, "no answer in time from " + endpoint_);
    }
  }
}

Result<std::string> Dealer::receive_waiting() {
  Message message;
  if (!message.receive(socket_)) {
    return fail(ErrorCode::kUnavailable, endpoint_ + ": cannot receive: " + zmq_strerror(errno));
  }
  if (message.more()) {
    drain_parts(socket_);
    return fail(ErrorCode::kProtocol, endpoint_ + " sent a multipart message");
  }
  return message.bytes();
}

}  // namespace brainshift::client
