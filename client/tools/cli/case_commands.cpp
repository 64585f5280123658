// SPDX-License-Identifier: GPL-3.0-or-later
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "client/tools/cli/command.hpp"
#include "client/tools/preview/preview.hpp"
#include "client/tools/twin/adverse.hpp"
#include "client/tools/twin/simulate.hpp"
#include "common/io/files/output_path.hpp"

namespace brainshift::client {
namespace {

struct PreviewArguments {
  std::filesystem::path case_file;
  std::filesystem::path out;
};

Status run_preview(const PreviewArguments& arguments) {
  if (Status ok = io::check_output_folder("--out", arguments.out); !ok) return ok;
  const auto summary = write_preview(arguments.case_file, arguments.out, terminal_progress());
  if (!summary) return tl::unexpected(summary.error());
  print_lines(summary->facts);
  for (const std::string& line : summary->doubts) std::printf("look again: %s\n", line.c_str());
  for (const auto& file : summary->files) print_wrote(file);
  if (summary->problems.empty()) return {};
  return invalid(arguments.case_file.string() +
                 ": cannot be prepared: " + summary->problems.front());
}

struct SimulateArguments {
  SimulateOptions options;
  bool list = false;
};

void print_scenarios() {
  for (const Scenario& scenario : all_scenarios()) {
    std::printf("%-16s %s\n", scenario.name.c_str(), scenario.description.c_str());
  }
  std::printf("\nAdverse ingredients (--adverse):\n");
  for (const IngredientInfo& ingredient : all_ingredients()) {
    std::printf("%-16s %s\n", ingredient.name.c_str(), ingredient.description.c_str());
  }
}

Status run_simulate(const SimulateArguments& arguments) {
  if (arguments.list) {
    print_scenarios();
    return {};
  }
  const auto required = [](bool given, const char* option) -> Status {
    if (given) return {};
    return invalid(std::string(option) + " is required (or --list)");
  };
  if (Status ok = required(!arguments.options.case_file.empty(), "--case"); !ok) return ok;
  const bool known = !arguments.options.scenario.empty() || !arguments.options.truth.empty();
  if (Status ok = required(known, "--scenario or --truth"); !ok) return ok;
  if (Status ok = required(!arguments.options.out.empty(), "--out"); !ok) return ok;
  if (Status ok = io::check_output_file("--out", arguments.options.out); !ok) return ok;
  return simulate(arguments.options, terminal_progress()).map([&] {
    print_wrote(arguments.options.out);
  });
}

}  // namespace

void add_preview(CLI::App& app, Status& status) {
  auto arguments = std::make_shared<PreviewArguments>();
  CLI::App* command = app.add_subcommand(
      "preview", "Draw a case before it is prepared: brain, tumour, opening, gravity, contact.");
  add_required(*command, "--case", arguments->case_file, "case file (YAML)");
  add_required(*command, "--out", arguments->out, "folder to fill; made if it is missing");
  command->footer(
      R"(Example:
  brainshift preview --case config/cases/colin27.yaml --out preview
It takes seconds. Look at the pictures before every preparation: a tumour on the wrong side
or gravity along the wrong axis is seen at once. Lines that begin with "look again" name
what is unusual, and the key to look at. Exit status 2: the case cannot be prepared; what
there is of it is drawn all the same.)");
  command->callback([arguments, &status] { status = run_preview(*arguments); });
}

void add_simulate(CLI::App& app, Status& status) {
  auto arguments = std::make_shared<SimulateArguments>();
  CLI::App* command =
      app.add_subcommand("simulate", "Record a simulated surgery with its known truth.");
  SimulateOptions& options = arguments->options;
  command->add_option("--case", options.case_file, "case file (YAML)");
  command->add_option("--scenario", options.scenario, "what happens; --list shows the names");
  command->add_option("--adverse", options.adverse,
                      "what the truth has and the estimate does not believe: names separated by "
                      "commas, or all; --list shows them");
  command->add_option("--truth", options.truth,
                      "VTU whose point array displacement (mm) is the truth, on the case's mesh; "
                      "--scenario then says whose instruments look (default: joint-sag)");
  command->add_option("--seed", options.seed, "seed of noise and point selection")
      ->check(CLI::NonNegativeNumber)  // CLI11 would let a negative one wrap
      ->capture_default_str();
  command->add_option("--out", options.out, "surgery file to make; must not exist yet");
  command->add_flag("--list", arguments->list,
                    "list the scenarios and the adverse ingredients, and exit");
  command->footer(
      "Example: the paper's section 2.6 (sagging head, 200 of about 2,541 tumour points, 0.51 mm "
      "noise):\n"
      "  brainshift simulate --case config/cases/colin27.yaml --scenario paper --seed 1 --out "
      "paper.surgery\n"
      "Your own truth, from any solver, on the mesh that 'brainshift journal export --vtu' "
      "writes:\n"
      "  brainshift simulate --case config/cases/colin27.yaml --truth mine.vtu --out mine.surgery");
  command->callback([arguments, &status] { status = run_simulate(*arguments); });
}

}  // namespace brainshift::client
