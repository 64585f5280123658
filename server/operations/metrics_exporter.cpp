// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/operations/metrics_exporter.hpp"

#include <prometheus/collectable.h>
#include <prometheus/exposer.h>

#include <cerrno>
#include <cstring>
#include <exception>
#include <mutex>
#include <utility>
#include <vector>

#include "server/operations/metrics.hpp"

namespace brainshift::server {
namespace {

class Reported final : public prometheus::Collectable {
 public:
  explicit Reported(MetricsExporter::Ask ask) : ask_(std::move(ask)) {}
  std::vector<prometheus::MetricFamily> Collect() const override {
    const std::lock_guard lock(mutex_);
    return metric_families(ask_());
  }

 private:
  MetricsExporter::Ask ask_;
  mutable std::mutex mutex_;
};

}  // namespace

struct MetricsExporter::Impl {
  // One monitor and one person; more wait.
  static constexpr std::size_t kThreads = 2;

  Impl(const std::string& endpoint, Ask ask)
      : reported(std::make_shared<Reported>(std::move(ask))), exposer(endpoint, kThreads) {
    exposer.RegisterCollectable(reported);
  }

  std::shared_ptr<Reported> reported;
  prometheus::Exposer exposer;  // ends first
};

MetricsExporter::MetricsExporter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
MetricsExporter::MetricsExporter(MetricsExporter&&) noexcept = default;
MetricsExporter::~MetricsExporter() = default;

Result<MetricsExporter> MetricsExporter::listen(const std::string& endpoint, Ask ask) {
  errno = 0;
  try {
    return MetricsExporter(std::make_unique<Impl>(endpoint, std::move(ask)));
  } catch (const std::exception&) {  // of the web server; it only says that it could not start
    const int reason = errno;
    std::string message = "metrics.endpoint = " + endpoint + ": nothing can listen there";
    if (reason != 0) message += std::string(": ") + std::strerror(reason);
    return fail(ErrorCode::kInvalidArgument, message);
  }
}

int MetricsExporter::port() const {
  const std::vector<int> ports = impl_->exposer.GetListeningPorts();
  return ports.empty() ? 0 : ports.front();
}

}  // namespace brainshift::server
