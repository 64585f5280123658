// SPDX-License-Identifier: GPL-3.0-or-later
#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>

#include "client/cli/command.hpp"
#include "client/replay/replay.hpp"

namespace brainshift::client {
namespace {

struct Arguments {
  ReplayOptions options;
  std::string speed = "max";
  std::string boundary = "both";
  double timeout_s = 600.0;
};

Status run(Arguments arguments) {
  ReplayOptions& options = arguments.options;
  options.speed = arguments.speed == "max" ? Speed::kMax : Speed::kRecorded;
  if (arguments.boundary == "contact") options.boundaries = {Boundary::kContact};
  if (arguments.boundary == "fixed") options.boundaries = {Boundary::kFixed};
  if (!std::isfinite(arguments.timeout_s)) {  // CLI::Range lets NaN pass
    return fail(ErrorCode::kInvalidArgument, "--timeout-s must be a number of seconds");
  }
  options.timeout = std::chrono::milliseconds(static_cast<long>(1e3 * arguments.timeout_s));
  return replay(options, terminal_progress());
}

}  // namespace

void add_replay(CLI::App& app, Status& status) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand(
      "replay", "Play a recorded surgery to a running daemon and score its answers.");
  ReplayOptions& options = arguments->options;
  command->add_option("surgery", options.surgery, "surgery file (.surgery)")->required();
  command->add_option("--endpoint", options.endpoint, "where brainshiftd listens")
      ->capture_default_str();
  command
      ->add_option("--report", options.report, "report.json to write; fields go beside it as .vtu")
      ->required();
  command
      ->add_option("--speed", arguments->speed,
                   "max: as fast as answers come; 1x: at the recorded times")
      ->check(CLI::IsMember({"max", "1x"}))
      ->capture_default_str();
  command
      ->add_option("--boundary", arguments->boundary,
                   "brain-skull boundary condition to estimate with")
      ->check(CLI::IsMember({"contact", "fixed", "both"}))
      ->capture_default_str();
  command
      ->add_option("--timeout-s", arguments->timeout_s,
                   "longest silence before an observation counts as lost, s")
      ->check(CLI::Range(0.1, 86400.0))
      ->capture_default_str();
  command->footer(
      "The daemon must serve the case and model that the surgery was recorded with. Example:\n"
      "  brainshift replay paper.surgery --endpoint tcp://127.0.0.1:5555 --speed max --report "
      "paper.json");
  command->callback([arguments, &status] { status = run(*arguments); });
}

}  // namespace brainshift::client
