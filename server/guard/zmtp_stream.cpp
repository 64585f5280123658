// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/guard/zmtp_stream.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace brainshift::server {
namespace {

constexpr std::uint8_t kMore = 1;
constexpr std::uint8_t kLong = 2;
constexpr std::uint8_t kCommand = 4;
constexpr std::uint8_t kKnownFlags = kMore | kLong | kCommand;
constexpr std::size_t kLongSizeBytes = 8;
// Places in the greeting.
constexpr std::size_t kSignatureEnd = 9;
constexpr std::size_t kVersion = 10;
constexpr std::size_t kMechanism = 12;
constexpr std::size_t kMechanismEnd = 32;
// A READY command holds a few short properties.
constexpr std::size_t kMaxReady = 1024;

// The value of `name` in the properties of a READY command: each a short name and a value with four
// bytes of size. Empty when it is not there or the command is none.
std::string property(const std::string& command, const std::string& name) {
  const std::string ready = "\5READY";
  if (command.rfind(ready, 0) != 0) return {};
  std::size_t at = ready.size();
  while (at < command.size()) {
    const std::size_t name_size = static_cast<std::uint8_t>(command[at++]);
    if (at + name_size + 4 > command.size()) return {};
    const std::string found = command.substr(at, name_size);
    at += name_size;
    std::size_t size = 0;
    for (int i = 0; i < 4; ++i) size = size << 8 | static_cast<std::uint8_t>(command[at++]);
    if (size > command.size() - at) return {};
    if (found == name) return command.substr(at, size);
    at += size;
  }
  return {};
}

}  // namespace

std::string ZmtpStream::greeting(std::uint8_t byte) {
  const std::size_t at = position_++;
  if (at == 0 && byte != 0xff) return "no ZMTP";
  if (at == kSignatureEnd && byte != 0x7f) return "no ZMTP";
  if (at == kVersion && byte < 3) return "a version of ZMTP below 3";
  if (at >= kMechanism && at < kMechanismEnd && byte != 0) {
    mechanism_.push_back(static_cast<char>(byte));
  }
  if (position_ == kGreetingBytes) {
    encrypted_ = mechanism_ == "CURVE";
    stage_ = Stage::kFlags;
  }
  return {};
}

std::string ZmtpStream::flags(std::uint8_t byte) {
  const bool command = (byte & kCommand) != 0;
  if ((byte & ~kKnownFlags) != 0 || (command && (byte & kMore) != 0)) return "no ZMTP frame";
  flags_ = byte;
  size_ = 0;
  position_ = 0;
  stage_ = (byte & kLong) != 0 ? Stage::kLongSize : Stage::kShortSize;
  return {};
}

std::string ZmtpStream::size_complete() {
  stage_ = Stage::kBody;
  if ((flags_ & kCommand) != 0) {
    if (size_ > bounds_.command_bytes) return fmt::format("a command of {} bytes", size_);
  } else {
    if (size_ > bounds_.message_bytes || message_bytes_ + size_ > bounds_.message_bytes) {
      return fmt::format("a message of more than {} bytes", bounds_.message_bytes);
    }
    if (++parts_ > bounds_.parts) {
      return fmt::format("a message of more than {} parts", bounds_.parts);
    }
    message_bytes_ += size_;
    cost_ += kPartCost + ((flags_ & kLong) != 0 ? 1 + kLongSizeBytes : 2);
  }
  if (size_ == 0) body_complete();
  return {};
}

void ZmtpStream::body_complete() {
  stage_ = Stage::kFlags;
  if ((flags_ & kCommand) != 0) {
    if (first_command_ && !encrypted_) routing_id_ = property(command_, "Identity");
    first_command_ = false;
    command_.clear();
  } else if ((flags_ & kMore) == 0) {
    parts_ = 0;
    message_bytes_ = 0;
    ++messages_;
  }
}

void ZmtpStream::keep_command(std::span<const std::uint8_t> bytes) {
  if (!first_command_ || (flags_ & kCommand) == 0) return;
  const std::size_t room = kMaxReady - std::min(kMaxReady, command_.size());
  command_.append(reinterpret_cast<const char*>(bytes.data()), std::min(room, bytes.size()));
}

std::string ZmtpStream::take(std::span<const std::uint8_t> bytes) {
  std::string wrong;
  while (!bytes.empty() && wrong.empty()) {
    if (stage_ == Stage::kBody) {
      const auto size = static_cast<std::size_t>(std::min<std::uint64_t>(size_, bytes.size()));
      keep_command(bytes.first(size));
      if ((flags_ & kCommand) == 0) cost_ += size;
      size_ -= size;
      bytes = bytes.subspan(size);
      if (size_ == 0) body_complete();
      continue;
    }
    const std::uint8_t byte = bytes.front();
    bytes = bytes.subspan(1);
    switch (stage_) {
      case Stage::kGreeting: wrong = greeting(byte); break;
      case Stage::kFlags: wrong = flags(byte); break;
      case Stage::kShortSize:
        size_ = byte;
        wrong = size_complete();
        break;
      default:
        size_ = size_ << 8 | byte;
        if (++position_ == kLongSizeBytes) wrong = size_complete();
        break;
    }
  }
  return wrong;
}

}  // namespace brainshift::server
