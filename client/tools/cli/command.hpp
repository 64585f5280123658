// SPDX-License-Identifier: GPL-3.0-or-later
// What the commands of `brainshift` share: registration, the line of an error, progress.
//
// Every failure is one line on stderr, "brainshift: <sentence>", and an exit status
// (common/core/exit_status.hpp).
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/lib/client_keys.hpp"
#include "common/core/error.hpp"
#include "common/core/progress.hpp"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's own
class App;
}

namespace brainshift::client {

// Each adds a subcommand to `app`. When app.parse() has read the arguments, it runs the chosen
// one, which stores its outcome in `status`. `status` must outlive the parsing.
void add_init(CLI::App& app, Status& status);
void add_preview(CLI::App& app, Status& status);
void add_simulate(CLI::App& app, Status& status);
void add_replay(CLI::App& app, Status& status);
void add_report(CLI::App& app, Status& status);
void add_solve(CLI::App& app, Status& status);
void add_import(CLI::App& app, Status& status);
void add_register(CLI::App& app, Status& status);
void add_stereo(CLI::App& app, Status& status);
void add_journal(CLI::App& app, Status& status);
void add_export(CLI::App& app, Status& status);
void add_watch(CLI::App& app, Status& status);
void add_advise(CLI::App& app, Status& status);
void add_view(CLI::App& app, Status& status);
void add_status(CLI::App& app, Status& status);
void add_top(CLI::App& app, Status& status);
void add_keys(CLI::App& app, Status& status);
void add_bridge(CLI::App& app, Status& status);

// Keys of a command that talks to a daemon: files, both or none.
struct KeyOptions {
  std::filesystem::path server_key;
  std::filesystem::path key;
};
void add_key_options(CLI::App& command, KeyOptions& options);
// Reads the files into `keys`, which stays empty without files; fails as client_keys() of
// client/tools/monitor does.
Status read_keys(const KeyOptions& options, std::optional<ClientKeys>& keys);

// Adds an option whose value now is its default, which the help shows; or one that must be given.
// Both give the CLI::Option*.
template <typename App, typename Value>
auto add_with_default(App& command, const char* name, Value& value, const char* help) {
  return command.add_option(name, value, help)->capture_default_str();
}
template <typename App, typename Value>
auto add_required(App& command, const char* name, Value& value, const char* help) {
  return command.add_option(name, value, help)->required();
}

// Prints a line to stdout, and lets nothing wait in a buffer.
void print_line(const std::string& line);
void print_lines(const std::vector<std::string>& lines);
// The last line of a command that wrote a file: "wrote PATH", and what else it says of it.
void print_wrote(const std::filesystem::path& path, const std::string& more = "");
// Prints "brainshift: <sentence>" to stderr, line breaks replaced by spaces.
void print_error(std::string_view sentence);

// Draws stage and percentage on one line of stderr, and ends the line when a stage is complete. An
// empty function when stderr is no terminal.
Progress terminal_progress();

}  // namespace brainshift::client
