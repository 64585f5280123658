// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/bridge/hub.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

namespace brainshift::client {
namespace {

using Clock = std::chrono::steady_clock;

// A second look at what has no descriptor: connecting anew.
constexpr int kLook_ms = 100;
constexpr std::chrono::seconds kGoodbye{1};

constexpr short kReadable = POLLIN | POLLHUP | POLLERR;
constexpr short kWritable = POLLOUT | POLLHUP | POLLERR;

}  // namespace

Result<std::unique_ptr<Hub>> Hub::open(const HubOptions& options, Tell tell, Sink sink) {
  auto listener = Socket::listen(options.listen);
  if (!listener) return tl::unexpected(listener.error());
  std::unique_ptr<Hub> hub(
      new Hub(std::move(*listener), options, std::move(tell), std::move(sink)));
  if (hub->wake_descriptor_ < 0) {
    return fail(ErrorCode::kInternal, std::string("no event descriptor: ") + std::strerror(errno));
  }
  return hub;
}

Hub::Hub(Socket listener, const HubOptions& options, Tell tell, Sink sink)
    : options_(options),
      tell_(std::move(tell)),
      sink_(std::move(sink)),
      listener_(std::move(listener)),
      wake_descriptor_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (options.from) upstream_.emplace(*options.from, options.from_upstream);
}

Hub::~Hub() {
  if (wake_descriptor_ >= 0) ::close(wake_descriptor_);
}

void Hub::wake() {
  const std::uint64_t one = 1;
  // Full means that the hub is awake already.
  static_cast<void>(!::write(wake_descriptor_, &one, sizeof one));
}

void Hub::post(PicturePtr picture, Broadcast::Part part) {
  {
    const std::lock_guard lock(mutex_);
    if (part == Broadcast::Part::kWhole) {
      pending_ = {std::move(picture), nullptr, {}};
    } else {
      pending_.state = std::move(picture);
    }
    pending_.posted = BootClock::now();
  }
  wake();
}

void Hub::take_posts() {
  std::uint64_t count = 0;
  static_cast<void>(!::read(wake_descriptor_, &count, sizeof count));
  Pending taken;
  {
    const std::lock_guard lock(mutex_);
    taken = std::exchange(pending_, {});
  }
  if (!taken.whole && !taken.state) return;
  heard_ = taken.posted;
  if (!taken.whole && hidden_) taken.whole = hidden_->picture_ptr();
  hidden_ = nullptr;
  if (taken.whole) offer(std::move(taken.whole), Broadcast::Part::kWhole);
  if (taken.state) offer(std::move(taken.state), Broadcast::Part::kState);
}

void Hub::offer(PicturePtr picture, Broadcast::Part part) {
  newest_state_ = picture;
  auto broadcast = std::make_shared<Broadcast>(std::move(picture), part, ++message_id_);
  if (broadcast->whole()) newest_picture_ = broadcast;
  newest_state_broadcast_ = broadcast->whole() ? nullptr : broadcast;
  for (const auto& peer : peers_) peer->offer(broadcast);
}

void Hub::drop(std::unique_ptr<Peer>& peer, const std::string& why) {
  tell_("client " + peer->name() + ": " + why);
  replaced_of_gone_ += peer->replaced();
  peer.reset();
}

void Hub::make_room() {
  std::unique_ptr<Peer>* longest = nullptr;
  auto since = Clock::now() - options_.unread;
  for (auto& peer : peers_) {
    const auto unread = peer->unread_since();
    if (!unread || *unread > since) continue;
    longest = &peer;
    since = *unread;
  }
  if (longest == nullptr) return;
  drop(*longest, "makes room: it does not read");
  std::erase(peers_, nullptr);
}

void Hub::accept_peers() {
  while (auto socket = listener_.accept()) {
    if (peers_.size() >= options_.max_peers) make_room();
    if (peers_.size() >= options_.max_peers) {
      tell_("client " + socket->peer_name() + ": turned away, there are " +
            std::to_string(peers_.size()) + " already");
      continue;
    }
    auto peer = std::make_unique<Peer>(std::move(*socket), options_.from_peers);
    tell_("client " + peer->name() + ": connected");
    if (newest_picture_) peer->offer(newest_picture_);
    if (newest_state_broadcast_) peer->offer(newest_state_broadcast_);  // its age is the newest
    peers_.push_back(std::move(peer));
  }
}

Status Hub::answer(Peer& peer, igtl::Message&& message) {
  igtl::Envelope envelope;
  envelope.version = peer.version();
  envelope.device = "brainshift";
  envelope.timestamp = time_now();
  envelope.message_id = message.envelope.message_id;
  if (std::holds_alternative<igtl::StatusRequest>(message.content)) {
    const ShownState state = state_now();
    if (envelope.version >= 2) envelope.metadata = to_metadata(state);
    return peer.reply(envelope, to_status(state));
  }
  if (std::holds_alternative<igtl::CapabilityRequest>(message.content)) {
    return peer.reply(envelope, igtl::Capability{{"STATUS", "STRING", "IMAGE", "POLYDATA",
                                                  "GET_STATUS", "GET_CAPABIL"}});
  }
  hand_on(std::move(message));
  return {};
}

ShownState Hub::state_now() const {
  ShownState state;
  state.reason = "the bridge has just begun";
  if (newest_state_) state = newest_state_->state;
  const auto silent = BootClock::now() - heard_;
  const double silent_ms = std::chrono::duration<double, std::milli>(silent).count();
  state.age_ms += silent_ms;
  if (silent <= options_.silence) return state;
  state.currency = Currency::kStale;
  state.reason = "the bridge has not looked at the daemon for " +
                 std::to_string(static_cast<int>(silent_ms / 1e3)) + " s";
  return state;
}

void Hub::blank_in_silence() {
  if (BootClock::now() - heard_ <= options_.silence) return;
  if (hidden_ || !newest_picture_ || newest_picture_->picture().state.blank) return;
  const BroadcastPtr stood = newest_picture_;
  offer(blank_picture(stood->picture().rest, state_now()), Broadcast::Part::kWhole);
  hidden_ = stood;
  tell_("blank: " + newest_state_->state.reason);
}

void Hub::watch_standstill(bool anything_came) {
  const auto now = BootClock::now();
  if (now - std::exchange(turned_, now) > std::chrono::milliseconds(kLook_ms) + kStandstill) {
    stood_still_ = true;
    tell_("the bridge stood still: what came meanwhile without a time is not used");
  } else if (!anything_came) {
    stood_still_ = false;
  }
}

void Hub::hand_on(igtl::Message&& message) {
  if (stood_still_ && message.envelope.timestamp == 0) return;
  sink_(std::move(message));
}

void Hub::serve_peers(const std::vector<short>& events) {
  std::uint64_t replaced = replaced_of_gone_;
  for (std::size_t i = 0; i < events.size(); ++i) {
    Peer& peer = *peers_[i];
    Status status;
    if ((events[i] & kReadable) != 0) {
      Status answered;
      status = peer.read({[&](igtl::Message&& message) {
                            if (answered) answered = answer(peer, std::move(message));
                          },
                          [&](const std::string& sentence) {
                            tell_(sentence + " (client " + peer.name() + ")");
                          }});
      if (status) status = answered;
    }
    if (status && peer.wants_to_write()) status = peer.write();
    if (!status) drop(peers_[i], status.error().message);
  }
  std::erase(peers_, nullptr);
  replaced = replaced_of_gone_;
  for (const auto& peer : peers_) replaced += peer->replaced();
  replaced_ = replaced;
  peer_count_ = static_cast<int>(peers_.size());
}

void Hub::say_goodbye() {
  ShownState state;
  if (newest_state_) state = newest_state_->state;
  state.currency = Currency::kNone;
  state.quality = "none";
  state.flags.clear();
  state.reason = "the bridge has ended";
  const auto rest = newest_picture_ ? newest_picture_->picture().rest : nullptr;
  offer(blank_picture(rest, std::move(state)), Broadcast::Part::kWhole);
}

Status Hub::run(int stop_descriptor) {
  std::optional<Clock::time_point> ends;
  std::vector<pollfd> polled;
  std::vector<short> events;
  while (true) {
    const auto now = Clock::now();
    if (upstream_ && !ends) {
      if (const auto news = upstream_->tend(now)) tell_(*news);
    }
    const bool all_sent = std::none_of(peers_.begin(), peers_.end(),
                                       [](const auto& peer) { return peer->wants_to_write(); });
    if (ends && (all_sent || now >= *ends)) return {};

    polled.assign({{ends ? -1 : stop_descriptor, POLLIN, 0},
                   // What comes after the goodbye must not take its place.
                   {ends ? -1 : wake_descriptor_, POLLIN, 0},
                   {ends ? -1 : listener_.descriptor(), POLLIN, 0},
                   {-1, POLLIN, 0}});
    if (upstream_ && !ends) {
      polled[3].fd = upstream_->descriptor();
      if (upstream_->wants_to_write()) polled[3].events |= POLLOUT;
    }
    for (const auto& peer : peers_) {
      const int wanted = POLLIN | (peer->wants_to_write() ? POLLOUT : 0);
      polled.push_back({peer->descriptor(), static_cast<short>(wanted), 0});
    }
    if (::poll(polled.data(), polled.size(), kLook_ms) < 0 && errno != EINTR) {
      return fail(ErrorCode::kInternal, std::string("poll: ") + std::strerror(errno));
    }
    watch_standstill(std::any_of(polled.begin() + 2, polled.end(), [](const pollfd& item) {
      return (item.revents & kReadable) != 0;
    }));
    if (polled[1].revents != 0) take_posts();
    if (!ends) blank_in_silence();
    events.clear();
    for (std::size_t i = 4; i < polled.size(); ++i) events.push_back(polled[i].revents);
    if (polled[0].revents != 0) {
      ends = Clock::now() + kGoodbye;
      say_goodbye();
    }
    serve_peers(events);
    if (polled[2].revents != 0) accept_peers();
    if (upstream_ && polled[3].revents != 0) {
      const bool readable = (polled[3].revents & kReadable) != 0;
      const bool writable = (polled[3].revents & kWritable) != 0;
      const Peer::Sinks sinks{
          [this](igtl::Message&& message) { hand_on(std::move(message)); },
          [this](const std::string& sentence) { tell_(sentence + " (from the server)"); }};
      if (const auto news = upstream_->ready(readable, writable, Clock::now(), sinks)) tell_(*news);
    }
  }
}

}  // namespace brainshift::client
