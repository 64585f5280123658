// SPDX-License-Identifier: GPL-3.0-or-later
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "client/lib/client.hpp"
#include "client/tools/cli/command.hpp"
#include "client/tools/monitor/keys.hpp"
#include "client/tools/monitor/page.hpp"
#include "client/tools/monitor/top.hpp"
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
  return watch(options, print_line);
}

constexpr const char* kEndpoint = "tcp://127.0.0.1:5555";

struct StatusArguments {
  std::string endpoint = kEndpoint;
  KeyOptions keys;
  bool json = false;
};

struct TopArguments {
  TopOptions options{.endpoint = kEndpoint};
  KeyOptions keys;
  double interval_s = 1.0;
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
    return invalid("--interval must be a number of seconds");
  }
  TopOptions options = arguments.options;
  options.interval = std::chrono::milliseconds(std::lround(1e3 * arguments.interval_s));
  if (Status ok = read_keys(arguments.keys, options.keys); !ok) return ok;
  return top(options);
}

namespace fs = std::filesystem;

struct KeysArguments {
  std::string name;
  fs::path folder = ".";
  fs::path allow_list;
  std::string role = "viewer";
  std::string key;
  std::vector<fs::path> files;
};

Status make(const KeysArguments& arguments) {
  const auto files = make_keys(arguments.folder, arguments.name);
  if (!files) return tl::unexpected(files.error());
  std::printf("%s   public: hand it out\n%s   secret: stays on this machine\n",
              files->public_file.c_str(), files->secret_file.c_str());
  return {};
}

Status add(const KeysArguments& arguments) {
  const auto key = named_key(arguments.key);
  if (!key) return tl::unexpected(key.error());
  const io::AllowedKey allowed{*role_from(arguments.role),
                               arguments.name.empty() ? key->name : arguments.name,
                               key->public_key};
  if (allowed.name.empty()) return invalid("keys add: --name is needed for a key that is no file");
  if (Status added = io::add_allowed_key(arguments.allow_list, allowed); !added) return added;
  std::printf("%s: %s may act as %s from the daemon's next start\n", arguments.allow_list.c_str(),
              allowed.name.c_str(), arguments.role.c_str());
  return {};
}

Status list(const KeysArguments& arguments) {
  const auto keys = io::read_allow_list(arguments.allow_list);
  if (!keys) return tl::unexpected(keys.error());
  for (const io::AllowedKey& key : *keys) {
    const std::string role(to_string(key.role));
    std::printf("%-7s %-20s %s\n", role.c_str(), key.name.c_str(), key.public_key.c_str());
  }
  return {};
}

// Every file is reported; the first bad one decides how the command ends.
Status check_keys(const KeysArguments& arguments) {
  const CheckedKeys checked = check_key_files(arguments.files);
  print_lines(checked.good);
  for (std::size_t i = 1; i < checked.bad.size(); ++i) print_error(checked.bad[i].message);
  if (checked.bad.empty()) return {};
  return tl::unexpected(checked.bad.front());
}

std::vector<std::string> role_words() {
  std::vector<std::string> words;
  for (const Role role : kAllRoles) words.emplace_back(to_string(role));
  return words;
}

using Action = Status (*)(const KeysArguments&);

CLI::App* add_keys_action(CLI::App& keys, const std::string& name, const std::string& text,
                          const std::shared_ptr<KeysArguments>& arguments, Action run,
                          Status& status) {
  CLI::App* action = keys.add_subcommand(name, text);
  action->callback([arguments, run, &status] { status = run(*arguments); });
  return action;
}

}  // namespace

void add_watch(CLI::App& app, Status& status) {
  auto arguments = std::make_shared<WatchArguments>();
  WatchOptions& options = arguments->options;
  ChoiceText& choice = arguments->choice;
  CLI::App* command = app.add_subcommand("watch",
                                         "Tell a line per update of a running daemon: its age, "
                                         "what travelled, whether it is current.");
  add_with_default(*command, "--endpoint", options.endpoint, "where the daemon listens");
  add_key_options(*command, arguments->keys);
  add_with_default(*command, "--region", choice.region,
                   "nodes to receive: brain, tumour:MARGIN, or a ball X,Y,Z:RADIUS (patient RAS, "
                   "mm, undeformed)");
  add_with_default(*command, "--decimate", choice.spacing,
                   "receive nodes at least so far apart that no node of the region is farther from "
                   "one; 0mm: all");
  add_with_default(*command, "--tolerance", choice.tolerance,
                   "receive a node again only when it differs by more than this from what was "
                   "received; 0mm: always");
  command->add_flag("--no-sd", choice.without_sd,
                    "receive neither standard deviations nor what is known");
  add_with_default(*command, "--count", options.count, "end after so many updates; 0: never")
      ->check(CLI::Range(0, 1000000000));
  command->add_flag("--json", options.json, "a line is a JSON object");
  command->footer(
      R"(It starts no session: it shows what the daemon's viewers see, and delays none of them. Examples:
  brainshift watch --endpoint tcp://127.0.0.1:5555
  brainshift watch --region tumour:40mm --tolerance 0.1mm
  brainshift watch --region -30,12,44:50mm --decimate 10mm --no-sd --count 20 --json
A line of 80 columns: the update's number, the age of its data, the mean motion of the tumour's
nodes and its standard deviation, the verdict on the field, the boundary condition, and whether
it may be shown as current; RECORDED when a recording is played. Indented lines below it give
reasons and, for a viewer that chose a part, what travelled. Between updates a line tells when
that changes, e.g. to aged when all sources are silent, to stale when the daemon is.)");
  command->callback([arguments, &status] { status = run_watch(*arguments); });
}

void add_status(CLI::App& app, Status& status) {
  auto arguments = std::make_shared<StatusArguments>();
  CLI::App* command =
      app.add_subcommand("status", "Report the state of a running daemon, on one page.");
  add_with_default(*command, "--endpoint", arguments->endpoint, "where brainshiftd listens");
  add_key_options(*command, arguments->keys);
  command->add_flag("--json", arguments->json, "print JSON instead (docs/operations.md)");
  command->footer(
      R"(Exit status
  0  a session tracks or is ready, and is recorded if a journal is configured
  1  otherwise, with the reason in one line on stderr: no model is loaded, no session runs
     or it is still being prepared, degraded, the field is aged or has expired, not
     recording, the worker hangs, no answer
  2  bad usage
Examples:
  brainshift status
  brainshift status --endpoint tcp://127.0.0.1:5555 --json | jq .session.phase)");
  command->callback([arguments, &status] { status = show_status(*arguments); });
}

void add_top(CLI::App& app, Status& status) {
  auto arguments = std::make_shared<TopArguments>();
  TopOptions& options = arguments->options;
  CLI::App* command = app.add_subcommand(
      "top", "Watch a running daemon: rates, latencies, sources, viewers, journal.");
  add_with_default(*command, "--endpoint", options.endpoint, "where brainshiftd listens");
  add_key_options(*command, arguments->keys);
  add_with_default(*command, "--interval", arguments->interval_s, "between two pages, s")
      ->check(CLI::Range(0.1, 3600.0));
  command->add_flag("--once", options.once, "print one page with the rates of one interval");
  command->footer(
      R"(On a terminal the page is drawn in place; q or Ctrl-C ends it. On a pipe every interval prints
one line. What needs attention stands in capitals: ATTENTION, AGED,
EXPIRED, STALE (no answer), RECORDED (a recording is played), NOT RECORDING, HANGS.
Examples:
  brainshift top
  brainshift top --interval 10 >> brainshift.log
  brainshift top --once --interval 5)");
  command->callback([arguments, &status] { status = show_top(*arguments); });
}

void add_keys(CLI::App& app, Status& status) {
  auto arguments = std::make_shared<KeysArguments>();
  CLI::App* keys = app.add_subcommand(
      "keys", "Make and check the keys of daemons and clients (docs/security.md).");
  keys->require_subcommand(1);
  keys->footer(
      "The whole set-up. On the daemon's machine, then on a client's, then on the daemon's again:\n"
      "  brainshift keys make daemon\n"
      "  brainshift keys make console        (and bring console.public to the daemon's machine)\n"
      "  brainshift keys add --allow allow-list --role owner console.public\n"
      "In the daemon's configuration, and then on the client with daemon.public:\n"
      "  security: { secret_key: daemon.secret, allow_list: allow-list }\n"
      "  brainshift replay S.surgery --endpoint tcp://HOST:5555 --server-key daemon.public --key "
      "console.secret --report r.json\n"
      "Roles: viewer looks; source also hands in observations; owner also starts sessions; admin "
      "also takes over.\n"
      "Each has a --help of its own.");

  CLI::App* action = add_keys_action(*keys, "make", "Make a key pair: NAME.public and NAME.secret.",
                                     arguments, make, status);
  add_required(*action, "name", arguments->name, "of the machine or program");
  add_with_default(*action, "--dir", arguments->folder, "folder for the files");
  action->footer(
      "Nothing is overwritten. The secret file is for its owner alone (mode 0600).\n"
      "Example:\n  brainshift keys make console --dir ~/.config/brainshift");

  action = add_keys_action(*keys, "add", "Add a public key to a daemon's allow-list.", arguments,
                           add, status);
  add_required(*action, "key", arguments->key, "a .public file, or its 40 characters");
  add_required(*action, "--allow", arguments->allow_list, "allow-list; made if it does not exist");
  add_required(*action, "--role", arguments->role, "what its holder may do")
      ->check(CLI::IsMember(role_words()));
  action->add_option("--name", arguments->name,
                     "under which the daemon knows it; the file's name by default");
  action->footer(
      "The daemon reads its list when it starts. To take a key away, delete its line.\n"
      "Example:\n  brainshift keys add --allow allow-list --role source ultrasound.public");

  action = add_keys_action(*keys, "list", "Print an allow-list.", arguments, list, status);
  add_required(*action, "--allow", arguments->allow_list, "allow-list");
  action->footer("Example:\n  brainshift keys list --allow allow-list");

  action = add_keys_action(*keys, "check", "Check permissions, format and duplicates of files.",
                           arguments, check_keys, status);
  add_required(*action, "files", arguments->files, "key files and allow-lists");
  action->footer("Example:\n  brainshift keys check daemon.secret allow-list");
}

}  // namespace brainshift::client
