// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/config/daemon_file.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>

#include <charconv>

#include "common/io/config/key_reader.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

// HOST of tcp://HOST:PORT, without the brackets of IPv6; empty when that is not the form.
std::string tcp_host(const std::string& endpoint) {
  const std::string scheme = "tcp://";
  const std::size_t colon = endpoint.rfind(':');
  if (endpoint.rfind(scheme, 0) != 0 || colon <= scheme.size() || colon + 1 >= endpoint.size()) {
    return {};
  }
  std::string host = endpoint.substr(scheme.size(), colon - scheme.size());
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
  }
  return host;
}

// Only what is certain: an interface's or a machine's name may mean any address.
bool is_loopback(const std::string& host) {
  if (host == "localhost" || host == "lo") return true;
  in_addr v4{};
  if (inet_pton(AF_INET, host.c_str(), &v4) == 1) return (ntohl(v4.s_addr) >> 24) == 127;
  in6_addr v6{};
  return inet_pton(AF_INET6, host.c_str(), &v6) == 1 && IN6_IS_ADDR_LOOPBACK(&v6);
}

bool is_address(const std::string& host) {
  in_addr v4{};
  in6_addr v6{};
  return host == "localhost" || inet_pton(AF_INET, host.c_str(), &v4) == 1 ||
         inet_pton(AF_INET6, host.c_str(), &v6) == 1;
}

Status validate(const DaemonConfig& config) {
  KeyChecker checker;
  visit(checker, config);
  return checker.status()
      .and_then([&] { return check_endpoint(config.endpoint, config.allow_remote); })
      .and_then([&] {
        const std::string& metrics = config.metrics.endpoint;
        return metrics.empty() ? Status() : check_metrics_endpoint(metrics, config.allow_remote);
      })
      .and_then([&] { return check_security(config); })
      .and_then([&] {
        const AgeConfig& age = config.age;
        if (age.expired_after_s >= age.aged_after_s) return Status();
        return Status(
            invalid(fmt::format("age.expired_after_s = {:g}: must not be below "
                                "aged_after_s = {:g}",
                                age.expired_after_s, age.aged_after_s)));
      });
}

}  // namespace

Status check_endpoint(const std::string& endpoint, bool allow_remote) {
  const auto refuse = [&](const std::string& reason) {
    return invalid("endpoint = " + endpoint + ": " + reason);
  };
  const std::string ipc = "ipc://";
  if (endpoint.rfind(ipc, 0) == 0 && endpoint.size() > ipc.size()) {
    // An abstract socket has no permissions; * is a folder that nobody knows.
    const char first = endpoint[ipc.size()];
    return first == '@' || first == '*' ? refuse("must name the path of a socket") : Status();
  }
  const std::string host = tcp_host(endpoint);
  if (host.empty()) return refuse("must be tcp://HOST:PORT or ipc://PATH");
  if (allow_remote || is_loopback(host)) return {};
  return refuse(
      "other machines may reach it: must be an address of this machine alone, such as 127.0.0.1, "
      "unless allow_remote is true and security names keys");
}

Status check_security(const DaemonConfig& config) {
  const auto missing = [](const std::string& key, const std::string& why) {
    return invalid("security." + key + " is missing: " + why);
  };
  const SecurityConfig& security = config.security;
  if (security.on()) return {};
  if (!security.secret_key.empty()) {
    return missing("allow_list", "a secret key admits no client without it (brainshift keys add)");
  }
  if (!security.allow_list.empty()) {
    return missing("secret_key", "an allow-list counts only with it (brainshift keys make)");
  }
  if (check_endpoint(config.endpoint, false)) return {};
  return missing("secret_key", "other machines may reach endpoint = " + config.endpoint +
                                   ", so it takes keys and an allow-list (see brainshift keys "
                                   "--help), or an address of this machine alone");
}

Status check_metrics_endpoint(const std::string& endpoint, bool allow_remote) {
  const auto refuse = [&](const std::string& reason) {
    return invalid("metrics.endpoint = " + endpoint + ": " + reason);
  };
  const std::string host = tcp_host("tcp://" + endpoint);
  const std::string port = endpoint.substr(endpoint.rfind(':') + 1);
  unsigned number = 0;
  const char* const end = port.data() + port.size();
  const auto [stop, error] = std::from_chars(port.data(), end, number);
  const bool is_port = error == std::errc() && stop == end && number <= 65535;
  if (host.empty() || !is_address(host) || !is_port) {
    return refuse("must be HOST:PORT, such as 127.0.0.1:9464, with an address in numbers");
  }
  if (allow_remote || is_loopback(host)) return {};
  return refuse(
      "other machines may reach it: must be an address of this machine alone, such as 127.0.0.1, "
      "unless allow_remote is true");
}

Result<DaemonConfig> read_daemon_config(const std::filesystem::path& path) {
  const Result<std::string> text = read_file(path);
  if (!text) return tl::unexpected(text.error());
  const auto read = [](YamlSection& root, DaemonConfig& config) {
    KeyReader reader(root);
    visit(reader, config);
  };
  return parse_yaml<DaemonConfig>(*text, path, read, validate);
}

}  // namespace brainshift::io
