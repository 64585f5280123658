// SPDX-License-Identifier: Apache-2.0
#include "client/lib/client.hpp"

#include <limits>
#include <utility>

#include "client/lib/dealer.hpp"
#include "client/lib/latest_usable.hpp"
#include "client/lib/update_queue.hpp"
#include "common/wire/frame.hpp"

namespace brainshift::client {
namespace {

using std::chrono::milliseconds;
using wire::MessageType;

// Room for every iterate of a few inversions; an update of an 18,000-node head has 0.3 MiB.
constexpr std::size_t kMaxQueuedUpdates = 256;

Deadline deadline_after(milliseconds timeout) { return std::chrono::steady_clock::now() + timeout; }

Status check_range(const char* name, milliseconds value) {
  // ZeroMQ takes milliseconds as int and three heartbeats make a timeout.
  constexpr milliseconds limit(std::numeric_limits<int>::max() / 4);
  if (value > milliseconds(0) && value <= limit) return {};
  return fail(ErrorCode::kInvalidArgument,
              std::string(name) + " = " + std::to_string(value.count()) + " ms: must be in [1, " +
                  std::to_string(limit.count()) + "]");
}

Status validate(const ClientOptions& options) {
  Status status = check_range("request_timeout", options.request_timeout);
  if (status) status = check_range("session_timeout", options.session_timeout);
  if (status) status = check_range("heartbeat_interval", options.heartbeat_interval);
  return status;
}

}  // namespace

struct Client::Impl {
  ClientOptions options;
  std::unique_ptr<Dealer> dealer;
  std::uint64_t last_request_id = 0;
  UpdateQueue updates{kMaxQueuedUpdates};
  LatestUsable latest_usable;

  // Sends a request and waits for its reply's payload. Updates met on the way are queued.
  Result<std::string> request(MessageType type, const std::string& payload, MessageType reply_type,
                              milliseconds timeout);
  // The payload if `message` answers request `id`; nullopt if it is an update or a late reply.
  std::optional<Result<std::string>> answer(const std::string& message, std::uint64_t id,
                                            MessageType reply_type);
  // The oldest queued update, on its way to the caller.
  std::optional<Result<wire::UpdateMessage>> hand_out();

  tl::unexpected<Error> protocol_error(const std::string& detail) const {
    return fail(ErrorCode::kProtocol, dealer->endpoint() + ": " + detail);
  }
};

Result<std::string> Client::Impl::request(MessageType type, const std::string& payload,
                                          MessageType reply_type, milliseconds timeout) {
  if (payload.size() > wire::kMaxPayloadBytes) {
    return fail(ErrorCode::kInvalidArgument, "request of " + std::to_string(payload.size()) +
                                                 " bytes: must be at most " +
                                                 std::to_string(wire::kMaxPayloadBytes));
  }
  const Deadline deadline = deadline_after(timeout);
  const std::uint64_t id = ++last_request_id;
  if (Status status = dealer->send(encode_frame(type, id, payload), deadline); !status) {
    return tl::unexpected(status.error());
  }
  while (true) {
    const auto message = dealer->receive(deadline);
    if (!message) return tl::unexpected(message.error());
    if (auto result = answer(*message, id, reply_type)) return *std::move(result);
  }
}

std::optional<Result<std::string>> Client::Impl::answer(const std::string& message,
                                                        std::uint64_t id, MessageType reply_type) {
  const auto frame = wire::decode_frame(message);
  if (!frame) return protocol_error(frame.error().message);
  if (frame->type == MessageType::kUpdate) {
    updates.push(wire::decode_update(frame->payload));
    return std::nullopt;
  }
  if (frame->request_id != 0 && frame->request_id < id) return std::nullopt;  // timed out before
  // A daemon that could not read a request's id complains with id 0.
  const bool complaint = frame->request_id == 0 && frame->type == MessageType::kErrorReply;
  if (frame->request_id != id && !complaint) {
    return protocol_error("reply to request " + std::to_string(frame->request_id) +
                          ", which was never made");
  }
  if (frame->type == MessageType::kErrorReply) {
    return tl::unexpected(wire::decode_error(frame->payload));
  }
  if (frame->type != reply_type) {
    return protocol_error("reply of type " + std::to_string(static_cast<int>(frame->type)) +
                          ", must be " + std::to_string(static_cast<int>(reply_type)));
  }
  return std::string(frame->payload);
}

std::optional<Result<wire::UpdateMessage>> Client::Impl::hand_out() {
  auto update = updates.pop();
  if (update && *update) latest_usable.take(**update);
  return update;
}

Client::Client(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Client::Client(Client&&) noexcept = default;
Client& Client::operator=(Client&&) noexcept = default;
Client::~Client() = default;

Result<Client> Client::connect(const std::string& endpoint, const ClientOptions& options) {
  if (Status status = validate(options); !status) return tl::unexpected(status.error());
  auto dealer = Dealer::connect(endpoint, options.heartbeat_interval);
  if (!dealer) return tl::unexpected(dealer.error());
  auto impl = std::make_unique<Impl>();
  impl->options = options;
  impl->dealer = std::move(*dealer);
  return Client(std::move(impl));
}

Result<wire::DaemonStatus> Client::status() {
  return impl_
      ->request(MessageType::kStatusRequest, "", MessageType::kStatusReply,
                impl_->options.request_timeout)
      .and_then([](const std::string& payload) { return wire::decode_status(payload); });
}

Result<wire::SessionInfo> Client::start_session(const wire::SessionRequest& request) {
  return impl_
      ->request(MessageType::kStartSessionRequest, wire::encode(request),
                MessageType::kStartSessionReply, impl_->options.session_timeout)
      .and_then([](const std::string& payload) { return wire::decode_session_info(payload); })
      .map([this](wire::SessionInfo info) {
        impl_->latest_usable.begin(info.session_id);
        return info;
      });
}

Result<BrainModel> Client::model() {
  return impl_
      ->request(MessageType::kModelRequest, "", MessageType::kModelReply,
                impl_->options.request_timeout)
      .and_then([](const std::string& payload) { return wire::decode_model(payload); });
}

Status Client::subscribe() {
  return impl_
      ->request(MessageType::kSubscribeRequest, "", MessageType::kSubscribeReply,
                impl_->options.request_timeout)
      .and_then([](const std::string& payload) { return wire::decode_subscribe_reply(payload); })
      .map([this](std::uint64_t session_id) { impl_->latest_usable.follow(session_id); });
}

Result<wire::ObservationReceipt> Client::submit(const Observation& observation) {
  return impl_
      ->request(MessageType::kObservation, wire::encode(observation),
                MessageType::kObservationReply, impl_->options.request_timeout)
      .and_then(
          [](const std::string& payload) { return wire::decode_observation_receipt(payload); });
}

Result<wire::UpdateMessage> Client::next_update(milliseconds timeout) {
  if (auto update = impl_->hand_out()) return *std::move(update);
  const Deadline deadline = deadline_after(timeout);
  while (true) {
    const auto message = impl_->dealer->receive(deadline);
    if (!message) return tl::unexpected(message.error());
    // No request is open: a reply with an old id is late, one with the next id is unasked for.
    auto unexpected = impl_->answer(*message, impl_->last_request_id + 1, MessageType::kUpdate);
    if (unexpected && !*unexpected) return tl::unexpected(unexpected->error());
    if (auto update = impl_->hand_out()) return *std::move(update);
  }
}

const std::optional<wire::UpdateMessage>& Client::latest_usable() const {
  return impl_->latest_usable.get();
}

}  // namespace brainshift::client
