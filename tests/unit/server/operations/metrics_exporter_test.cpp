// SPDX-License-Identifier: GPL-3.0-or-later
// Real scrapes, over loopback.
#include "server/operations/metrics_exporter.hpp"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "tests/unit/server/operations/exposition.hpp"

namespace brainshift::server {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

std::string exchange(int port, const std::string& request) {
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  timeval limit{10, 0};
  setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
  std::string answer;
  if (connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
      send(fd, request.data(), request.size(), MSG_NOSIGNAL) > 0) {
    std::array<char, 4096> buffer{};
    ssize_t size = 0;
    while ((size = recv(fd, buffer.data(), buffer.size(), 0)) > 0) {
      answer.append(buffer.data(), static_cast<std::size_t>(size));
    }
  }
  close(fd);
  return answer;
}

std::string scrape(int port) {
  return exchange(port, "GET /metrics HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
}

std::string body_of(const std::string& answer) {
  const std::size_t end = answer.find("\r\n\r\n");
  return end == std::string::npos ? std::string() : answer.substr(end + 4);
}

TEST(MetricsExporter, EveryScrapeMakesAReportAndIsReadable) {
  std::atomic<int> asked = 0;
  auto exporter = MetricsExporter::listen("127.0.0.1:0", [&] {
    wire::DaemonReport report;
    report.uptime_ms = static_cast<std::uint64_t>(1000 * ++asked);
    return report;
  });
  ASSERT_TRUE(exporter) << exporter.error().message;
  for (int scraped = 1; scraped <= 3; ++scraped) {
    const std::string answer = scrape(exporter->port());
    EXPECT_THAT(answer, StartsWith("HTTP/1.1 200"));
    EXPECT_THAT(answer, HasSubstr("text/plain; version=0.0.4"));
    const Exposition read = read_exposition(body_of(answer));
    EXPECT_EQ(read.value("brainshift_uptime_seconds"), scraped);
  }
  EXPECT_EQ(asked, 3);
}

TEST(MetricsExporter, APortThatIsTakenIsNamedInOneLine) {
  const auto first = MetricsExporter::listen("127.0.0.1:0", [] { return wire::DaemonReport(); });
  ASSERT_TRUE(first) << first.error().message;
  const std::string taken = "127.0.0.1:" + std::to_string(first->port());
  const auto second = MetricsExporter::listen(taken, [] { return wire::DaemonReport(); });
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(second.error().message, StartsWith("metrics.endpoint = " + taken));
  EXPECT_EQ(second.error().message.find('\n'), std::string::npos);
}

TEST(MetricsExporter, WhatIsNoAddressIsRefused) {
  for (const char* endpoint :
       {"", "9464", "127.0.0.1", "127.0.0.1:", "127.0.0.1:65536", "host:1", "127.0.0.1:1x"}) {
    EXPECT_FALSE(MetricsExporter::listen(endpoint, [] { return wire::DaemonReport(); }))
        << endpoint;
  }
}

TEST(MetricsExporter, OtherPathsAndGarbageAreNoReport) {
  std::atomic<int> asked = 0;
  auto exporter = MetricsExporter::listen("127.0.0.1:0", [&] {
    ++asked;
    return wire::DaemonReport();
  });
  ASSERT_TRUE(exporter) << exporter.error().message;
  const std::string answer = exchange(
      exporter->port(), "GET /etc/passwd HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(exchange(exporter->port(),
                       "DELETE /metrics HTTP/1.1\r\nHost: x\r\nConnection: "
                       "close\r\n\r\n"),
              StartsWith("HTTP/1.1 405"));
  exchange(exporter->port(), std::string(5000, '\xff') + "\r\n\r\n");
  EXPECT_EQ(asked, 0);
  EXPECT_THAT(scrape(exporter->port()), StartsWith("HTTP/1.1 200"));
}

TEST(MetricsExporter, MonitorsThatAskAtOnceAreAllAnswered) {
  std::atomic<int> inside = 0, most = 0;
  auto exporter = MetricsExporter::listen("127.0.0.1:0", [&] {
    most = std::max(most.load(), ++inside);
    const wire::DaemonReport report;
    --inside;
    return report;
  });
  ASSERT_TRUE(exporter) << exporter.error().message;
  std::atomic<int> answered = 0;
  {
    std::vector<std::jthread> monitors;
    for (int i = 0; i < 8; ++i) {
      monitors.emplace_back(
          [&] { answered += scrape(exporter->port()).rfind("HTTP/1.1 200", 0) == 0 ? 1 : 0; });
    }
  }
  EXPECT_EQ(answered, 8);
  EXPECT_EQ(most, 1) << "one report at a time";
}

}  // namespace
}  // namespace brainshift::server
