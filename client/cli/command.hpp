// SPDX-License-Identifier: GPL-3.0-or-later
// What the commands of `brainshift` share: registration, exit status, progress.
//
// Exit status: 0 success, 2 bad usage or bad input, 1 any other failure. Every failure is one line on
// stderr, "brainshift: <sentence>".
#pragma once

#include <string_view>

#include "common/core/error.hpp"
#include "common/core/progress.hpp"

namespace CLI {
class App;
}

namespace brainshift::client {

// Each adds a subcommand to `app`; once the arguments are parsed, the chosen one stores its outcome in
// `status`. `status` must outlive the parsing.
void add_simulate(CLI::App& app, Status& status);
void add_replay(CLI::App& app, Status& status);
void add_report(CLI::App& app, Status& status);
void add_solve(CLI::App& app, Status& status);
void add_import(CLI::App& app, Status& status);
void add_stereo(CLI::App& app, Status& status);

// 2 for what the user can mend in arguments or files, else 1.
int exit_status(ErrorCode code);

// "brainshift: sentence" on stderr, line breaks replaced.
void print_error(std::string_view sentence);

// Draws stage and percentage on one line of stderr when that is a terminal; empty otherwise. The line is
// ended when a stage is complete.
Progress terminal_progress();

}  // namespace brainshift::client
