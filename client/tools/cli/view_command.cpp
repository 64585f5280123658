// SPDX-License-Identifier: GPL-3.0-or-later
#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "client/tools/bridge/socket.hpp"
#include "client/tools/cli/command.hpp"
#include "client/tools/view/view.hpp"
#include "common/io/files/stop_signals.hpp"

namespace brainshift::client {
namespace {

struct ViewArguments {
  ViewOptions options;
  std::string listen = "127.0.0.1:8080";
  KeyOptions keys;
};

Status run_view(const ViewArguments& arguments) {
  ViewOptions options = arguments.options;
  const auto listen = parse_address("--listen", arguments.listen);
  if (!listen) return tl::unexpected(listen.error());
  options.listen = *listen;
  if (Status ok = read_keys(arguments.keys, options.keys); !ok) return ok;
  io::survive_failing_writes();
  const auto signals = io::StopSignals::catch_all();
  if (!signals) return tl::unexpected(signals.error());
  return view(
      options, [&] { return signals->arrived(); }, print_line);
}

}  // namespace

void add_view(CLI::App& app, Status& status) {
  auto arguments = std::make_shared<ViewArguments>();
  CLI::App* command = app.add_subcommand(
      "view", "Show a running daemon's field in a browser of this computer (docs/view.md).");
  add_with_default(*command, "--endpoint", arguments->options.endpoint, "where the daemon listens");
  add_key_options(*command, arguments->keys);
  add_with_default(*command, "--listen", arguments->listen,
                   "where the browser finds the page, on this computer; port 0: a free one");
  command->add_option("--model", arguments->options.model,
                      "the daemon's model file, to draw the MRI that its case names");
  command->add_option("--journal", arguments->options.journal,
                      "the daemon's journal_dir: the page can say where to measure next (takes the "
                      "model's memory once more when it is asked)");
  command->footer(
      R"(It starts no session, sends no observation and writes nothing. Examples:
  brainshift view --model colin27.h5
      then open http://127.0.0.1:8080/
  brainshift view --model colin27.h5 --journal journal
  brainshift view --endpoint tcp://127.0.0.1:5555 --listen 127.0.0.1:9000
From another computer: ssh -L 8080:127.0.0.1:8080 HOST, and the same address there.)");
  command->callback([arguments, &status] { status = run_view(*arguments); });
}

}  // namespace brainshift::client
