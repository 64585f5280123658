// SPDX-License-Identifier: GPL-3.0-or-later
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "client/tools/cli/command.hpp"
#include "client/tools/monitor/choice_text.hpp"
#include "client/tools/monitor/watch.hpp"

namespace brainshift::client {
namespace {

struct WatchArguments {
  WatchOptions options;
  ChoiceText choice;
  KeyOptions keys;
};

Status run_watch(const WatchArguments& arguments) {
  const auto choice = parse_choice(arguments.choice);
  if (!choice) return tl::unexpected(choice.error());
  WatchOptions options = arguments.options;
  options.choice = *choice;
  if (Status ok = read_keys(arguments.keys, options.keys); !ok) return ok;
  return watch(options, [](const std::string& line) {
    std::puts(line.c_str());
    std::fflush(stdout);
  });
}

}  // namespace

void add_watch(CLI::App& app, Status& status) {
  auto arguments = std::make_shared<WatchArguments>();
  WatchOptions& options = arguments->options;
  ChoiceText& choice = arguments->choice;
  CLI::App* command = app.add_subcommand(
      "watch",
      "Tell a line per update of a running daemon: its age, what travelled, whether it "
      "is current.");
  command->add_option("--endpoint", options.endpoint, "where the daemon listens")
      ->capture_default_str();
  add_key_options(*command, arguments->keys);
  command
      ->add_option("--region", choice.region,
                   "nodes to receive: brain, tumour:MARGIN, or a ball X,Y,Z:RADIUS (patient RAS, "
                   "mm, undeformed)")
      ->capture_default_str();
  command
      ->add_option("--decimate", choice.spacing,
                   "receive nodes at least so far apart that no node of the region is farther from "
                   "one; 0mm: all")
      ->capture_default_str();
  command
      ->add_option("--tolerance", choice.tolerance,
                   "receive a node again only when it differs by more than this from what was "
                   "received; 0mm: always")
      ->capture_default_str();
  command->add_flag("--no-sd", choice.without_sd, "receive no standard deviations");
  command->add_option("--count", options.count, "end after so many updates; 0: never")
      ->check(CLI::Range(0, 1000000000))
      ->capture_default_str();
  command->add_flag("--json", options.json, "a line is a JSON object");
  command->footer(
      "It starts no session: it shows what the daemon's viewers see, and delays none of them. "
      "Examples:\n"
      "  brainshift watch --endpoint tcp://127.0.0.1:5555\n"
      "  brainshift watch --region tumour:40mm --tolerance 0.1mm\n"
      "  brainshift watch --region -30,12,44:50mm --decimate 10mm --no-sd --count 20 --json\n"
      "A line: the update's number, the age of its data, the nodes that the viewer now has of the\n"
      "mesh (those that travelled, and all bytes of the message), the mean motion of the tumour's\n"
      "nodes among them, the verdict on the field, and whether it may be shown as current. "
      "Between\n"
      "updates a line tells when that changes, e.g. to stale when the daemon is silent.");
  command->callback([arguments, &status] { status = run_watch(*arguments); });
}

}  // namespace brainshift::client
