// SPDX-License-Identifier: GPL-3.0-or-later
// ablations_summary TABLE: checks, pictures and the table of docs/ablations.md from the table of
// `ablations`, into $BRAINSHIFT_STUDY_DIR (study_record.hpp). It measures nothing; study_summary
// tells whether the checks hold.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "common/io/files/file_access.hpp"
#include "tests/ablations/ablation_tables.hpp"

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
  app.footer("Exit status: 0 summarised, 1 failure, 2 bad usage.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    std::fprintf(stderr, "ablations_summary: %s (see ablations_summary --help)\n", error.what());
    return 2;
  }
  const auto ok = brainshift::ablations::run(table);
  if (ok) return 0;
  std::fprintf(stderr, "ablations_summary: %s\n", ok.error().message.c_str());
  return 1;
}
