// SPDX-License-Identifier: GPL-3.0-or-later
#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "client/tools/advise/advise.hpp"
#include "client/tools/cli/command.hpp"
#include "common/io/files/output_path.hpp"

namespace brainshift::client {
namespace {

struct AdviseArguments {
  std::filesystem::path surgery;
  std::uint64_t observations = 0;
  AdviserOptions options;
  std::string boundary = "contact";
  std::vector<double> target;
  std::filesystem::path picture;
  bool json = false;
};

Status run_advise(AdviseArguments& arguments) {
  AdviserOptions& options = arguments.options;
  if (!arguments.picture.empty()) {
    if (Status ok = io::check_output_file("--picture", arguments.picture); !ok) return ok;
  }
  if (arguments.boundary == "fixed") options.boundary = Boundary::kFixed;
  if (!arguments.target.empty()) {
    options.target_mm = Vec3(arguments.target[0], arguments.target[1], arguments.target[2]);
    if (!options.target_mm->allFinite()) return invalid("--target must be three numbers, mm");
  }
  auto adviser = Adviser::open(options);
  if (!adviser) return tl::unexpected(adviser.error());
  const auto advised =
      adviser->after(arguments.surgery, arguments.observations, terminal_progress());
  if (!advised) return tl::unexpected(advised.error());
  if (arguments.json) {
    std::fputs(advise_json(*advised).c_str(), stdout);
  } else {
    print_lines(advise_lines(*advised));
  }
  if (arguments.picture.empty()) return {};
  if (Status ok = draw_advice(*advised, arguments.picture); !ok) return ok;
  if (!arguments.json) std::printf("wrote %s\n", arguments.picture.c_str());
  return {};
}

}  // namespace

void add_advise(CLI::App& app, Status& status) {
  auto arguments = std::make_shared<AdviseArguments>();
  CLI::App* command = app.add_subcommand(
      "advise", "Rank what to measure next by how much it reduces the error at a target.");
  AdviserOptions& options = arguments->options;
  command->add_option("surgery", arguments->surgery, "surgery file or journal")->required();
  add_required(*command, "--model", options.model, "the model file that it was recorded with");
  command
      ->add_option("--observations", arguments->observations,
                   "play only the first so many observations of the file")
      ->check(CLI::PositiveNumber);
  add_with_default(*command, "--boundary", arguments->boundary, "brain-skull boundary condition")
      ->check(CLI::IsMember({"contact", "fixed"}));
  command
      ->add_option("--target", arguments->target,
                   "place in the MRI, mm RAS (three numbers); default: the tumour's boundary")
      ->expected(3);
  command->add_option("--candidates", options.candidates,
                      "table name,kind,x,y,z,radius_mm of what could be measured; default: parts "
                      "of the tumour's boundary and of the exposed cortex, points on it");
  command->add_option("--picture", arguments->picture, "also draw it (PNG)");
  command->add_flag("--json", arguments->json, "print one JSON object");
  command->footer(
      R"(It plays the file without a daemon and says nothing of what it would find: the rank follows
from what is not known yet. Examples:
  brainshift advise or.surgery --model colin27.h5 --picture advice.png
  brainshift advise or.surgery --model colin27.h5 --observations 1 --target 32 18 40 --json)");
  command->callback([arguments, &status] { status = run_advise(*arguments); });
}

}  // namespace brainshift::client
