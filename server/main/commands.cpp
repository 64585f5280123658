// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/main/commands.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <string_view>
#include <utility>

#include "client/lib/client.hpp"
#include "common/core/text.hpp"
#include "common/io/config/daemon_file.hpp"
#include "common/io/config/key_file.hpp"

namespace brainshift::server {
namespace {

// A daemon that fails must end, also when nobody reads its stderr.
constexpr int kReaderLimitMs = 500;

Result<DaemonStatus> ask(const HealthArguments& arguments) {
  auto config = io::read_daemon_config(arguments.config_file);
  if (!config) return tl::unexpected(config.error());
  const auto endpoint = endpoint_to_ask(arguments.endpoint.value_or(config->endpoint));
  if (!endpoint) return tl::unexpected(endpoint.error());
  client::ClientOptions options;
  options.request_timeout = std::chrono::seconds(3);
  if (config->security.on()) {
    auto own = io::read_secret_key(config->security.secret_key);
    if (!own) return tl::unexpected(own.error());
    options.keys = client::ClientKeys{own->public_key, own->public_key, own->secret_key};
  }
  auto connected = client::Client::connect(*endpoint, options);
  if (!connected) return tl::unexpected(connected.error());
  return connected->status();
}

}  // namespace

int print_error(const Error& error) {
  const std::string line = one_line(error.message);
  pollfd writable{STDERR_FILENO, POLLOUT, 0};
  if (poll(&writable, 1, kReaderLimitMs) != 0) {
    std::fprintf(stderr, "brainshiftd: %s\n", line.c_str());
  }
  return exit_status(error.code);
}

Result<std::string> endpoint_to_ask(const std::string& endpoint) {
  static constexpr std::string_view kTcp = "tcp://";
  if (!endpoint.starts_with(kTcp)) return endpoint;
  if (endpoint.ends_with(":*")) {
    return invalid(fmt::format(
        "{}: the system chooses this port; give --endpoint as the daemon prints it", endpoint));
  }
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 3> kAllInterfaces = {
      {{"0.0.0.0:", "127.0.0.1:"}, {"*:", "127.0.0.1:"}, {"[::]:", "[::1]:"}}};
  const std::string_view address = std::string_view(endpoint).substr(kTcp.size());
  for (const auto& [all, local] : kAllInterfaces) {
    if (address.starts_with(all)) {
      return fmt::format("{}{}{}", kTcp, local, address.substr(all.size()));
    }
  }
  return endpoint;
}

int run_health(const HealthArguments& arguments) {
  const auto status = ask(arguments);
  if (!status) return print_error(status.error());
  fmt::print("ok version={} case={} updates={}\n", status->version,
             status->model_ready ? status->case_id : "none", status->updates);
  return kExitSuccess;
}

}  // namespace brainshift::server
