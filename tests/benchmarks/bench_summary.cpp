// SPDX-License-Identifier: GPL-3.0-or-later
// Turns what `make bench` measured into figures, tables.md and
// summary.json. Exit status 0 only if every check holds.
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "common/io/files/file_access.hpp"
#include "tests/benchmarks/bench_checks.hpp"
#include "tests/benchmarks/bench_figures.hpp"
#include "tests/benchmarks/bench_results.hpp"

namespace brainshift::bench {
namespace {

struct Arguments {
  std::filesystem::path folder = "out/bench";
  std::string commit = "unknown";
  std::vector<std::string> left_out;
  bool with_100k = false;
  bool figures_only = false;
};

// True when every check holds.
Result<bool> run(const Arguments& arguments) {
  const auto results = read_results(arguments.folder);
  if (!results) return tl::unexpected(results.error());
  const auto figures = draw_figures(*results, arguments.folder);
  if (!figures) return tl::unexpected(figures.error());
  for (const auto& file : *figures) std::printf("wrote %s\n", file.c_str());
  if (arguments.figures_only) return true;

  const auto all = checks(*results, arguments.folder.string(), arguments.with_100k);
  Status ok =
      io::write_file(arguments.folder / "tables.md", tables(*results, all, arguments.commit));
  if (ok) {
    ok = io::write_file(arguments.folder / "summary.json", to_json(all, arguments.left_out));
  }
  if (!ok) return tl::unexpected(ok.error());
  bool pass = true;
  for (const Check& check : all) {
    std::printf("%-6s %-75s %10s   %s\n", check.pass ? "ok" : "FAILS", check.name.c_str(),
                std::isfinite(check.value) ? csv_number(check.value, 4).c_str() : "-",
                check.bound.c_str());
    pass = pass && check.pass;
  }
  for (const std::string& part : arguments.left_out) std::printf("left out: %s\n", part.c_str());
  return pass;
}

}  // namespace
}  // namespace brainshift::bench

int main(int argc, char** argv) {
  using namespace brainshift;
  CLI::App app{"Figures, tables and checks of what `make bench` measured.", "bench_summary"};
  bench::Arguments arguments;
  app.add_option("--dir", arguments.folder, "folder with the measurements; results go there too")
      ->capture_default_str();
  app.add_option("--commit", arguments.commit, "for tables.md")->capture_default_str();
  app.add_option("--left-out", arguments.left_out, "a part that was not run, for summary.json");
  app.add_flag("--with-100k", arguments.with_100k, "check the mesh of 100 thousand nodes too");
  app.add_flag("--figures-only", arguments.figures_only, "no tables, no checks");
  app.footer("Exit status: 0 every check holds, 1 one does not or failure, 2 bad usage or input.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    std::fprintf(stderr, "bench_summary: %s (see bench_summary --help)\n", error.what());
    return 2;
  }
  const auto pass = bench::run(arguments);
  if (pass) return *pass ? 0 : 1;
  std::fprintf(stderr, "bench_summary: %s\n", pass.error().message.c_str());
  return pass.error().code == ErrorCode::kWriteFailed ? 1 : 2;
}
