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
  bool figures_only = false;
  bool machine = false;
};

// True when every check holds.
Result<bool> run(const Arguments& arguments) {
  if (arguments.machine) {
    std::printf("%s\n", machine_line(arguments.commit).c_str());
    return true;
  }
  const auto results = read_results(arguments.folder);
  if (!results) return tl::unexpected(results.error());
  const auto figures = draw_figures(*results, arguments.folder);
  if (!figures) return tl::unexpected(figures.error());
  for (const auto& file : *figures) std::printf("wrote %s\n", file.c_str());
  if (arguments.figures_only) return true;

  const auto all = checks(*results, arguments.folder.string());
  Status ok = io::write_file(arguments.folder / "tables.md", tables(*results, all));
  if (ok) {
    ok = io::write_file(arguments.folder / "summary.json", to_json(all, results->left_out));
  }
  if (!ok) return tl::unexpected(ok.error());
  bool pass = true;
  for (const Check& check : all) {
    std::printf("%-6s %-75s %10s   %s\n", check.pass ? "ok" : "FAILS", check.name.c_str(),
                std::isfinite(check.value) ? csv_number(check.value, 4).c_str() : "-",
                check.bound.c_str());
    pass = pass && check.pass;
  }
  for (const std::string& part : results->left_out) std::printf("left out: %s\n", part.c_str());
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
  app.add_flag("--machine", arguments.machine, "print what machine.txt holds, and no more");
  app.add_option("--commit", arguments.commit, "for --machine")->capture_default_str();
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
