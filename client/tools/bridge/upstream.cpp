// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/bridge/upstream.hpp"

#include <array>
#include <utility>

namespace brainshift::client {
namespace {

std::string greeting() {
  igtl::Envelope envelope;
  envelope.version = 2;
  envelope.device = "brainshift";
  std::string bytes;
  static_cast<void>(igtl::encode(envelope, igtl::StatusRequest{}, bytes));
  return bytes;
}

}  // namespace

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

Status Upstream::read(const Peer::Sink& sink) {
  std::array<char, 64 * 1024> buffer;
  for (std::size_t sum = 0; sum < Peer::kMostReadAtOnce;) {
    const auto count = socket_->read(buffer.data(), buffer.size());
    if (!count) return tl::unexpected(count.error());
    if (*count == 0) return {};
    sum += *count;
    std::string_view bytes(buffer.data(), *count);
    while (!bytes.empty()) {
      const auto packet = reader_->read(bytes);
      if (!packet) return tl::unexpected(packet.error());
      if (!*packet || (*packet)->skipped) continue;
      auto message = igtl::decode((*packet)->header, (*packet)->body);
      if (message) sink(std::move(*message));
    }
  }
  return {};
}

std::optional<std::string> Upstream::ready(bool readable, bool writable, TimePoint now,
                                           const Peer::Sink& sink) {
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
    if (auto ok = read(sink); !ok) return lost(ok.error(), now);
  }
  return news;
}

}  // namespace brainshift::client
