// SPDX-License-Identifier: GPL-3.0-or-later
// evidence_summary TABLE...: checks, pictures, the paper's tables and those of docs/evidence.md
// from the tables of `evidence`, one per head, into $BRAINSHIFT_STUDY_DIR (study_record.hpp). It
// measures nothing; study_summary tells whether the checks hold.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "common/io/files/file_access.hpp"
#include "tests/evidence/evidence_checks.hpp"
#include "tests/evidence/evidence_pictures.hpp"
#include "tests/evidence/page_tables.hpp"
#include "tests/evidence/patient_tables.hpp"
#include "tests/surgeries/study_program.hpp"

namespace brainshift::evidence {
namespace {

// The tables of docs/evidence.md, from what the study has written so far.
Status write_page(const surgeries::Rows& rows, const std::filesystem::path& folder) {
  const auto checks = bench::CsvTable::read(folder / "checks.csv");
  if (!checks) return tl::unexpected(checks.error());
  std::string page;
  for (const std::string& study : surgeries::Rows(*checks).values("study")) {
    page += fmt::format("{}\n\n{}\n", study, claims_table(*checks, study));
    const surgeries::Rows head = rows.where("head", study);
    if (!head.empty()) page += truths_table(head) + "\n";
  }
  if (std::filesystem::exists(folder / "landmarks.csv")) {
    const auto landmarks = bench::CsvTable::read(folder / "landmarks.csv");
    if (!landmarks) return tl::unexpected(landmarks.error());
    page += landmarks_table(*landmarks);
  }
  return io::write_file(folder / "page.md", page);
}

Status run(const std::vector<std::filesystem::path>& files) {
  const char* folder = std::getenv("BRAINSHIFT_STUDY_DIR");
  if (folder == nullptr) {
    return fail(ErrorCode::kInvalidArgument, "BRAINSHIFT_STUDY_DIR is not set");
  }
  bench::CsvTable all;
  for (const auto& file : files) {
    const auto table = bench::CsvTable::read(file);
    if (!table) return tl::unexpected(table.error());
    if (Status ok = all.append(*table); !ok) {
      return fail(ok.error().code, file.string() + ": " + ok.error().message);
    }
  }
  const surgeries::Rows rows(all);
  if (rows.empty()) return fail(ErrorCode::kEmptySet, "no surgery in the tables");
  for (const std::string& head : rows.values("head")) {
    const surgeries::Rows own = rows.where("head", head);
    check_evidence(own);
    const auto file = std::filesystem::path(folder) / ("patients-" + head + ".md");
    if (Status ok = write_patient_tables(own, file); !ok) return ok;
  }
  if (Status ok = write_page(rows, folder); !ok) return ok;
  return draw_evidence(rows, folder);
}

}  // namespace
}  // namespace brainshift::evidence

int main(int argc, char** argv) {
  std::vector<std::filesystem::path> tables;
  CLI::App app{"Checks and pictures of the evidence study.", "evidence_summary"};
  app.add_option("tables", tables, "tables of evidence")->required();
  return brainshift::surgeries::run_study(app, argc, argv,
                                          [&] { return brainshift::evidence::run(tables); });
}
