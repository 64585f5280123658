// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/operations/metrics_exporter.hpp"

#include <arpa/inet.h>
#include <microhttpd.h>
#include <netinet/in.h>
#include <prometheus/text_serializer.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <exception>
#include <optional>
#include <string_view>
#include <utility>

#include "server/operations/metrics.hpp"

namespace brainshift::server {
namespace {

constexpr const char* kPath = "/metrics";
constexpr const char* kFormat = "text/plain; version=0.0.4; charset=utf-8";
// Of monitors and people who look; more are refused.
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

struct MetricsExporter::Impl {
  explicit Impl(Ask asked) : ask(std::move(asked)) {}
  ~Impl() {
    if (server != nullptr) MHD_stop_daemon(server);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  Ask ask;
  MHD_Daemon* server = nullptr;
};

MetricsExporter::MetricsExporter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
MetricsExporter::MetricsExporter(MetricsExporter&&) noexcept = default;
MetricsExporter::~MetricsExporter() = default;

Result<MetricsExporter> MetricsExporter::listen(const std::string& endpoint, Ask ask) {
  const auto refuse = [&](const std::string& reason) {
    return fail(ErrorCode::kInvalidArgument, "metrics.endpoint = " + endpoint + ": " + reason);
  };
  const auto address = address_of(endpoint);
  if (!address) return refuse("must be HOST:PORT with an address in numbers");
  auto impl = std::make_unique<Impl>(std::move(ask));
  unsigned flags = MHD_USE_AUTO | MHD_USE_INTERNAL_POLLING_THREAD | MHD_USE_ITC;
  if (address->ss_family == AF_INET6) flags |= MHD_USE_IPv6;
  errno = 0;
  impl->server =
      MHD_start_daemon(flags, 0, nullptr, nullptr, &answer, &impl->ask, MHD_OPTION_SOCK_ADDR,
                       &*address, MHD_OPTION_CONNECTION_LIMIT, kMaxConnections,
                       MHD_OPTION_CONNECTION_TIMEOUT, kIdleLimit_s, MHD_OPTION_END);
  if (impl->server == nullptr) {
    return refuse(std::string("nothing can listen there: ") + std::strerror(errno));
  }
  return MetricsExporter(std::move(impl));
}

int MetricsExporter::port() const {
  const MHD_DaemonInfo* info = MHD_get_daemon_info(impl_->server, MHD_DAEMON_INFO_BIND_PORT);
  return info == nullptr ? 0 : info->port;
}

}  // namespace brainshift::server
