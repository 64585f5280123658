// SPDX-License-Identifier: GPL-3.0-or-later
// MetricsExporter: answers monitors over HTTP, on one thread of its own, with the figures of a
// report that is made when they ask.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/core/error.hpp"
#include "common/wire/report.hpp"

namespace brainshift::server {

class MetricsExporter {
 public:
  using Ask = std::function<wire::DaemonReport()>;

  // Serves http://HOST:PORT/metrics from here on; HOST is an address in numbers or localhost, port
  // 0 picks a free one. `ask` is called on the exporter's thread. kInvalidArgument when that is no
  // address, or nothing can listen there.
  static Result<MetricsExporter> listen(const std::string& endpoint, Ask ask);
  MetricsExporter(MetricsExporter&&) noexcept;
  MetricsExporter& operator=(MetricsExporter&&) = delete;
  ~MetricsExporter();

  int port() const;

 private:
  struct Impl;
  explicit MetricsExporter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace brainshift::server
