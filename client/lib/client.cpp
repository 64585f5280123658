// SPDX-License-Identifier: Apache-2.0
#include "client/lib/client.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "client/lib/dealer.hpp"
#include "client/lib/received_updates.hpp"
#include "client/lib/session_watch.hpp"
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
  return invalid(std::string(name) + " = " + std::to_string(value.count()) +
                 " ms: must be in [1, " + std::to_string(limit.count()) + "]");
}

Status validate(const ClientOptions& options) {
  Status status = check_range("request_timeout", options.request_timeout);
  if (status) status = check_range("session_timeout", options.session_timeout);
  if (status) status = check_range("heartbeat_interval", options.heartbeat_interval);
  if (status) status = check_range("renewal_interval", options.renewal_interval);
  return status;
}

}  // namespace

struct Client::Impl {
  ClientOptions options;
  std::unique_ptr<Dealer> dealer;
  std::uint64_t last_request_id = 0;
  UpdateQueue updates{kMaxQueuedUpdates};
  FieldAssembly assembly;
  LatestUsable latest_usable;
  SessionKey own;  // the session that this client started
  SessionWatch watch;
  int mesh_nodes = 0;  // of the model that the viewer draws with; 0: not known
  std::optional<Subscription> subscription;
  std::uint64_t acknowledged = 0;  // of subscription->received
  Deadline renewed;                // when it was last renewed
  std::uint64_t losses = 0;        // of the dealer, as far as they have been dealt with

  // Sends a request and waits for its reply's payload: by default for as long as the options say.
  // Updates met on the way are queued.
  Result<std::string> request(MessageType type, const std::string& payload, MessageType reply_type,
                              std::optional<milliseconds> timeout = {}) {
    if (payload.size() > wire::kMaxPayloadBytes) {
      return invalid("request of " + std::to_string(payload.size()) + " bytes: must be at most " +
                     std::to_string(wire::kMaxPayloadBytes));
    }
    const Deadline deadline = deadline_after(timeout.value_or(options.request_timeout));
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

  // The payload if `message` answers request `id`; nullopt if it is an update or a late reply.
  std::optional<Result<std::string>> answer(const std::string& message, std::uint64_t id,
                                            MessageType reply_type) {
    const auto frame = wire::decode_frame(message);
    if (!frame) return protocol_error(frame.error().message);
    if (frame->type == MessageType::kUpdate) {
      take_update(frame->payload);
      return std::nullopt;
    }
    if (frame->type == MessageType::kSessionState) {
      take_state(frame->request_id, frame->payload);
      if (frame->request_id != id) return std::nullopt;
    }
    if (frame->request_id != 0 && frame->request_id < id) {
      // A renewal that is refused: after a restart the choice may hold no node of another model.
      const bool waiting_for_push = reply_type == MessageType::kUpdate;
      if (frame->type == MessageType::kErrorReply && waiting_for_push &&
          watch.refused(frame->request_id)) {
        return tl::unexpected(wire::decode_error(frame->payload));
      }
      return std::nullopt;  // timed out before
    }
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

  void take_state(std::uint64_t request_id, std::string_view payload) {
    const auto state = wire::decode_session_state(payload);
    if (!state) return;  // subscribe() reports it; a renewal without an answer proves nothing
    if (request_id == 0) {
      watch.told(*state);
    } else {
      watch.answered(request_id, *state);
    }
    latest_usable.follow(state->session);
  }

  void take_update(std::string_view payload) {
    if (subscription) ++subscription->received;
    auto update = wire::decode_update(payload);
    if (!update) {
      // It may have been what the next changes are to be applied to.
      if (subscription && subscription->choice.tolerance_mm > 0.0) ask_anew();
      return updates.push(std::move(update));
    }
    if (!latest_usable.belongs(update->key()) || !watch.model_fits(update->update.model_id)) return;
    if (auto fits = check_mesh(*update, mesh_nodes); !fits) {
      return updates.push(protocol_error(fits.error().message));
    }
    update->received_bytes = payload.size();
    update->received_at = BootClock::now().time_since_epoch();
    update->received_nodes = static_cast<int>(update->update.estimate.displacement.cols());
    const FieldAssembly::Outcome outcome = assembly.complete(*update);
    if (outcome == FieldAssembly::Outcome::kLost && subscription) ask_anew();
    if (outcome == FieldAssembly::Outcome::kWhole) updates.push(std::move(update));
  }

  // The daemon is to take this for a new subscription, and to send the whole choice first.
  void ask_anew() {
    ++subscription->id;
    subscription->received = acknowledged = 0;
    renewed = {};
    assembly.forget();
  }

  // True when the connection was lost since the last time; the next renewal subscribes again.
  bool notice_losses() {
    if (dealer->losses() == losses) return false;
    losses = dealer->losses();
    watch.lost();
    if (subscription) ask_anew();
    return true;
  }

  // Tells the daemon what was received, and asks what is current. Waits neither for a connection
  // nor for the answer: without a connection field_status() tells in time. kUnavailable when the
  // connection was found to be lost.
  Status renew() {
    const Deadline now = std::chrono::steady_clock::now();
    const std::uint64_t id = ++last_request_id;
    watch.asked(id, BootClock::now());
    renewed = now;
    acknowledged = subscription->received;
    static_cast<void>(dealer->send(
        encode_frame(MessageType::kSubscribeRequest, id, wire::encode(*subscription)), now));
    if (!notice_losses()) return {};
    return fail(ErrorCode::kUnavailable, "lost the connection to " + dealer->endpoint());
  }

  Deadline next_renewal() const {
    const std::uint64_t batch = std::max<std::uint64_t>(1, subscription->window / 2);
    if (subscription->received - acknowledged >= batch) return renewed;
    return renewed + options.renewal_interval;
  }

  // What has arrived while nobody waited may be outdated by now: drops what is, once the daemon has
  // said what is newest.
  Status confirm(Deadline deadline) {
    const auto asked = BootClock::now();
    const Deadline begun = std::chrono::steady_clock::now();
    while (!watch.as_of() || *watch.as_of() < asked) {
      if (next_renewal() <= std::chrono::steady_clock::now() || renewed < begun) {
        if (auto status = renew(); !status) return status;
      }
      auto status = receive_push(std::min(deadline, next_renewal()));
      if (!status && gives_up(status.error(), deadline)) return status;
    }
    updates.drop_older_than(*watch.state());
    return {};
  }

  // Whether a wait for a push ends with this error: not when only a renewal is due.
  bool gives_up(const Error& error, Deadline deadline) {
    return notice_losses() || error.code != ErrorCode::kUnavailable ||
           std::chrono::steady_clock::now() >= deadline;
  }

  // Receives one message for nobody in particular.
  Status receive_push(Deadline deadline) {
    const auto message = dealer->receive(deadline);
    if (!message) return tl::unexpected(message.error());
    // No request is open: a reply with an old id is late, one with the next id is unasked for.
    const auto unexpected = answer(*message, last_request_id + 1, MessageType::kUpdate);
    if (unexpected && !*unexpected) return tl::unexpected(unexpected->error());
    return {};
  }

  // The oldest queued update, on its way to the caller.
  std::optional<Result<UpdateMessage>> hand_out() {
    auto update = updates.pop();
    // Its session may have ended while it waited.
    while (update && *update && !latest_usable.belongs((*update)->key())) update = updates.pop();
    if (update && *update) latest_usable.take(**update);
    return update;
  }

  tl::unexpected<Error> protocol_error(const std::string& detail) const {
    return fail(ErrorCode::kProtocol, dealer->endpoint() + ": " + detail);
  }
};

Client::Client(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Client::Client(Client&&) noexcept = default;
Client& Client::operator=(Client&&) noexcept = default;
Client::~Client() = default;

Result<Client> Client::connect(const std::string& endpoint, const ClientOptions& options) {
  if (Status status = validate(options); !status) return tl::unexpected(status.error());
  auto dealer = Dealer::connect(endpoint, options.heartbeat_interval, options.keys);
  if (!dealer) return tl::unexpected(dealer.error());
  auto impl = std::make_unique<Impl>();
  impl->options = options;
  impl->dealer = std::move(*dealer);
  return Client(std::move(impl));
}

Result<DaemonStatus> Client::status() {
  return impl_->request(MessageType::kStatusRequest, "", MessageType::kStatusReply)
      .and_then(wire::decode_status);
}

Result<wire::DaemonReport> Client::report() {
  return impl_->request(MessageType::kReportRequest, "", MessageType::kReportReply)
      .and_then(wire::decode_report);
}

Result<SessionInfo> Client::start_session(const SessionRequest& request) {
  return impl_
      ->request(MessageType::kStartSessionRequest, wire::encode(request),
                MessageType::kStartSessionReply, impl_->options.session_timeout)
      .and_then(wire::decode_session_info)
      .map([this](SessionInfo info) {
        impl_->own = info.key();
        impl_->latest_usable.begin(info.key());
        impl_->watch.expect_model(info.model_id);
        impl_->mesh_nodes = info.nodes;
        return info;
      });
}

Result<BrainModel> Client::model() {
  return impl_->request(MessageType::kModelRequest, "", MessageType::kModelReply)
      .and_then(wire::decode_model)
      .map([this](BrainModel model) {
        impl_->watch.expect_model(model.model_id);
        impl_->mesh_nodes = model.mesh.num_nodes();
        return model;
      });
}

Status Client::subscribe(std::uint32_t window, const FieldChoice& choice) {
  if (window < 1 || window > Subscription::kMaxWindow) {
    return invalid("window = " + std::to_string(window) + ": must be in [1, " +
                   std::to_string(Subscription::kMaxWindow) + "]");
  }
  if (Status status = validate(choice); !status) return status;
  Impl& self = *impl_;
  self.notice_losses();
  const std::optional<Subscription> before = self.subscription;
  const std::uint64_t id = self.subscription ? self.subscription->id + 1 : 1;
  self.subscription = Subscription{id, window, 0, choice};
  self.assembly.begin(choice);
  self.acknowledged = 0;
  self.renewed = std::chrono::steady_clock::now();
  self.watch.asked(self.last_request_id + 1, BootClock::now());
  const auto state = self.request(MessageType::kSubscribeRequest, wire::encode(*self.subscription),
                                  MessageType::kSessionState)
                         .and_then(wire::decode_session_state);
  if (state) return {};
  // A daemon that refuses a choice goes on with the one before.
  if (state.error().code != ErrorCode::kUnavailable) {
    self.subscription = before;
    self.assembly.begin(before ? before->choice : FieldChoice{});
  }
  return tl::unexpected(state.error());
}

Result<ObservationReceipt> Client::submit(const Observation& observation) {
  Observation named = observation;
  if (named.session == SessionKey{}) {
    if (auto status = session_status(); !status) return tl::unexpected(status.error());
    named.session = impl_->own == SessionKey{} ? impl_->latest_usable.session() : impl_->own;
  }
  return impl_
      ->request(MessageType::kObservation, wire::encode(named), MessageType::kObservationReply)
      .and_then(wire::decode_observation_receipt);
}

Status Client::session_status() const {
  const SessionKey& own = impl_->own;
  const SessionKey& runs = impl_->latest_usable.session();
  if (own == SessionKey{} || runs == own || runs == SessionKey{}) return {};
  const std::string why = runs.boot_id != own.boot_id ? "the daemon has been restarted"
                          : runs.session_id == 0      ? "none runs now"
                                                      : "another client has started session " +
                                                       std::to_string(runs.session_id);
  return fail(ErrorCode::kUnavailable,
              "session " + std::to_string(own.session_id) + " has ended: " + why);
}

Result<UpdateMessage> Client::next_update(milliseconds timeout) {
  Impl& self = *impl_;
  const Deadline deadline = deadline_after(timeout);
  self.notice_losses();
  if (self.subscription && self.subscription->window == 1) {
    while (self.dealer->readable()) {
      if (auto status = self.receive_push(deadline); !status) return tl::unexpected(status.error());
    }
    if (self.updates.size() > 0) {
      if (auto status = self.confirm(deadline); !status) return tl::unexpected(status.error());
    }
  }
  while (true) {
    if (auto update = self.hand_out()) return *std::move(update);
    Deadline until = deadline;
    if (self.subscription) {
      if (self.next_renewal() <= std::chrono::steady_clock::now()) {
        if (auto status = self.renew(); !status) return tl::unexpected(status.error());
      }
      until = std::min(deadline, self.next_renewal());
    }
    const auto status = self.receive_push(until);
    if (status) continue;
    if (self.gives_up(status.error(), deadline)) return tl::unexpected(status.error());
  }
}

const std::optional<UpdateMessage>& Client::latest_usable() const {
  return impl_->latest_usable.get();
}

FieldStatus Client::field_status() const {
  std::optional<std::pair<SessionKey, std::uint64_t>> shown;
  double own_age_s = std::numeric_limits<double>::quiet_NaN();
  if (const auto& field = latest_usable()) {
    shown.emplace(field->key(), field->update.sequence);
    const auto held = BootClock::now().time_since_epoch() - field->received_at;
    const AnswerTime& answer = field->update.answer_time;
    if (answer.ms > 0.0) {
      own_age_s = 1e-3 * answer.age_ms + std::chrono::duration<double>(held).count();
    }
  }
  return impl_->watch.judge(shown, impl_->dealer->endpoint(), BootClock::now(), own_age_s);
}

const std::optional<SessionState>& Client::session_state() const { return impl_->watch.state(); }

}  // namespace brainshift::client
