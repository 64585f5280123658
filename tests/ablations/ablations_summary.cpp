// SPDX-License-Identifier: GPL-3.0-or-later
// ablations_summary TABLE: checks, pictures and the table of docs/ablations.md from the table of
// `ablations`, into $BRAINSHIFT_STUDY_DIR (study_record.hpp). It measures nothing; study_summary
// tells whether the checks hold.
#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>

#include "common/io/files/file_access.hpp"
#include "tests/ablations/ablation_tables.hpp"
#include "tests/surgeries/study_program.hpp"

namespace brainshift::ablations {
namespace {

Status run(const std::filesystem::path& file) {
  const char* folder = std::getenv("BRAINSHIFT_STUDY_DIR");
  if (folder == nullptr) {
    return fail(ErrorCode::kInvalidArgument, "BRAINSHIFT_STUDY_DIR is not set");
  }
  const auto table = bench::CsvTable::read(file);
  if (!table) return tl::unexpected(table.error());
  const surgeries::Rows rows(*table);
  if (rows.empty()) return fail(ErrorCode::kEmptySet, file.string() + ": no surgery");
  check_ablations(rows);
  const std::filesystem::path out(folder);
  const std::string page = parts_table(rows) + "\n" + left_out_list();
  if (Status ok = io::write_file(out / "page.md", page); !ok) return ok;
  if (Status ok = io::write_file(out / "rows.csv", short_rows(rows)); !ok) return ok;
  return draw_ablations(rows, out);
}

}  // namespace
}  // namespace brainshift::ablations

int main(int argc, char** argv) {
  std::filesystem::path table;
  CLI::App app{"Checks, table and pictures of the ablations.", "ablations_summary"};
  app.add_option("table", table, "table of ablations")->required();
  return brainshift::surgeries::run_study(app, argc, argv,
                                          [&] { return brainshift::ablations::run(table); });
}
