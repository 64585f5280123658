// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/config/daemon_file.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <charconv>

#include "common/io/config/key_reader.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

constexpr Word<const char*> kLogLevels[] = {
    {"trace", "trace"}, {"debug", "debug"}, {"info", "info"}, {"warn", "warn"}, {"error", "error"}};

constexpr Word<bool> kTruthWords[] = {{true, "true"}, {false, "false"}};

// The table of the daemon's keys.
template <typename A, Of<DaemonConfig> V>
void visit(A& a, V& v) {
  a({"endpoint", "", "Where clients connect: tcp://HOST:PORT or ipc://PATH", "this machine only",
     "The socket of an ipc endpoint is for the daemon's own account. Other addresses than those of "
     "this machine need allow_remote."},
    v.endpoint);
  a({"allow_remote", "", "Whether the endpoint may be an address that other machines reach", "",
     "It takes the keys of `security` as well."},
    v.allow_remote, kTruthWords);
  a.section({"security"}, Need::kOptional, [&] {
    a({"secret_key", "", "The daemon's secret key, made by `brainshift keys make`", "",
       "A file that its owner alone may read. With both keys everything is encrypted, and only "
       "those in allow_list are served. Without them any peer that can connect has full access."},
      v.security.secret_key);
    a({"allow_list", "",
       "Who is served: a line ROLE NAME PUBLICKEY for each, made by `brainshift keys add`", "",
       "Roles: viewer, source, owner, admin. Read when the daemon starts."},
      v.security.allow_list);
  });
  a({"model", "", "Model file made by `brainshiftd prepare`", "",
     "Clients are told model_not_ready until one is loaded. The command line's --model takes "
     "precedence."},
    v.model);
  a({"journal_dir", "",
     "Folder that keeps a journal of every observation and update, one file per session", "",
     "Without it there is no journal."},
    v.journal_dir);
  a({"log_level", "", "Least severe messages in the log"}, v.log_level, kLogLevels);
  a({"max_clients", "", "Clients served at once", "", "More are refused."}, v.max_clients,
    between(1, 1024));
  a({"max_message_mib", "MiB", "Largest message accepted", "",
     "Larger ones are refused unread. An observation with 100 thousand points takes 2.4 MiB, an "
     "update for 18 thousand nodes "
     "0.6 MiB."},
    v.max_message_mib, between(1, 64));
  a.section({"limits"}, Need::kOptional, [&] {
    a({"connections", "", "Connections of one key at once", "",
       "More are refused. A program has one, a viewer beside a source two."},
      v.limits.connections, between(1, 1024));
    a({"observations_per_s", "", "Observations of one key in a second", "",
       "The rest is refused and counted. Five sources of 60 Hz have 300; a replay at full speed "
       "has "
       "more."},
      v.limits.observations_per_s, between(1, 10000));
    a({"session_starts_per_min", "", "Sessions that one key may start in a minute", "",
       "The rest is refused and counted."},
      v.limits.session_starts_per_min, between(1, 10000));
  });
  a.section({"metrics", "", "Figures for monitors, over HTTP in the format of Prometheus", "",
             "The path is /metrics; docs/operations.md lists the figures."},
            Need::kOptional, [&] {
              a({"endpoint", "", "Where monitors ask: HOST:PORT", "",
                 "HOST is an address in numbers. Other addresses than those of this machine need "
                 "allow_remote."},
                v.metrics.endpoint);
            });
}

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
      .and_then([&] { return check_security(config); });
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

std::vector<KeyDocument> daemon_key_documents() {
  KeyDocumenter documenter;
  const DaemonConfig defaults;
  visit(documenter, defaults);
  return documenter.documents();
}

}  // namespace brainshift::io
