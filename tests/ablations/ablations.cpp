// SPDX-License-Identifier: GPL-3.0-or-later
// ablations: the default estimate with one part off, or one on that it leaves out, over the truths
// of `make evidence` and motions of `make surgeries`. One row of a table per update.
//
// What it finds decides which parts the default has. So it begins at seed 1001, and not at seed 1,
// where the surgeries that are published begin: nothing is fitted to them.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "common/linalg/openblas.hpp"
#include "tests/ablations/ablation_patient.hpp"
#include "tests/surgeries/study_program.hpp"

namespace brainshift::ablations {
namespace {

namespace fs = std::filesystem;

struct Arguments : surgeries::StudyArguments {
  fs::path cases = BRAINSHIFT_CASES;
  std::vector<int> patients = {1, 2, 3, 4, 5};
  std::vector<std::string> truths = truth_names();
  std::vector<std::string> variants;  // none: all
};

Status run(const Arguments& arguments) {
  std::vector<Part> parts = all_parts();
  if (!arguments.variants.empty()) parts = *parts_from(arguments.variants);
  auto rows = open_ablations(arguments.out, arguments.resume);
  if (!rows) return tl::unexpected(rows.error());
  for (const int patient : arguments.patients) {
    AblationPlan plan;
    auto config =
        surgeries::read_head(arguments.cases / ("patient-" + std::to_string(patient) + ".yaml"));
    if (!config) return tl::unexpected(config.error());
    plan.config = std::move(*config);
    plan.head = "colin27";
    plan.patient = patient;
    plan.first = patient == arguments.patients.front();
    plan.thousand_nodes = arguments.thousand_nodes;
    plan.parts = parts;
    plan.surgeries = surgeries_of(patient, arguments.first_seed, arguments.truths);
    const auto tell = [patient](const std::string& variant, int surgeries, double prepared_s,
                                double seconds) {
      std::fprintf(stderr, "  patient %d %-18s %2d surgeries, prepared in %4.1f s; %5.1f s\n",
                   patient, variant.c_str(), surgeries, prepared_s, seconds);
    };
    if (Status ok = play_patient(plan, *rows, tell); !ok) {
      return fail(ok.error().code,
                  "patient " + std::to_string(patient) + ": " + ok.error().message);
    }
  }
  return {};
}

std::string known_variant(const std::string& name) {
  const auto parts = parts_from({name});
  return parts ? "" : parts.error().message;
}

}  // namespace
}  // namespace brainshift::ablations

int main(int argc, char** argv) {
  brainshift::linalg::choose_blas_kernel();
  brainshift::ablations::Arguments arguments;
  arguments.thousand_nodes = 6.0;
  arguments.first_seed = 1001;
  CLI::App app{"The default estimate with one part off or on: a row per update.", "ablations"};
  app.add_option("--cases", arguments.cases, "folder with patient-N.yaml")->capture_default_str();
  app.add_option("--patients", arguments.patients, "of the paper, separated by spaces")
      ->check(CLI::Range(1, brainshift::evidence::kPatients));
  app.add_option("--truths", arguments.truths, "names, separated by spaces; default: all of them")
      ->check(CLI::IsMember(brainshift::ablations::truth_names()));
  app.add_option("--variants", arguments.variants, "names, separated by spaces; default: all")
      ->check(brainshift::ablations::known_variant);
  brainshift::surgeries::add_study_options(app, arguments);
  return brainshift::surgeries::run_study(app, argc, argv,
                                          [&] { return brainshift::ablations::run(arguments); });
}
