// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/main/logging.hpp"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

namespace brainshift::server {

void start_logging(const std::string& level) {
  auto logger = spdlog::stderr_logger_mt("brainshiftd");
  logger->set_pattern("%Y-%m-%dT%H:%M:%S.%e%z %l %v");
  logger->set_level(spdlog::level::from_str(level));
  logger->flush_on(spdlog::level::info);
  spdlog::set_default_logger(std::move(logger));
}

}  // namespace brainshift::server
