// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/view/http_server.hpp"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <list>

#include "client/tools/view/site.hpp"
#include "tests/support/results.hpp"

namespace brainshift::client {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

// A connection that reads until a text has come, or the peer closes.
class Browser {
 public:
  explicit Browser(int port) : fd_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const timeval most{20, 0};
    setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &most, sizeof most);
    EXPECT_EQ(connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;
  ~Browser() { close(fd_); }

  void send(const std::string& text) {
    EXPECT_EQ(::send(fd_, text.data(), text.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(text.size()));
  }
  std::string read_until(const std::string& sign) {
    while (got_.find(sign) == std::string::npos) {
      char buffer[4096];
      const ssize_t count = recv(fd_, buffer, sizeof buffer, 0);
      if (count <= 0) break;
      got_.append(buffer, static_cast<std::size_t>(count));
    }
    return got_;
  }

 private:
  int fd_;
  std::string got_;
};

std::string request(const std::string& line, const std::string& host = "localhost") {
  return line + " HTTP/1.1\r\nHost: " + host + "\r\nConnection: close\r\n\r\n";
}
std::string exchange(int port, const std::string& text) {
  Browser browser(port);
  browser.send(text);
  return browser.read_until("never");
}
const std::string kEvents = "GET /events HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n";

struct Served {
  Site site;
  HttpServer server = HttpServer::listen({"127.0.0.1", 0}, site.source()).value();
  int port() const { return server.port(); }
};

TEST(HttpServer, ServesThePageThatMayLoadNothingFromElsewhere) {
  Served served;
  const std::string page = exchange(served.port(), request("GET /"));
  EXPECT_THAT(page, StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(page, HasSubstr("Content-Type: text/html; charset=utf-8"));
  EXPECT_THAT(page, HasSubstr("default-src 'none'; script-src 'self'"));
  EXPECT_THAT(page, HasSubstr("frame-ancestors 'none'"));
  EXPECT_THAT(page, HasSubstr("Cache-Control: no-store"));
  EXPECT_THAT(page, HasSubstr("</html>"));
  EXPECT_THAT(page, Not(HasSubstr("://")));  // no address of another place
  EXPECT_THAT(exchange(served.port(), request("GET /page.js")), HasSubstr("EventSource"));
  EXPECT_THAT(exchange(served.port(), request("GET /page.css")), HasSubstr("text/css"));
  EXPECT_THAT(exchange(served.port(), request("GET /../etc/passwd")), StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(exchange(served.port(), request("GET /field")), StartsWith("HTTP/1.1 404"));
}

TEST(HttpServer, TakesNothing) {
  Served served;
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "HEAD"}) {
    const std::string answer = exchange(served.port(), request(std::string(method) + " /"));
    EXPECT_THAT(answer, StartsWith("HTTP/1.1 405")) << method;
    EXPECT_THAT(answer, HasSubstr("Allow: GET")) << method;
  }
}

TEST(HttpServer, AnswersNamesOfThisComputerAlone) {
  Served served;
  for (const std::string host : {"localhost", "127.0.0.1", "[::1]", "localhost:9", "[::1]:8080"}) {
    EXPECT_THAT(exchange(served.port(), request("GET /", host)), StartsWith("HTTP/1.1 200"))
        << host;
  }
  for (const std::string host : {"evil.example", "localhost.evil.example", "127.0.0.1.evil:80", "",
                                 "localhost:80evil", "localhost:", "[::1"}) {
    const std::string answer = exchange(served.port(), request("GET /", host));
    EXPECT_THAT(answer, StartsWith("HTTP/1.1 403")) << host;
    EXPECT_THAT(answer, Not(HasSubstr("<html"))) << host;
  }
  EXPECT_THAT(exchange(served.port(), "GET /events HTTP/1.0\r\n\r\n"), HasSubstr(" 403 "));
}

TEST(HttpServer, AStreamGetsTheNewestEventAndNoneTwice) {
  Served served;
  served.site.publish("one");
  served.site.publish("two");
  Browser browser(served.port());
  browser.send(kEvents);
  const std::string first = browser.read_until("data: two\n\n");
  EXPECT_THAT(first, HasSubstr("Content-Type: text/event-stream"));
  EXPECT_THAT(first, Not(HasSubstr("data: one")));
  served.site.publish("three");
  const std::string all = browser.read_until("data: three\n\n");
  EXPECT_EQ(all.find("data: two"), all.rfind("data: two"));
}

TEST(HttpServer, SixteenWatchAndALeaverMakesRoom) {
  Served served;
  served.site.publish("first");
  std::list<Browser> viewers;
  for (int i = 0; i < HttpServer::kMaxViewers; ++i) {
    viewers.emplace_back(served.port()).send(kEvents);
    ASSERT_THAT(viewers.back().read_until("first\n\n"), HasSubstr("data: first")) << i;
  }
  EXPECT_THAT(
      exchange(served.port(), kEvents.substr(0, kEvents.size() - 2) + "Connection: close\r\n\r\n"),
      HasSubstr(" 503 "));
  EXPECT_THAT(exchange(served.port(), request("GET /")), HasSubstr(" 200 "));
  viewers.pop_front();
  // Its end is noticed when something is sent.
  std::string answer;
  for (int i = 0; i < 1000 && answer.find(" 200 ") == std::string::npos; ++i) {
    served.site.publish("again");
    Browser browser(served.port());
    browser.send(kEvents);
    answer = browser.read_until("\r\n\r\n");
  }
  EXPECT_THAT(answer, HasSubstr(" 200 "));
}

TEST(HttpServer, EndsWhileStreamsAreOpen) {
  auto served = std::make_unique<Served>();
  Browser browser(served->port());
  browser.send(kEvents);
  browser.read_until("\r\n\r\n");
  served.reset();
  EXPECT_THAT(browser.read_until("never"), Not(HasSubstr("data: ")));
}

TEST(HttpServer, RefusesEveryAddressButLoopback) {
  for (const char* host : {"0.0.0.0", "192.0.2.1", "::", "example.org"}) {
    Site site;
    const auto server = HttpServer::listen({host, 0}, site.source());
    EXPECT_THAT(refusal_of(server, ErrorCode::kInvalidArgument),
                HasSubstr("the page has no keys, so it is for this computer alone"))
        << host;
  }
}

TEST(HttpServer, ATakenPortIsNamed) {
  Served served;
  Site site;
  const Address taken{"127.0.0.1", static_cast<std::uint16_t>(served.port())};
  EXPECT_THAT(refusal_of(HttpServer::listen(taken, site.source()), ErrorCode::kUnavailable),
              StartsWith(to_string(taken) + ": nothing can listen there"));
}

}  // namespace
}  // namespace brainshift::client
