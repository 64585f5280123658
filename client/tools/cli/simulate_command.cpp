// SPDX-License-Identifier: GPL-3.0-or-later
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "client/tools/cli/command.hpp"
#include "client/tools/twin/simulate.hpp"
#include "common/io/files/output_path.hpp"

namespace brainshift::client {
namespace {

struct SimulateArguments {
  SimulateOptions options;
  bool list = false;
};

void print_scenarios() {
  for (const ScenarioInfo& scenario : scenarios()) {
    std::printf("%-16s %s\n", scenario.name.c_str(), scenario.description.c_str());
  }
  std::printf("\nAdverse ingredients (--adverse):\n");
  for (const ScenarioInfo& ingredient : adverse_ingredients()) {
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
    return fail(ErrorCode::kInvalidArgument, std::string(option) + " is required (or --list)");
  };
  if (Status ok = required(!arguments.options.case_file.empty(), "--case"); !ok) return ok;
  if (Status ok = required(!arguments.options.scenario.empty(), "--scenario"); !ok) return ok;
  if (Status ok = required(!arguments.options.out.empty(), "--out"); !ok) return ok;
  if (Status ok = io::check_output_file("--out", arguments.options.out); !ok) return ok;
  return simulate(arguments.options, terminal_progress());
}

}  // namespace

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
      "paper.surgery");
  command->callback([arguments, &status] { status = run_simulate(*arguments); });
}

}  // namespace brainshift::client
