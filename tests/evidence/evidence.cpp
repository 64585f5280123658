// SPDX-License-Identifier: GPL-3.0-or-later
// evidence: twins of the paper's five patients, against truths that share the estimate's model and
// against truths that do not, under both boundary conditions, from the tumour alone and with the
// exposed cortex. One row of a table per update.
//
// The published run begins at seed 1. While the estimate is being worked on, runs begin at 1001, so
// that nothing is fitted to what is published. The patients' cases are config/cases/patient-N.yaml;
// another head (--head) lends its images and its brainstem (study_program.hpp says where images are
// looked for).
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "common/linalg/openblas.hpp"
#include "tests/evidence/evidence_patient.hpp"
#include "tests/surgeries/study_program.hpp"

namespace brainshift::evidence {
namespace {

namespace fs = std::filesystem;

struct Arguments : surgeries::StudyArguments {
  fs::path cases = BRAINSHIFT_CASES, calculix = BRAINSHIFT_CALCULIX;
  std::string head = "colin27";
  std::vector<int> patients = {1, 2, 3, 4, 5};
  std::vector<std::string> truths;  // none: all
  int seeds = 2;
};

// The patient's tumour, opening and gravity in the wanted head.
Result<CaseConfig> read_patient(const Arguments& arguments, int patient) {
  const auto file = [&](const std::string& name) { return arguments.cases / (name + ".yaml"); };
  auto config = surgeries::read_head(file("patient-" + std::to_string(patient)));
  if (!config || arguments.head == "colin27") return config;
  const auto head = surgeries::read_head(file(arguments.head));
  if (!head) return head;
  config->file = head->file;
  config->mri = head->mri;
  config->brain = head->brain;
  config->mesh = head->mesh;
  config->brainstem = head->brainstem;
  return config;
}

bool finished(const PatientPlan& plan, const surgeries::RowFile& rows) {
  for (const TruthKind& truth : plan.truths) {
    for (const std::uint64_t seed : plan.seeds) {
      if (!rows.has(EvidenceKey{plan.head, plan.patient, truth.name, seed}.texts())) return false;
    }
  }
  return true;
}

void tell(const std::vector<surgeries::Row>& rows, double seconds) {
  for (const surgeries::Row& row : rows) {
    const auto text = [&row](const char* column) { return surgeries::text_of(row, column); };
    std::fprintf(stderr,
                 "  patient %s %-13s seed %s %-7s %-13s recovered %s %%, CPPD %s mm, coverage %s, "
                 "%s\n",
                 text("patient").c_str(), text("truth").c_str(), text("seed").c_str(),
                 text("boundary").c_str(), text("data").c_str(), text("recovered_pct").c_str(),
                 text("cppd_mm").c_str(), text("coverage_90").c_str(), text("status").c_str());
  }
  std::fprintf(stderr, "  %.1f s\n", seconds);
}

Status run(const Arguments& arguments) {
  auto rows = open_evidence(arguments.out, arguments.resume);
  if (!rows) return tl::unexpected(rows.error());
  for (const int patient : arguments.patients) {
    PatientPlan plan;
    plan.head = arguments.head;
    plan.patient = patient;
    plan.thousand_nodes = arguments.thousand_nodes;
    plan.calculix = arguments.calculix;
    for (const TruthKind& truth : truth_kinds()) {
      const auto& wanted = arguments.truths;
      if (wanted.empty() || std::find(wanted.begin(), wanted.end(), truth.name) != wanted.end()) {
        plan.truths.push_back(truth);
      }
    }
    for (int i = 0; i < arguments.seeds; ++i) {
      plan.seeds.push_back(arguments.first_seed + static_cast<std::uint64_t>(i));
    }
    if (finished(plan, *rows)) continue;
    auto config = read_patient(arguments, patient);
    if (!config) return tl::unexpected(config.error());
    plan.config = std::move(*config);
    if (Status ok = play_patient(plan, *rows, tell); !ok) {
      return fail(ok.error().code, arguments.head + ", patient " + std::to_string(patient) + ": " +
                                       ok.error().message);
    }
  }
  return {};
}

}  // namespace
}  // namespace brainshift::evidence

int main(int argc, char** argv) {
  brainshift::linalg::choose_blas_kernel();
  brainshift::evidence::Arguments arguments;
  CLI::App app{"Twins of the paper's patients against harder and harder truths: a row per update.",
               "evidence"};
  app.add_option("--cases", arguments.cases, "folder with patient-N.yaml and the heads")
      ->capture_default_str();
  app.add_option("--calculix", arguments.calculix, "folder with the fields that CalculiX found")
      ->capture_default_str();
  app.add_option("--head", arguments.head, "colin27, or another case file there: mni152")
      ->capture_default_str();
  app.add_option("--patients", arguments.patients, "of the paper, separated by spaces")
      ->check(CLI::Range(1, brainshift::evidence::kPatients));
  app.add_option("--truths", arguments.truths, "names, separated by spaces; default: all of them")
      ->check([](const std::string& name) {
        return brainshift::evidence::find_truth(name) ? "" : name + " is unknown";
      });
  app.add_option("--seeds", arguments.seeds, "surgeries per patient and truth")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  brainshift::surgeries::add_study_options(app, arguments);
  return brainshift::surgeries::run_study(app, argc, argv,
                                          [&] { return brainshift::evidence::run(arguments); });
}
