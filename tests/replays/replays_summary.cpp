// SPDX-License-Identifier: GPL-3.0-or-later
// replays_summary: checks, tables and pictures from the rows of `replays`, into
// $BRAINSHIFT_STUDY_DIR (tests/support/study_record.hpp). Measures nothing; whether the checks hold
// is for study_summary to say.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>

#include "tests/benchmarks/csv_table.hpp"
#include "tests/replays/manifest.hpp"
#include "tests/replays/replay_checks.hpp"
#include "tests/replays/replay_pictures.hpp"
#include "tests/replays/replay_tables.hpp"
#include "tests/surgeries/study_program.hpp"

namespace brainshift::replays {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  fs::path rows, corpus;
  fs::path committed_rows, committed_corpus;  // need not exist
};

template <typename T>
Result<std::optional<T>> if_there(const fs::path& path, Result<T> (*read)(const fs::path&)) {
  if (path.empty() || !fs::exists(path)) return std::optional<T>();
  auto value = read(path);
  if (!value) return tl::unexpected(value.error());
  return std::optional<T>(std::move(*value));
}

Status summarise(const Arguments& arguments) {
  const char* folder = std::getenv("BRAINSHIFT_STUDY_DIR");
  if (folder == nullptr) {
    return fail(ErrorCode::kInvalidArgument, "BRAINSHIFT_STUDY_DIR is not set");
  }
  const auto table = bench::CsvTable::read(arguments.rows);
  if (!table) return tl::unexpected(table.error());
  const surgeries::Rows rows(*table);
  if (rows.empty()) return fail(ErrorCode::kEmptySet, arguments.rows.string() + ": has no row");
  const auto made = read_manifest(arguments.corpus);
  if (!made) return tl::unexpected(made.error());
  const auto known = if_there(arguments.committed_corpus, &read_manifest);
  if (!known) return tl::unexpected(known.error());
  const auto earlier = if_there(arguments.committed_rows, &bench::CsvTable::read);
  if (!earlier) return tl::unexpected(earlier.error());
  const bench::CsvTable committed = earlier->value_or(bench::CsvTable());

  check_corpus(*known, *made);
  check_replays(rows);
  check_regression(rows, surgeries::Rows(committed));
  if (Status ok = write_tables(rows, folder); !ok) return ok;
  return draw_replays(rows, folder);
}

}  // namespace
}  // namespace brainshift::replays

int main(int argc, char** argv) {
  brainshift::replays::Arguments arguments;
  CLI::App app{"Checks, tables and pictures of replays.", "replays_summary"};
  app.add_option("--rows", arguments.rows, "table of replays")->required();
  app.add_option("--corpus", arguments.corpus, "corpus.csv of replays_corpus")->required();
  app.add_option("--committed-rows", arguments.committed_rows,
                 "of an earlier run, if there is one");
  app.add_option("--committed-corpus", arguments.committed_corpus,
                 "what the corpus must hold, if that is known");
  return brainshift::surgeries::run_study(
      app, argc, argv, [&] { return brainshift::replays::summarise(arguments); });
}
