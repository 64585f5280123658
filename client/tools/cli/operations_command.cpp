// SPDX-License-Identifier: GPL-3.0-or-later
// `brainshift status` and `brainshift top`.
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>

#include "client/lib/client.hpp"
#include "client/tools/cli/command.hpp"
#include "client/tools/monitor/page.hpp"
#include "client/tools/monitor/report_json.hpp"
#include "client/tools/monitor/top.hpp"

namespace brainshift::client {
namespace {

constexpr const char* kEndpoint = "tcp://127.0.0.1:5555";

struct StatusArguments {
  std::string endpoint = kEndpoint;
  KeyOptions keys;
  bool json = false;
};

struct TopArguments {
  std::string endpoint = kEndpoint;
  KeyOptions keys;
  double interval_s = 1.0;
  bool once = false;
};

Status show_status(const StatusArguments& arguments) {
  ClientOptions options;
  if (Status ok = read_keys(arguments.keys, options.keys); !ok) return ok;
  auto client = Client::connect(arguments.endpoint, options);
  if (!client) return tl::unexpected(client.error());
  auto report = client->report();
  if (!report) return tl::unexpected(report.error());
  if (arguments.json) {
    std::puts(report_json(*report).c_str());
  } else {
    for (const Line& line : page({*report, std::nullopt}, arguments.endpoint)) {
      std::puts(line.text.c_str());
    }
  }
  if (const auto trouble = complaint(*report)) {
    return fail(ErrorCode::kUnavailable, arguments.endpoint + ": " + *trouble);
  }
  return {};
}

Status show_top(const TopArguments& arguments) {
  if (!std::isfinite(arguments.interval_s)) {  // CLI::Range lets NaN pass
    return fail(ErrorCode::kInvalidArgument, "--interval must be a number of seconds");
  }
  TopOptions options;
  options.endpoint = arguments.endpoint;
  options.interval = std::chrono::milliseconds(std::lround(1e3 * arguments.interval_s));
  options.once = arguments.once;
  if (Status ok = read_keys(arguments.keys, options.keys); !ok) return ok;
  return top(options);
}

}  // namespace

void add_status(CLI::App& app, Status& status) {
  auto arguments = std::make_shared<StatusArguments>();
  CLI::App* command =
      app.add_subcommand("status", "Report the state of a running daemon, on one page.");
  command->add_option("--endpoint", arguments->endpoint, "where brainshiftd listens")
      ->capture_default_str();
  add_key_options(*command, arguments->keys);
  command->add_flag("--json", arguments->json, "print JSON instead (docs/operations.md)");
  command->footer(
      "Exit status\n"
      "  0  a session tracks or is ready, and is recorded if a journal is configured\n"
      "  1  otherwise, with the reason in one line on stderr: no model is loaded, no session runs\n"
      "     or it is still being prepared, degraded, not recording, the worker hangs, no answer\n"
      "  2  bad usage\n"
      "Examples:\n"
      "  brainshift status\n"
      "  brainshift status --endpoint tcp://127.0.0.1:5555 --json | jq .session.phase");
  command->callback([arguments, &status] { status = show_status(*arguments); });
}

void add_top(CLI::App& app, Status& status) {
  auto arguments = std::make_shared<TopArguments>();
  CLI::App* command = app.add_subcommand(
      "top", "Watch a running daemon: rates, latencies, sources, viewers, journal.");
  command->add_option("--endpoint", arguments->endpoint, "where brainshiftd listens")
      ->capture_default_str();
  add_key_options(*command, arguments->keys);
  command->add_option("--interval", arguments->interval_s, "between two pages, s")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  command->add_flag("--once", arguments->once, "print one page with the rates of one interval");
  command->footer(
      "On a terminal the page is drawn in place; q or Ctrl-C ends it. On a pipe every interval "
      "prints\n"
      "one line. What needs attention stands in capitals: ATTENTION, STALE, NOT RECORDING, HANGS.\n"
      "Examples:\n"
      "  brainshift top\n"
      "  brainshift top --interval 10 >> brainshift.log\n"
      "  brainshift top --once --interval 5");
  command->callback([arguments, &status] { status = show_top(*arguments); });
}

}  // namespace brainshift::client
