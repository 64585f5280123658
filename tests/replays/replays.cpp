// SPDX-License-Identifier: GPL-3.0-or-later
// replays SURGERY...: plays recordings to a running daemon, at the recorded times and at full
// speed, several times each, and writes a row per observation sent (replay_player.hpp).
//
// All passes of a surgery follow one another, the recorded times first, so that both speeds share
// what the machine does meanwhile. Every pass is a session of its own.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "common/core/stopwatch.hpp"
#include "common/linalg/openblas.hpp"
#include "tests/replays/replay_player.hpp"
#include "tests/surgeries/study_program.hpp"

namespace brainshift::replays {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::vector<fs::path> surgeries;
  std::string endpoint;
  fs::path out = "rows.csv";
  int recorded_passes = 3;
  int full_passes = 10;
};

Status play_surgery(const Arguments& arguments, const fs::path& file, surgeries::RowFile& table) {
  const auto recording = read_recording(file);
  if (!recording) return tl::unexpected(recording.error());
  PassFacts facts;
  facts.surgery = file.stem().string();
  facts.seed = recording->meta.seed.value_or(0);
  const auto t_solve_ms = measure_t_solve_ms(arguments.endpoint, *recording);
  if (!t_solve_ms) return tl::unexpected(t_solve_ms.error());
  facts.t_solve_ms = *t_solve_ms;
  KnownFields fields;
  for (const auto& [speed, passes] :
       {std::pair{client::Speed::kRecorded, arguments.recorded_passes},
        std::pair{client::Speed::kMax, arguments.full_passes}}) {
    const Stopwatch watch;
    facts.speed = speed;
    for (facts.pass = 1; facts.pass <= passes; ++facts.pass) {
      const auto rows = play_pass(arguments.endpoint, *recording, facts, fields);
      if (!rows) return tl::unexpected(rows.error());
      if (Status ok = table.append(*rows); !ok) return ok;
    }
    std::fprintf(stderr, "  %s %s: %d x %zu observations, %.1f s\n", facts.surgery.c_str(),
                 std::string(name_of(speed)).c_str(), passes, recording->observations.size(),
                 watch.seconds());
  }
  return {};
}

Status run(const Arguments& arguments) {
  auto table = surgeries::RowFile::open(arguments.out, row_of({}, 0, {}),
                                        {"surgery", "speed", "pass"}, false);
  if (!table) return tl::unexpected(table.error());
  for (const fs::path& file : arguments.surgeries) {
    if (Status ok = play_surgery(arguments, file, *table); !ok) {
      return fail(ok.error().code, file.string() + ": " + ok.error().message);
    }
  }
  return {};
}

}  // namespace
}  // namespace brainshift::replays

int main(int argc, char** argv) {
  brainshift::linalg::choose_blas_kernel();  // that of the daemon
  brainshift::replays::Arguments arguments;
  CLI::App app{"Plays recorded surgeries to a daemon: a row per observation.", "replays"};
  app.add_option("surgeries", arguments.surgeries, "surgery files")->required();
  app.add_option("--endpoint", arguments.endpoint, "where brainshiftd listens")->required();
  app.add_option("--out", arguments.out, "table to write")->capture_default_str();
  app.add_option("--passes-1x", arguments.recorded_passes, "at the recorded times")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  app.add_option("--passes-max", arguments.full_passes, "at full speed")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  return brainshift::surgeries::run_study(app, argc, argv,
                                          [&] { return brainshift::replays::run(arguments); });
}
