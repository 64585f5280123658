// SPDX-License-Identifier: GPL-3.0-or-later
// surgeries_summary [--before TABLE]... TABLE...: checks and pictures from the tables of
// `surgeries`, one per head, into $BRAINSHIFT_STUDY_DIR (tests/support/study_record.hpp). Measures
// nothing; whether the checks hold is for study_summary to say.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tests/surgeries/surgery_checks.hpp"
#include "tests/surgeries/surgery_pictures.hpp"

namespace brainshift::surgeries {
namespace {

Result<bench::CsvTable> read_all(const std::vector<std::filesystem::path>& files) {
  bench::CsvTable all;
  for (const auto& file : files) {
    const auto table = bench::CsvTable::read(file);
    if (!table) return table;
    if (Status ok = all.append(*table); !ok) {
      return fail(ok.error().code, file.string() + ": " + ok.error().message);
    }
  }
  return all;
}

Status run(const std::vector<std::filesystem::path>& tables,
           const std::vector<std::filesystem::path>& before) {
  const char* folder = std::getenv("BRAINSHIFT_STUDY_DIR");
  if (folder == nullptr) {
    return fail(ErrorCode::kInvalidArgument, "BRAINSHIFT_STUDY_DIR is not set");
  }
  const auto table = read_all(tables);
  if (!table) return tl::unexpected(table.error());
  const auto earlier = read_all(before);
  if (!earlier) return tl::unexpected(earlier.error());
  const Rows rows(*table);
  if (rows.empty()) return fail(ErrorCode::kEmptySet, "no surgery in the tables");
  for (const std::string& head : rows.values("head")) {
    const Rows of_head = Rows(*earlier).where("head", head);
    check_head(rows.where("head", head),
               of_head.empty() ? std::nullopt : std::optional<Rows>(of_head));
  }
  return draw_surgeries(rows, folder);
}

}  // namespace
}  // namespace brainshift::surgeries

int main(int argc, char** argv) {
  std::vector<std::filesystem::path> tables, before;
  CLI::App app{"Checks and pictures of simulated surgeries.", "surgeries_summary"};
  app.add_option("tables", tables, "tables of surgeries")->required();
  app.add_option("--before", before, "tables of an earlier estimate on the same surgeries");
  app.footer("Exit status: 0 summarised, 1 failure, 2 bad usage.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    std::fprintf(stderr, "surgeries_summary: %s (see surgeries_summary --help)\n", error.what());
    return 2;
  }
  const auto ok = brainshift::surgeries::run(tables, before);
  if (ok) return 0;
  std::fprintf(stderr, "surgeries_summary: %s\n", ok.error().message.c_str());
  return 1;
}
