// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/transport/outbox.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <iterator>
#include <system_error>
#include <utility>

namespace brainshift::server {

Outbox::Outbox() : fd_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (fd_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
}

Outbox::~Outbox() { close(fd_); }

void Outbox::post(Outgoing message) {
  {
    const std::lock_guard lock(mutex_);
    if (message.delivery == Delivery::kIterate && ++iterates_ > kMaxIterates) {
      const auto oldest = std::find_if(queue_.begin(), queue_.end(), [](const Outgoing& waiting) {
        return waiting.delivery == Delivery::kIterate;
      });
      queue_.erase(oldest);
      --iterates_;
    }
    queue_.push_back(std::move(message));
  }
  const std::uint64_t one = 1;
  // Fails only when the counter is full, and then the descriptor is readable anyway.
  [[maybe_unused]] const auto written = write(fd_, &one, sizeof one);
}

std::vector<Outgoing> Outbox::take() {
  std::uint64_t count = 0;
  [[maybe_unused]] const auto got = read(fd_, &count, sizeof count);
  const std::lock_guard lock(mutex_);
  std::vector<Outgoing> messages(std::make_move_iterator(queue_.begin()),
                                 std::make_move_iterator(queue_.end()));
  queue_.clear();
  iterates_ = 0;
  return messages;
}

}  // namespace brainshift::server
