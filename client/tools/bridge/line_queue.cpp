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
    lines_.push_back(std::move(line));
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
