// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/bridge/line_queue.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <utility>

namespace brainshift::client {
namespace {

constexpr std::chrono::seconds kGoodbyeLines{1};
constexpr int kLookForRoom_ms = 50;

}  // namespace

std::string printable(std::string text) {
  const auto at = [&](std::size_t i) {
    return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u;
  };
  std::string out;
  out.reserve(text.size());
  for (std::size_t i = 0; i < text.size();) {
    const unsigned a = at(i), b = at(i + 1), c = at(i + 2);
    std::size_t obeyed = 0;  // bytes
    if (a < 0x20 || a == 0x7f) obeyed = 1;
    if (a == 0xc2 && b >= 0x80 && b <= 0x9f) obeyed = 2;  // U+0080 to U+009F
    const bool turns = (b == 0x80 && ((c >= 0xaa && c <= 0xae) || c == 0x8e || c == 0x8f)) ||
                       (b == 0x81 && c >= 0xa6 && c <= 0xa9);
    if (a == 0xe2 && turns) obeyed = 3;  // U+200E, 200F, 202A to 202E, 2066 to 2069
    if (obeyed == 0) out.push_back(text[i]);
    if (obeyed > 0) out.push_back('?');
    i += std::max<std::size_t>(obeyed, 1);
  }
  return out;
}

LineQueue::LineQueue(int descriptor) : descriptor_(descriptor), thread_([this] { run(); }) {}

LineQueue::~LineQueue() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = std::chrono::steady_clock::now() + kGoodbyeLines;
  }
  news_.notify_one();
  thread_.join();
}

void LineQueue::tell(std::string line) {
  {
    const std::lock_guard lock(mutex_);
    if (closed_) return;
    if (lines_.size() >= kMaxLines) {
      ++dropped_;
      return;
    }
    lines_.push_back(printable(std::move(line)));
  }
  news_.notify_one();
}

void LineQueue::run() {
  while (true) {
    std::string text;
    {
      std::unique_lock lock(mutex_);
      const auto ending = [&] { return ends_ != std::chrono::steady_clock::time_point::max(); };
      news_.wait(lock, [&] { return !lines_.empty() || dropped_ > 0 || ending(); });
      if (lines_.empty() && dropped_ == 0) return;
      if (lines_.empty()) {
        text = fmt::format("{} lines were not printed: the output was not read\n",
                           std::exchange(dropped_, 0));
      } else {
        text = std::move(lines_.front()) + "\n";
        lines_.pop_front();
      }
    }
    if (write(text)) continue;
    const std::lock_guard lock(mutex_);
    closed_ = true;
    return;
  }
}

bool LineQueue::gives_up() const {
  const std::lock_guard lock(mutex_);
  return std::chrono::steady_clock::now() >= ends_;
}

bool LineQueue::write(std::string_view text) {
  while (!text.empty()) {
    pollfd item{descriptor_, POLLOUT, 0};
    const int ready = ::poll(&item, 1, kLookForRoom_ms);
    if (ready <= 0) {
      if (gives_up()) return false;
      continue;
    }
    // A pipe with room takes so much without waiting.
    const ssize_t count =
        ::write(descriptor_, text.data(), std::min<std::size_t>(text.size(), PIPE_BUF));
    if (count < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (count <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

}  // namespace brainshift::client
