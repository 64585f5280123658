// SPDX-License-Identifier: GPL-3.0-or-later
// The figures of a DaemonReport for monitors, and MetricsExporter, which answers them over HTTP.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/wire/report.hpp"

namespace prometheus {
struct MetricFamily;
}

namespace brainshift::server {

// Metric families: names with their units, HELP and TYPE, as monitors that scrape expect them
// (docs/operations.md lists them). Times are seconds, sizes bytes; a name that ends in _total only
// grows until the daemon ends.
std::vector<prometheus::MetricFamily> metric_families(const wire::DaemonReport& report);

// On one thread of its own, with a report that is made when a monitor asks.
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
