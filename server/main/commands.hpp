// SPDX-License-Identifier: GPL-3.0-or-later
// The commands of brainshiftd. Each prints what it has to say and returns the exit status
// (common/core/exit_status.hpp); a failure is one line on stderr.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "common/core/error.hpp"
#include "common/core/exit_status.hpp"
#include "common/ranks/ranks.hpp"

namespace brainshift {
struct BrainModel;
namespace io {
struct OldModel;
}
}  // namespace brainshift

namespace brainshift::server {

// Prints "brainshiftd: <message>" to stderr, on one line whatever the message holds. A reader
// that stalls is not waited for beyond half a second. Returns the exit status of the error's code.
int print_error(const Error& error);

// brainshiftd prepare: case file -> model file, before surgery.
struct PrepareArguments {
  std::filesystem::path case_file;
  std::filesystem::path out;
  bool json = false;
  int threads = 0;         // 0: as many as cores; one for each of several processes
  Ranks* ranks = nullptr;  // processes that prepare it together; the first one writes and prints
};

// Calls patient::prepare_model, writes the model file, prints a table or one JSON object to stdout.
// A model that cannot be solved is not written. A model that is there is replaced, and told; any
// other file is left alone, at exit status 2. An interrupted run leaves OUT.partial, from which
// the next one goes on. Returns the exit status.
int run_prepare(const PrepareArguments& arguments);

// "m.h5: replaces the model of case head, 0123abcd: the new one is the same", or another, or that
// the old one cannot be read.
std::string replacement_text(const std::filesystem::path& out, const io::OldModel& old,
                             const BrainModel& made);

// brainshiftd serve: the daemon, during surgery.
struct ServeArguments {
  std::filesystem::path config_file;
  std::optional<std::filesystem::path> model;  // instead of the configuration's
  std::optional<std::string> endpoint;         // instead of the configuration's
};

// Prints "listening on <endpoint>" to stdout once clients can connect; serves until SIGINT,
// SIGTERM or SIGHUP. Returns the exit status.
int run_serve(const ServeArguments& arguments);

// brainshiftd health: whether a daemon answers; for containers and scripts.
struct HealthArguments {
  std::filesystem::path config_file;    // of the daemon to ask
  std::optional<std::string> endpoint;  // instead of the configuration's
};

// Where a client on the daemon's own machine reaches it: 127.0.0.1 and ::1 stand for "all
// interfaces". kInvalidArgument for a port that the system chooses (*): only the daemon knows it.
Result<std::string> endpoint_to_ask(const std::string& endpoint);

// Asks the daemon for its status, with the daemon's own key where it asks for keys. Prints one
// line: "ok version=... case=... updates=...". Returns the exit status: 0 when it answers within
// 3 s, with or without a model; 1 when it does not.
int run_health(const HealthArguments& arguments);

}  // namespace brainshift::server
