// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/view/http_server.hpp"

#include <arpa/inet.h>
#include <microhttpd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <exception>
#include <utility>

namespace brainshift::client {
namespace {

// Streams, and what each viewer fetches beside its stream.
constexpr unsigned kMaxConnections = 4 * HttpServer::kMaxViewers;
constexpr unsigned kIdleLimit_s = 10;
constexpr std::chrono::milliseconds kTurn{200};  // how soon a stream notices that the server ends

constexpr std::pair<const char*, const char*> kHeaders[] = {
    {"Content-Security-Policy",
     "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
     "img-src 'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"},
    {"X-Content-Type-Options", "nosniff"},
    {"X-Frame-Options", "DENY"},
    {"Cross-Origin-Resource-Policy", "same-origin"},
    {"Cross-Origin-Opener-Policy", "same-origin"},
    {"Referrer-Policy", "no-referrer"},
    {"Cache-Control", "no-store"}};

// Whether a Host header names this computer: with any port, as a tunnel (ssh -L) may have another.
bool names_this_computer(const char* header) {
  if (header == nullptr) return false;
  std::string_view host = header;
  const std::size_t bracket = host.find(']');
  const std::size_t colon = host.find(':', bracket == std::string_view::npos ? 0 : bracket);
  if (colon != std::string_view::npos) {
    const std::string_view port = host.substr(colon + 1);
    const bool digits = !port.empty() && std::all_of(port.begin(), port.end(),
                                                     [](char c) { return c >= '0' && c <= '9'; });
    if (!digits) return false;
    host = host.substr(0, colon);
  }
  return host == "localhost" || host == "127.0.0.1" || host == "[::1]";
}

MHD_Result send(MHD_Connection* connection, unsigned status, MHD_Response* response,
                const std::string& type) {
  if (response == nullptr) return MHD_NO;
  for (const auto& [name, value] : kHeaders) MHD_add_response_header(response, name, value);
  MHD_add_response_header(response, MHD_HTTP_HEADER_CONTENT_TYPE, type.c_str());
  if (status == MHD_HTTP_METHOD_NOT_ALLOWED) {
    MHD_add_response_header(response, MHD_HTTP_HEADER_ALLOW, MHD_HTTP_METHOD_GET);
  }
  const MHD_Result queued = MHD_queue_response(connection, status, response);
  MHD_destroy_response(response);
  return queued;
}

MHD_Result refuse(MHD_Connection* connection, unsigned status, const std::string& sentence) {
  return send(connection, status,
              MHD_create_response_from_buffer(sentence.size(),
                                              const_cast<char*>(sentence.data()),  // is copied
                                              MHD_RESPMEM_MUST_COPY),
              "text/plain; charset=utf-8");
}

// A body that stays alive until it is sent.
using Body = std::shared_ptr<const std::string>;
ssize_t read_body(void* body, std::uint64_t from, char* buffer, std::size_t most) {
  const std::string& bytes = **static_cast<Body*>(body);
  const std::size_t count = std::min(most, bytes.size() - static_cast<std::size_t>(from));
  if (count == 0) return MHD_CONTENT_READER_END_OF_STREAM;
  std::memcpy(buffer, bytes.data() + from, count);
  return static_cast<ssize_t>(count);
}
void free_body(void* body) { delete static_cast<Body*>(body); }

}  // namespace

struct HttpServer::Impl {
  HttpSource source;
  std::atomic<int> streams = 0;
  std::atomic<bool> ending = false;
  std::unique_ptr<MHD_Daemon, decltype(&MHD_stop_daemon)> server{nullptr, &MHD_stop_daemon};

  ~Impl() {
    ending = true;
    server.reset();
  }

  struct Stream {
    Impl& server;
    std::uint64_t newest = 0;
    std::string rest;  // of an event, still to be sent

    explicit Stream(Impl& of) : server(of) {}
    ~Stream() { --server.streams; }
  };

  static ssize_t read_stream(void* of, std::uint64_t, char* buffer, std::size_t most);
  static void free_stream(void* stream) { delete static_cast<Stream*>(stream); }
  static MHD_Result answer(void* self, MHD_Connection* connection, const char* path,
                           const char* method, const char*, const char*, std::size_t*, void**);
  MHD_Result answer_get(MHD_Connection* connection, std::string_view path);
};

// Called by C code, as answer() is: nothing may be thrown.
ssize_t HttpServer::Impl::read_stream(void* of, std::uint64_t, char* buffer, std::size_t most) try {
  auto& stream = *static_cast<Stream*>(of);
  // A comment now and then shows whether anybody still listens.
  for (int turn = 0; stream.rest.empty(); ++turn) {
    if (stream.server.ending) return MHD_CONTENT_READER_END_OF_STREAM;
    if (turn == 5) stream.rest = ":\n\n";
    if (auto event = stream.server.source.wait(stream.newest, kTurn)) {
      stream.newest = event->number;
      stream.rest = "data: " + event->data + "\n\n";
    }
  }
  const std::size_t count = std::min(most, stream.rest.size());
  std::memcpy(buffer, stream.rest.data(), count);
  stream.rest.erase(0, count);
  return static_cast<ssize_t>(count);
} catch (const std::exception&) {
  return MHD_CONTENT_READER_END_WITH_ERROR;
}

MHD_Result HttpServer::Impl::answer_get(MHD_Connection* connection, std::string_view path) {
  if (path == kEventsPath) {
    if (++streams > kMaxViewers) {
      --streams;
      return refuse(connection, MHD_HTTP_SERVICE_UNAVAILABLE, "16 viewers watch already\n");
    }
    auto stream = std::make_unique<Stream>(*this);
    MHD_Response* response = MHD_create_response_from_callback(
        MHD_SIZE_UNKNOWN, std::size_t{1} << 16, &read_stream, stream.get(), &free_stream);
    if (response != nullptr) (void)stream.release();
    return send(connection, MHD_HTTP_OK, response, "text/event-stream");
  }
  const auto found = source.get(path);
  if (!found) return refuse(connection, MHD_HTTP_NOT_FOUND, "nothing is here\n");
  auto body = std::make_unique<Body>(found->body);
  MHD_Response* response = MHD_create_response_from_callback(
      found->body->size(), std::size_t{1} << 18, &read_body, body.get(), &free_body);
  if (response == nullptr) return MHD_NO;
  (void)body.release();
  if (!found->of.empty()) MHD_add_response_header(response, "Of", found->of.c_str());
  return send(connection, MHD_HTTP_OK, response, found->type);
}

MHD_Result HttpServer::Impl::answer(void* self, MHD_Connection* connection, const char* path,
                                    const char* method, const char*, const char*, std::size_t*,
                                    void**) {
  try {
    if (std::string_view(method) != MHD_HTTP_METHOD_GET) {
      return refuse(connection, MHD_HTTP_METHOD_NOT_ALLOWED, "GET alone\n");
    }
    const char* host =
        MHD_lookup_connection_value(connection, MHD_HEADER_KIND, MHD_HTTP_HEADER_HOST);
    if (!names_this_computer(host)) {
      return refuse(connection, MHD_HTTP_FORBIDDEN, "only for this computer: use localhost\n");
    }
    return static_cast<Impl*>(self)->answer_get(connection, path);
  } catch (const std::exception&) {
    return MHD_NO;  // closes the connection
  }
}

HttpServer::HttpServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
HttpServer::HttpServer(HttpServer&&) noexcept = default;
HttpServer::~HttpServer() = default;

Result<HttpServer> HttpServer::listen(const Address& address, HttpSource source) {
  const std::string name = to_string(address);
  if (!is_loopback(address)) {
    return invalid(name +
                   ": the page has no keys, so it is for this computer alone, 127.0.0.1 or [::1]; "
                   "from another one: ssh -L 8080:127.0.0.1:8080 HOST");
  }
  sockaddr_storage at{};
  auto& v4 = reinterpret_cast<sockaddr_in&>(at);
  auto& v6 = reinterpret_cast<sockaddr_in6&>(at);
  const std::string host = address.host == "localhost" ? "127.0.0.1" : address.host;
  unsigned flags =
      MHD_USE_INTERNAL_POLLING_THREAD | MHD_USE_THREAD_PER_CONNECTION | MHD_USE_POLL | MHD_USE_ITC;
  if (inet_pton(AF_INET, host.c_str(), &v4.sin_addr) == 1) {
    v4.sin_family = AF_INET;
    v4.sin_port = htons(address.port);
  } else if (inet_pton(AF_INET6, host.c_str(), &v6.sin6_addr) == 1) {
    v6.sin6_family = AF_INET6;
    v6.sin6_port = htons(address.port);
    flags |= MHD_USE_IPv6;
  } else {
    return invalid(name + ": must be an address in numbers, or localhost");
  }
  auto impl = std::make_unique<Impl>();
  impl->source = std::move(source);
  errno = 0;
  impl->server.reset(MHD_start_daemon(flags, 0, nullptr, nullptr, &Impl::answer, impl.get(),
                                      MHD_OPTION_SOCK_ADDR, &at, MHD_OPTION_CONNECTION_LIMIT,
                                      kMaxConnections, MHD_OPTION_CONNECTION_TIMEOUT, kIdleLimit_s,
                                      MHD_OPTION_END));
  if (impl->server == nullptr) {
    const bool taken = errno == EADDRINUSE;
    return fail(taken ? ErrorCode::kUnavailable : ErrorCode::kInvalidArgument,
                name + ": nothing can listen there: " + std::strerror(errno));
  }
  return HttpServer(std::move(impl));
}

int HttpServer::port() const {
  const MHD_DaemonInfo* info = MHD_get_daemon_info(impl_->server.get(), MHD_DAEMON_INFO_BIND_PORT);
  return info == nullptr ? 0 : info->port;
}

}  // namespace brainshift::client
