// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/bridge/peer.hpp"

#include <array>
#include <utility>

namespace brainshift::client {
namespace {

std::string greeting() {
  igtl::Envelope envelope;
  envelope.version = 2;
  envelope.device = "brainshift";
  std::string bytes;
  // No GET_STATUS: it has no content, and OpenIGTLink's receivers read beyond it.
  static_cast<void>(igtl::encode(envelope, igtl::StatusReport{}, bytes));
  return bytes;
}

// Tells of a message that is well framed and cannot be understood: the first, second, fourth, ...
// Of an image an empty one is handed on, so that whoever counts images counts it.
void refuse_message(const igtl::Header& header, const Error& error, const Peer::Sinks& sinks,
                    std::uint64_t& refused) {
  if (const std::uint64_t n = ++refused; (n & (n - 1)) == 0) {
    sinks.tell(header.type + " of " + header.device + " left out: " + error.message +
               (n == 1 ? "" : " (" + std::to_string(n) + " messages so far)"));
  }
  if (header.type != igtl::Image::kType) return;
  igtl::Message empty;
  empty.envelope.device = header.device;
  empty.envelope.timestamp = header.timestamp;
  empty.content = igtl::Image{};
  sinks.take(std::move(empty));
}

// Reads what has come, kMaxReadAtOnce at most.
Status read_messages(Socket& socket, igtl::StreamReader& reader, const Peer::Sinks& sinks,
                     std::uint64_t& refused,
                     const std::function<void(std::uint16_t version)>& see_version) {
  std::array<char, 64 * 1024> buffer;
  for (std::size_t sum = 0; sum < Peer::kMaxReadAtOnce;) {
    const auto count = socket.read(buffer.data(), buffer.size());
    if (!count) return tl::unexpected(count.error());
    if (*count == 0) return {};
    sum += *count;
    std::string_view bytes(buffer.data(), *count);
    while (!bytes.empty()) {
      const auto packet = reader.read(bytes);
      if (!packet) return tl::unexpected(packet.error());
      if (!*packet) continue;
      see_version((*packet)->header.version);
      if ((*packet)->skipped) continue;
      auto message = igtl::decode((*packet)->header, (*packet)->body);
      if (message) {
        sinks.take(std::move(*message));
      } else {
        refuse_message((*packet)->header, message.error(), sinks, refused);
      }
    }
  }
  return {};
}

}  // namespace

Peer::Peer(Socket socket, igtl::StreamLimits limits)
    : socket_(std::move(socket)), name_(socket_.peer_name()), reader_(std::move(limits)) {}

void Peer::offer(const BroadcastPtr& broadcast) {
  if (!wants_to_write()) taken_ = std::chrono::steady_clock::now();
  if (!broadcast->whole()) {
    waiting_state_ = state_ = broadcast;
    return;
  }
  shown_ = broadcast;
  if (waiting_picture_) ++replaced_;
  waiting_picture_ = broadcast;
  waiting_state_ = state_ = nullptr;
}

Status Peer::reply(const igtl::Envelope& envelope, const igtl::Content& content) {
  if (replies_.size() >= kMaxReplies) {
    return fail(ErrorCode::kUnavailable, "it asks and does not read");
  }
  std::string bytes;
  if (auto ok = igtl::encode(envelope, content, bytes); !ok) return ok;
  replies_.push_back(std::move(bytes));
  return {};
}

bool Peer::wants_to_write() const {
  return !message_.empty() || !replies_.empty() || current_ || waiting_picture_ || waiting_state_;
}

std::optional<std::chrono::steady_clock::time_point> Peer::unread_since() const {
  if (!wants_to_write()) return std::nullopt;
  return taken_;
}

bool Peer::next_message() {
  if (!replies_.empty()) {
    reply_bytes_ = std::move(replies_.front());
    replies_.pop_front();
    message_ = reply_bytes_;
    return true;
  }
  while (true) {
    const bool blank_waits = waiting_picture_ && waiting_picture_->picture().state.blank;
    const bool ended = !current_ || next_ >= current_->size();
    if (ended || blank_waits) {
      if (!ended) ++replaced_;
      current_ = waiting_picture_ ? std::exchange(waiting_picture_, nullptr)
                                  : std::exchange(waiting_state_, nullptr);
      next_ = 0;
      if (!current_) return false;
    }
    message_ = current_->bytes(next_++, version_);
    holder_ = current_;
    if (!message_.empty()) return true;  // empty: it cannot be encoded
  }
}

Status Peer::write() {
  while (true) {
    if (message_.empty() && !next_message()) return {};
    const auto taken = socket_.write(message_);
    if (!taken) return tl::unexpected(taken.error());
    if (*taken == 0) return {};
    taken_ = std::chrono::steady_clock::now();
    message_.remove_prefix(*taken);
    if (message_.empty()) {
      holder_ = nullptr;
      if (current_ && next_ >= current_->size()) current_ = nullptr;
    }
  }
}

void Peer::take_version(std::uint16_t version) {
  if (version < 2 || version_ >= 2) return;
  version_ = 2;
  if (shown_ && !waiting_picture_) waiting_picture_ = shown_;
  waiting_state_ = state_;
}

Status Peer::read(const Sinks& sinks) {
  return read_messages(socket_, reader_, sinks, refused_,
                       [&](std::uint16_t version) { take_version(version); });
}

Upstream::Upstream(Address address, igtl::StreamLimits limits)
    : address_(std::move(address)), limits_(std::move(limits)) {}

std::optional<std::string> Upstream::tend(TimePoint now) {
  if (socket_ || now < next_attempt_) return std::nullopt;
  auto socket = Socket::connect(address_);
  if (!socket) return lost(socket.error(), now);
  socket_ = std::move(*socket);
  reader_.emplace(limits_);
  connected_ = false;
  unsent_ = greeting();
  return std::nullopt;
}

std::optional<std::string> Upstream::lost(const Error& error, TimePoint now) {
  const bool was_connected = std::exchange(connected_, false);
  socket_.reset();
  next_attempt_ = now + kRetry;
  if (!was_connected && std::exchange(told_, true)) return std::nullopt;
  told_ = true;
  return "from " + to_string(address_) + ": " + error.message + "; trying again";
}

Status Upstream::write() {
  while (!unsent_.empty()) {
    const auto taken = socket_->write(unsent_);
    if (!taken) return tl::unexpected(taken.error());
    if (*taken == 0) return {};
    unsent_.erase(0, *taken);
  }
  return {};
}

std::optional<std::string> Upstream::ready(bool readable, bool writable, TimePoint now,
                                           const Peer::Sinks& sinks) {
  std::optional<std::string> news;
  if (writable && !connected_) {
    if (auto ok = socket_->connected(); !ok) return lost(ok.error(), now);
    connected_ = true;
    told_ = false;
    news = "from " + to_string(address_) + ": connected";
  }
  if (writable) {
    if (auto ok = write(); !ok) return lost(ok.error(), now);
  }
  if (readable && connected_) {
    const auto any_version = [](std::uint16_t) {};
    if (auto ok = read_messages(*socket_, *reader_, sinks, refused_, any_version); !ok) {
      return lost(ok.error(), now);
    }
  }
  return news;
}

}  // namespace brainshift::client
