// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/operations/metrics.hpp"

#include <arpa/inet.h>
#include <microhttpd.h>
#include <netinet/in.h>
#include <prometheus/metric_family.h>
#include <prometheus/text_serializer.h>
#include <sys/socket.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <exception>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include "common/core/text.hpp"

namespace brainshift::server {
namespace {

using prometheus::ClientMetric;
using prometheus::MetricFamily;
using prometheus::MetricType;
using Labels = std::vector<ClientMetric::Label>;

MetricFamily family(MetricType type, std::string_view name, std::string_view help) {
  MetricFamily result;
  result.name = "brainshift_" + std::string(name);
  result.help = help;
  result.type = type;
  return result;
}

void add(MetricFamily& family, double value, Labels labels = {}) {
  ClientMetric& metric = family.metric.emplace_back();
  for (auto& label : labels) label.value = one_line(label.value, '?');
  metric.label = std::move(labels);
  (family.type == MetricType::Counter ? metric.counter.value : metric.gauge.value) = value;
}

double number(std::uint64_t count) { return static_cast<double>(count); }

// All families of one report.
class Families {
 public:
  void gauge(std::string_view name, double value, std::string_view help) {
    add(open(MetricType::Gauge, name, help), value);
  }
  void counter(std::string_view name, double value, std::string_view help) {
    add(open(MetricType::Counter, name, help), value);
  }
  MetricFamily& open(MetricType type, std::string_view name, std::string_view help) {
    return families_.emplace_back(family(type, name, help));
  }
  void put(MetricFamily family) { families_.push_back(std::move(family)); }
  std::vector<MetricFamily> take() { return std::move(families_); }

 private:
  std::vector<MetricFamily> families_;
};

void add_daemon(Families& out, const wire::DaemonReport& report) {
  add(out.open(MetricType::Gauge, "build_info",
               "Always 1; the labels name version, build and machine."),
      1.0, {{"version", report.version}, {"build", report.build}, {"machine", report.machine}});
  out.gauge("uptime_seconds", 1e-3 * number(report.uptime_ms), "Since the daemon started.");
  out.gauge("model_ready", report.model_ready, "1: a model is loaded.");
  out.gauge("worker_busy_seconds", 1e-3 * report.working_ms,
            "Since the worker began its job; 0: it is idle.");
  out.gauge("worker_hangs", report.worker_hangs(),
            "1: the worker is busy for longer than its job may take.");
  out.counter("log_lines_lost_total", number(report.log_lines_lost),
              "Log lines dropped because their reader did not keep up.");
}

void add_session(Families& out, const wire::DaemonReport& report) {
  MetricFamily& phase = out.open(MetricType::Gauge, "session_phase", "1 for the current phase.");
  for (int i = 0; i <= static_cast<int>(SessionPhase::kClosed); ++i) {
    const auto candidate = static_cast<SessionPhase>(i);
    add(phase, candidate == report.session.phase, {{"phase", std::string(to_string(candidate))}});
  }
  if (report.session.newest_usable > 0) {
    out.gauge("field_age_seconds", 1e-3 * report.session.age_ms,
              "Since the data of the newest usable field were acquired.");
    out.gauge("field_aged", static_cast<int>(report.session.age_of(report.session.age_ms)),
              "0: within the limits of its age; 1: aged; 2: expired, not to be shown.");
  }
  MetricFamily& updates =
      out.open(MetricType::Counter, "updates_total", "Final updates, by result.");
  add(updates, number(report.usable), {{"result", "usable"}});
  add(updates, number(report.unusable), {{"result", "unusable"}});
  add(updates, number(report.failures), {{"result", "failed"}});
  out.counter("updates_late_total", number(report.late),
              "Updates that took more than twice what is usual in their session.");
  out.counter("iterates_total", number(report.iterates), "Intermediate iterates published.");
}

void add_sources(Families& out, const wire::DaemonReport& report) {
  MetricFamily received = family(MetricType::Counter, "observations_received_total",
                                 "Observation messages, by source; empty: not known.");
  MetricFamily outcome =
      family(MetricType::Counter, "observations_total", "Observations by source and outcome.");
  MetricFamily waiting = family(MetricType::Gauge, "observations_waiting",
                                "Accepted and not yet answered, replaced or skipped.");
  MetricFamily age = family(MetricType::Gauge, "observation_age_seconds",
                            "Since the source's last observation arrived.");
  for (const wire::SourceCounts& counts : report.sources) {
    const ClientMetric::Label source{"source", counts.source};
    add(received, number(counts.received), {source});
    const std::pair<const char*, std::uint64_t> outcomes[] = {
        {"answered", counts.answered}, {"failed", counts.failed},   {"replaced", counts.replaced},
        {"skipped", counts.skipped},   {"refused", counts.refused}, {"repeated", counts.repeated}};
    for (const auto& [name, count] : outcomes) {
      add(outcome, number(count), {source, {"outcome", name}});
    }
    add(waiting, number(counts.waiting), {source});
    add(age, 1e-3 * counts.age_ms, {source});
  }
  for (MetricFamily* filled : {&received, &outcome, &waiting, &age}) {
    if (!filled->metric.empty()) out.put(std::move(*filled));
  }
}

void add_viewers(Families& out, const wire::DaemonReport& report) {
  out.gauge("clients", report.clients, "Connected, viewers among them.");
  out.gauge("viewers", number(report.viewers.size()), "Subscribers.");
  std::uint64_t behind = 0;
  for (const wire::ViewerFigures& viewer : report.viewers) behind += viewer.owed > 0 ? 1 : 0;
  out.gauge("viewers_behind", number(behind), "Subscribers to whom an update is owed.");
}

void add_door(Families& out, const wire::DoorFigures& door) {
  out.counter("connections_accepted_total", number(door.accepted), "Connections accepted.");
  MetricFamily& closed = out.open(MetricType::Counter, "connections_closed_total",
                                  "Connections that the daemon closed, by reason.");
  add(closed, number(door.closed_for_breach), {{"reason", "breach"}});
  add(closed, number(door.closed_for_memory), {{"reason", "memory"}});
  add(closed, number(door.closed_for_silence), {{"reason", "silence"}});
  add(closed, number(door.closed_for_room), {{"reason", "room"}});
  MetricFamily& refused = out.open(MetricType::Counter, "refusals_total",
                                   "Handshakes, connections and requests refused, by reason.");
  add(refused, number(door.unknown_keys), {{"reason", "unknown_key"}});
  add(refused, number(door.refused_role), {{"reason", "role"}});
  add(refused, number(door.refused_connections), {{"reason", "connections"}});
  add(refused, number(door.refused_observations), {{"reason", "observations"}});
  add(refused, number(door.refused_starts), {{"reason", "session_starts"}});
  out.gauge("held_bytes", number(door.held_bytes), "Messages of peers that are under way.");
}

// The buckets are cumulative here.
ClientMetric::Histogram histogram_of(const wire::StageLatency& stage,
                                     const std::vector<double>& bounds_ms) {
  ClientMetric::Histogram histogram;
  histogram.sample_count = stage.all.count;
  histogram.sample_sum = 1e-3 * stage.sum_ms;
  std::uint64_t cumulative = 0;
  for (std::size_t i = 0; i < stage.bucket_counts.size(); ++i) {
    cumulative += stage.bucket_counts[i];
    const bool bounded = i < bounds_ms.size();
    const double bound_s = bounded ? bounds_ms[i] / 1e3 : std::numeric_limits<double>::infinity();
    histogram.bucket.push_back({cumulative, bound_s});
  }
  return histogram;
}

void add_stages(Families& out, const wire::DaemonReport& report) {
  MetricFamily all = family(MetricType::Histogram, "stage_seconds",
                            "Stages of the updates with an estimate; total: from the arrival of "
                            "the observation to publication.");
  MetricFamily recent = family(MetricType::Gauge, "stage_recent_seconds",
                               "The same over the last updates: exact percentiles and maximum.");
  for (const wire::StageLatency& stage : report.stages) {
    ClientMetric& metric = all.metric.emplace_back();
    metric.label = {{"stage", stage.stage}};
    metric.histogram = histogram_of(stage, report.bounds_ms);
    if (stage.recent.count == 0) continue;
    const std::pair<const char*, double> figures[] = {{"p50", stage.recent.p50_ms},
                                                      {"p95", stage.recent.p95_ms},
                                                      {"p99", stage.recent.p99_ms},
                                                      {"max", stage.recent.max_ms}};
    for (const auto& [name, milliseconds] : figures) {
      add(recent, 1e-3 * milliseconds, {{"stage", stage.stage}, {"figure", name}});
    }
  }
  out.put(std::move(all));
  if (!recent.metric.empty()) out.put(std::move(recent));
}

void add_journal(Families& out, const wire::DaemonReport& report) {
  out.gauge("journal_configured", report.journal.has_value(), "1: the daemon keeps a journal.");
  if (!report.journal) return;
  out.gauge("journal_recording", report.journal->recording, "1: what is accepted will be written.");
  out.gauge("journal_bytes", number(report.journal->bytes), "The file and its write-ahead log.");
  out.gauge("journal_records", number(report.journal->records), "Of the session, on the disk.");
  out.gauge("journal_lost_records", number(report.journal->lost),
            "Observations and updates of the session that no file holds.");
}

void add_process(Families& out, const wire::ProcessFigures& process) {
  out.gauge("resident_memory_bytes", number(process.resident_bytes), "Resident memory.");
  out.gauge("peak_memory_bytes", number(process.peak_bytes), "Greatest resident memory so far.");
  out.gauge("open_descriptors", number(process.descriptors), "Open file descriptors.");
  out.gauge("max_descriptors", number(process.descriptor_limit), "Limit of open descriptors.");
  out.gauge("threads", number(process.threads), "Threads.");
}

constexpr const char* kPath = "/metrics";
constexpr const char* kFormat = "text/plain; version=0.0.4; charset=utf-8";
// Of monitors and people who look. One more, and the oldest is closed: it has had its answer, or
// sends its question byte by byte.
constexpr unsigned kMaxConnections = 16;
constexpr unsigned kIdleLimit_s = 10;

// HOST:PORT as the system writes it; none when it is not of that form.
std::optional<sockaddr_storage> address_of(const std::string& endpoint) {
  const std::size_t colon = endpoint.rfind(':');
  if (colon == std::string::npos) return std::nullopt;
  std::string host = endpoint.substr(0, colon);
  if (host == "localhost") host = "127.0.0.1";
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
  }
  std::uint16_t port = 0;
  const char* const end = endpoint.data() + endpoint.size();
  const auto [stop, error] = std::from_chars(endpoint.data() + colon + 1, end, port);
  if (error != std::errc() || stop != end) return std::nullopt;
  sockaddr_storage address{};
  auto& v4 = reinterpret_cast<sockaddr_in&>(address);
  auto& v6 = reinterpret_cast<sockaddr_in6&>(address);
  if (inet_pton(AF_INET, host.c_str(), &v4.sin_addr) == 1) {
    v4.sin_family = AF_INET;
    v4.sin_port = htons(port);
  } else if (inet_pton(AF_INET6, host.c_str(), &v6.sin6_addr) == 1) {
    v6.sin6_family = AF_INET6;
    v6.sin6_port = htons(port);
  } else {
    return std::nullopt;
  }
  return address;
}

MHD_Result respond(MHD_Connection* connection, unsigned status, const std::string& text) {
  // The library copies the text; it does not write to it.
  MHD_Response* response = MHD_create_response_from_buffer(
      text.size(), const_cast<char*>(text.data()), MHD_RESPMEM_MUST_COPY);
  if (response == nullptr) return MHD_NO;
  MHD_add_response_header(response, MHD_HTTP_HEADER_CONTENT_TYPE, kFormat);
  const MHD_Result queued = MHD_queue_response(connection, status, response);
  MHD_destroy_response(response);
  return queued;
}

// The sockets of the connections, the oldest first; of the server's one thread. Called by C code:
// there is room for every one.
void count_connection(void* all, MHD_Connection* connection, void**,
                      MHD_ConnectionNotificationCode code) {
  auto& open = *static_cast<std::vector<int>*>(all);
  const int fd = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD)->connect_fd;
  if (code == MHD_CONNECTION_NOTIFY_CLOSED) {
    std::erase(open, fd);
    return;
  }
  open.push_back(fd);
  if (open.size() <= kMaxConnections) return;
  shutdown(open.front(), SHUT_RDWR);  // the server then closes it
  open.erase(open.begin());
}

// Called by C code: nothing may be thrown.
MHD_Result answer(void* ask, MHD_Connection* connection, const char* path, const char* method,
                  const char*, const char*, std::size_t*, void**) {
  try {
    if (std::string_view(path) != kPath) {
      return respond(connection, MHD_HTTP_NOT_FOUND, "the figures are at /metrics\n");
    }
    if (std::string_view(method) != MHD_HTTP_METHOD_GET) {
      return respond(connection, MHD_HTTP_METHOD_NOT_ALLOWED, "GET alone\n");
    }
    const wire::DaemonReport report = (*static_cast<MetricsExporter::Ask*>(ask))();
    const prometheus::TextSerializer serializer;
    return respond(connection, MHD_HTTP_OK, serializer.Serialize(metric_families(report)));
  } catch (const std::exception&) {
    return MHD_NO;  // closes the connection
  }
}

}  // namespace

std::vector<MetricFamily> metric_families(const wire::DaemonReport& report) {
  Families out;
  add_daemon(out, report);
  add_session(out, report);
  add_sources(out, report);
  add_viewers(out, report);
  add_door(out, report.door);
  add_stages(out, report);
  add_journal(out, report);
  add_process(out, report.process);
  return out.take();
}

struct MetricsExporter::Impl {
  Ask ask;
  std::vector<int> open;                                           // sockets
  std::unique_ptr<MHD_Daemon, decltype(&MHD_stop_daemon)> server;  // the last: it calls `ask`
};

MetricsExporter::MetricsExporter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
MetricsExporter::MetricsExporter(MetricsExporter&&) noexcept = default;
MetricsExporter::~MetricsExporter() = default;

Result<MetricsExporter> MetricsExporter::listen(const std::string& endpoint, Ask ask) {
  const auto refuse = [&](const std::string& reason) {
    return invalid("metrics.endpoint = " + endpoint + ": " + reason);
  };
  const auto address = address_of(endpoint);
  if (!address) return refuse("must be HOST:PORT with an address in numbers");
  auto impl = std::make_unique<Impl>(Impl{std::move(ask), {}, {nullptr, &MHD_stop_daemon}});
  impl->open.reserve(2 * kMaxConnections);
  unsigned flags = MHD_USE_AUTO | MHD_USE_INTERNAL_POLLING_THREAD | MHD_USE_ITC;
  if (address->ss_family == AF_INET6) flags |= MHD_USE_IPv6;
  errno = 0;
  impl->server.reset(MHD_start_daemon(
      flags, 0, nullptr, nullptr, &answer, &impl->ask, MHD_OPTION_SOCK_ADDR, &*address,
      MHD_OPTION_CONNECTION_LIMIT, 2 * kMaxConnections, MHD_OPTION_CONNECTION_TIMEOUT, kIdleLimit_s,
      MHD_OPTION_NOTIFY_CONNECTION, &count_connection, &impl->open, MHD_OPTION_END));
  if (impl->server == nullptr) {
    return refuse(std::string("nothing can listen there: ") + std::strerror(errno));
  }
  return MetricsExporter(std::move(impl));
}

int MetricsExporter::port() const {
  const MHD_DaemonInfo* info = MHD_get_daemon_info(impl_->server.get(), MHD_DAEMON_INFO_BIND_PORT);
  return info == nullptr ? 0 : info->port;
}

}  // namespace brainshift::server
