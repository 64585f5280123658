// SPDX-License-Identifier: GPL-3.0-or-later
// The daemon's log: one line per event on stderr: time, level, then words and key=value pairs.
//
// A log call never waits for the reader of stderr. Lines go through a bounded queue to a thread
// that writes them. While the reader stalls, the oldest lines of a full queue give way. Once it
// reads again, a line tells how many were lost.
#pragma once

#include <unistd.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace spdlog {
class logger;
namespace details {
class thread_pool;
}
}  // namespace spdlog

namespace brainshift::server {

struct LogOptions {
  std::string level = "info";  // least severe level written: trace, debug, info, warn or error
  int fd = STDERR_FILENO;      // stays open as long as the process
  // Lines that may wait: some seconds of debug messages, 1 MiB of memory.
  std::size_t queue_lines = 2048;
  // How long the end waits for the lines that are left.
  std::chrono::milliseconds drain_limit{500};
};

class Log {
 public:
  // From here on spdlog's default logger is this log. One at a time in a process.
  explicit Log(const LogOptions& options);
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;
  // Writes the lines that wait, for at most drain_limit; the rest is lost. Later calls of spdlog
  // write nothing.
  ~Log();

  // Lines that gave way so far. From any thread.
  std::uint64_t lost() const;

 private:
  std::chrono::milliseconds drain_limit_;
  std::shared_ptr<spdlog::details::thread_pool> writer_;
  std::shared_ptr<spdlog::logger> logger_;
};

}  // namespace brainshift::server
