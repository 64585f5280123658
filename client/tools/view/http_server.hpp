// SPDX-License-Identifier: GPL-3.0-or-later
// HttpServer: hands pages and a stream of events to browsers of this computer, and takes nothing.
//
// Only GET is answered (405). A Host header that is no name of this computer is refused (403): a
// page of another site whose name is made to lead here (DNS rebinding) would read the patient's
// data.
// Nothing is cached, framed, or readable from another origin; the content may load nothing from
// elsewhere (Content-Security-Policy). There is no encryption and there are no passwords: it
// listens on loopback alone.
//
// Events are server-sent events (text/event-stream, WHATWG HTML): "data: TEXT". Each of at most
// kMaxViewers streams gets the newest event there is, never one that a newer has replaced; one more
// is refused (503). A stream never repeats an event by itself: what a viewer hears is as alive as
// the thread that publishes.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "client/tools/bridge/socket.hpp"
#include "common/core/error.hpp"

namespace brainshift::client {

struct HttpAnswer {
  std::string type;                         // Content-Type
  std::shared_ptr<const std::string> body;  // shared by all who ask
  std::string of;                           // header "Of": what the body belongs to; or empty
};

struct HttpEvent {
  std::uint64_t number = 0;  // counts up
  std::string data;          // one line
};

// Called on the server's threads, several at once.
struct HttpSource {
  // What lies at a path; nullopt: nothing (404).
  std::function<std::optional<HttpAnswer>(std::string_view path)> get;
  // The newest event when it is newer than `after`; waits for one up to `most`.
  std::function<std::optional<HttpEvent>(std::uint64_t after, std::chrono::milliseconds most)> wait;
};

class HttpServer {
 public:
  static constexpr int kMaxViewers = 16;
  static constexpr const char* kEventsPath = "/events";

  // Serves from here on; port 0 picks a free one. kInvalidArgument: the address is not loopback,
  // or none of this computer; kUnavailable: the port is taken. The sentence names the address.
  static Result<HttpServer> listen(const Address& address, HttpSource source);
  HttpServer(HttpServer&&) noexcept;
  HttpServer& operator=(HttpServer&&) = delete;
  ~HttpServer();  // ends all streams

  int port() const;

 private:
  struct Impl;
  explicit HttpServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace brainshift::client
