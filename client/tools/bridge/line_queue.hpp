// SPDX-License-Identifier: GPL-3.0-or-later
// LineQueue: lines for a terminal, a pipe or a file that may not be read. tell() never waits: a
// thread of its own writes, and what finds no room is counted instead. Without a reader (EPIPE)
// nothing is written any more. What a terminal would obey in a peer's text (control characters of
// ASCII and of Unicode's first block, marks that turn the direction of writing) becomes '?'.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

namespace brainshift::client {

// The text with such characters replaced.
std::string printable(std::string text);

class LineQueue {
 public:
  static constexpr std::size_t kMaxLines = 1000;

  explicit LineQueue(int descriptor);
  // Writes what waits, for a second at most.
  ~LineQueue();
  LineQueue(const LineQueue&) = delete;
  LineQueue& operator=(const LineQueue&) = delete;

  // Any thread.
  void tell(std::string line);

 private:
  void run();
  // False when it was given up: nobody reads.
  bool write(std::string_view text);
  bool gives_up() const;

  const int descriptor_;
  mutable std::mutex mutex_;  // of all below
  std::condition_variable news_;
  std::deque<std::string> lines_;
  std::uint64_t dropped_ = 0;
  bool closed_ = false;  // nobody reads any more
  std::chrono::steady_clock::time_point ends_ = std::chrono::steady_clock::time_point::max();
  std::thread thread_;  // last: it uses everything above
};

}  // namespace brainshift::client
