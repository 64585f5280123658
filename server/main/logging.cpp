// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/main/logging.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <spdlog/async_logger.h>
#include <spdlog/details/null_mutex.h>
#include <spdlog/details/thread_pool.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>

#include <cerrno>
#include <future>
#include <string_view>
#include <thread>
#include <utility>

#include "common/core/text.hpp"

namespace brainshift::server {
namespace {

using Writer = spdlog::details::thread_pool;

// Waits for the reader as long as it takes. A line that cannot be written at all is dropped: there
// is no better place to report it.
void write_line(int fd, std::string_view line) {
  while (!line.empty()) {
    const ssize_t written = ::write(fd, line.data(), line.size());
    if (written >= 0) {
      line.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno == EAGAIN) {  // whoever shares the descriptor made it non-blocking
      pollfd writable{fd, POLLOUT, 0};
      poll(&writable, 1, -1);
    } else if (errno != EINTR) {
      return;
    }
  }
}

// Used by the writer's one thread only.
class LineSink : public spdlog::sinks::base_sink<spdlog::details::null_mutex> {
 public:
  LineSink(int fd, Writer& writer) : fd_(fd), writer_(writer) {}

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    const std::size_t lost = writer_.overrun_counter();
    if (lost > told_) {
      const std::string text =
          fmt::format("{} lines of the log were lost: its reader did not keep up", lost - told_);
      told_ = lost;
      write({message.logger_name, spdlog::level::warn, text});
    }
    write(message);
  }
  void flush_() override {}  // every line is written at once

 private:
  void write(const spdlog::details::log_msg& message) {
    spdlog::memory_buf_t line;
    const std::string text = one_line({message.payload.data(), message.payload.size()}, '?');
    spdlog::details::log_msg plain = message;
    plain.payload = text;
    formatter_->format(plain, line);
    write_line(fd_, {line.data(), line.size()});
  }

  int fd_;
  Writer& writer_;  // outlives its own thread
  std::size_t told_ = 0;
};

}  // namespace

Log::Log(const LogOptions& options)
    : drain_limit_(options.drain_limit),
      writer_(std::make_shared<Writer>(options.queue_lines, 1)),
      logger_(std::make_shared<spdlog::async_logger>(
          "brainshiftd", std::make_shared<LineSink>(options.fd, *writer_), writer_,
          spdlog::async_overflow_policy::overrun_oldest)) {
  logger_->set_pattern("%Y-%m-%dT%H:%M:%S.%e%z %l %v");
  logger_->set_level(spdlog::level::from_str(options.level));
  // spdlog would print errors of its own to stderr, and wait for the reader.
  logger_->set_error_handler([](const std::string&) {});
  spdlog::set_default_logger(logger_);
}

std::uint64_t Log::lost() const { return writer_->overrun_counter(); }

Log::~Log() {
  logger_->set_level(spdlog::level::off);
  // The writer's destructor waits until every line is written. When the reader stalls, that thread
  // and the writer's are left behind, with all that they use; they end with the process.
  std::promise<void> drained;
  auto done = drained.get_future();
  std::thread([writer = std::move(writer_), drained = std::move(drained)]() mutable {
    writer.reset();
    drained.set_value();
  }).detach();
  done.wait_for(drain_limit_);
}

}  // namespace brainshift::server
