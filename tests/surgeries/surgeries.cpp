// SPDX-License-Identifier: GPL-3.0-or-later
// surgeries: many different simulated surgeries on one head, estimated by the default method with
// the case's defaults, one row of a table per update. The truths are those of scenarios
// (client/tools/twin) and of kinds from outside the prior (outside/kinds.hpp).
//
// Place k of a run is the patient of seed `first_seed` + k - 1
// (tests/simulation/variation.hpp); its surgeries have the seeds that follow those of the
// place before, from `first_seed` (tests/simulation/variation.hpp). The run that is published
// begins at seed 1. While the estimate is being worked on, runs begin at 1001, so that nothing is
// fitted to what is published.
//
// With --patients the places are the paper's patients instead, with their own tumour and opening
// (config/cases/patient-N.yaml): rows of the head `patients`, place N.
//
// study_program.hpp says where the images of the case are looked for.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/core/stopwatch.hpp"
#include "common/linalg/openblas.hpp"
#include "common/patient/read_patient.hpp"
#include "tests/simulation/variation.hpp"
#include "tests/surgeries/outside/kinds.hpp"
#include "tests/surgeries/study_program.hpp"
#include "tests/surgeries/surgery_place.hpp"

namespace brainshift::surgeries {
namespace {

namespace fs = std::filesystem;

// joint-distension is left out: it is the same truth as distension with more to see.
const std::vector<std::string> kScenarios = {"paper",     "paper-icp",        "distension",
                                             "joint-sag", "joint-tangential", "joint-mixed",
                                             "resection", "retraction"};

// Results must not depend on what else the machine does.
constexpr double kNoDeadline_ms = 600000.0;

struct Arguments : StudyArguments {
  fs::path head = BRAINSHIFT_DEFAULT_CASE;
  int places = 5;
  int seeds = 4;  // per place
  // Names; both lists in full when neither is given.
  std::vector<std::string> scenarios, kinds;
  std::vector<int> patients;
  bool fixed_strengths = false;
};

std::vector<std::string> every_kind() {
  std::vector<std::string> names;
  for (const outside::Kind& kind : outside::all_kinds()) names.push_back(kind.name);
  return names;
}

std::vector<std::uint64_t> seeds_of(const Arguments& arguments, int place) {
  std::vector<std::uint64_t> seeds;
  for (int i = 0; i < arguments.seeds; ++i) {
    seeds.push_back(arguments.first_seed +
                    static_cast<std::uint64_t>((place - 1) * arguments.seeds + i));
  }
  return seeds;
}

bool finished(const PlacePlan& plan, const RowFile& rows) {
  for (const std::uint64_t seed : plan.seeds) {
    for (const auto* names : {&plan.scenarios, &plan.kinds}) {
      for (const std::string& name : *names) {
        if (!rows.has(SurgeryKey{plan.head, plan.place, seed, name}.texts())) return false;
      }
    }
  }
  return true;
}

void tell(const SurgeryKey& key, const Row& last, double seconds) {
  std::fprintf(
      stderr,
      "  seed %llu %-17s recovered %s %%, field %s of %s mm (at most %s), coverage near %s, "
      "far %s, %s, %s; %.1f s\n",
      static_cast<unsigned long long>(key.seed), key.scenario.c_str(),
      text_of(last, "recovered_pct").c_str(), text_of(last, "field_mean_mm").c_str(),
      text_of(last, "none_field_mean_mm").c_str(), text_of(last, "field_max_mm").c_str(),
      text_of(last, "near_coverage_90").c_str(), text_of(last, "far_coverage_90").c_str(),
      text_of(last, "quality").c_str(), text_of(last, "status").c_str(), seconds);
}

Status run_place(const Arguments& arguments, CaseConfig patient, const PlacePlan& plan,
                 RowFile& rows) {
  patient.condensed.deadline_ms = kNoDeadline_ms;
  if (arguments.fixed_strengths) patient.prior.estimate_scales = false;
  const auto& tumour = std::get<TumourEllipsoid>(patient.tumour);
  const Stopwatch watch;
  const bench::MeshWish wish{patient.case_id, arguments.thousand_nodes};
  const auto head = bench::make_head(patient, wish);
  if (!head) return tl::unexpected(head.error());
  std::fprintf(stderr,
               "place %d: tumour at (%.0f %.0f %.0f) mm with half axes %.0f %.0f %.0f mm; %d "
               "nodes, %zu slaves; prepared in %.0f s\n",
               plan.place, tumour.centre_mm[0], tumour.centre_mm[1], tumour.centre_mm[2],
               tumour.semi_axes_mm[0], tumour.semi_axes_mm[1], tumour.semi_axes_mm[2],
               head->model->mesh.num_nodes(), head->model->slaves.size(), watch.seconds());
  return play_place(*head, plan, rows, tell);
}

// patient: makes the place's patient. Nothing to do where `rows` has all its surgeries.
Status run_plan(const Arguments& arguments, const PlacePlan& plan,
                const std::function<Result<CaseConfig>()>& patient, RowFile& rows) {
  if (finished(plan, rows)) return {};
  const auto config = patient();
  const Status ok =
      config ? run_place(arguments, *config, plan, rows) : Status(tl::unexpected(config.error()));
  if (ok) return {};
  return fail(ok.error().code,
              plan.head + ", place " + std::to_string(plan.place) + ": " + ok.error().message);
}

PlacePlan plan_of(const Arguments& arguments, const std::string& head, int place) {
  return {head,
          place,
          arguments.first_seed + static_cast<std::uint64_t>(place - 1),
          seeds_of(arguments, place),
          arguments.scenarios,
          arguments.kinds};
}

Status run_places(const Arguments& arguments, RowFile& rows) {
  const auto config = read_head(arguments.head);
  if (!config) return tl::unexpected(config.error());
  const auto brain = patient::build_patient(*config);
  if (!brain) return tl::unexpected(brain.error());
  for (int place = 1; place <= arguments.places; ++place) {
    const PlacePlan plan = plan_of(arguments, config->case_id, place);
    const auto varied = [&] {
      return client::vary_patient(*config, brain->mesh, plan.patient_seed);
    };
    if (Status ok = run_plan(arguments, plan, varied, rows); !ok) return ok;
  }
  return {};
}

Status run_patients(const Arguments& arguments, RowFile& rows) {
  for (const int patient : arguments.patients) {
    const fs::path file =
        arguments.head.parent_path() / ("patient-" + std::to_string(patient) + ".yaml");
    const auto own = [&file] { return read_head(file); };
    if (Status ok = run_plan(arguments, plan_of(arguments, "patients", patient), own, rows); !ok) {
      return ok;
    }
  }
  return {};
}

Status run(Arguments arguments) {
  if (arguments.scenarios.empty() && arguments.kinds.empty()) {
    arguments.scenarios = kScenarios;
    arguments.kinds = every_kind();
  }
  if (std::find(arguments.kinds.begin(), arguments.kinds.end(), "all") != arguments.kinds.end()) {
    arguments.kinds = every_kind();
  }
  auto rows = open_surgeries(arguments.out, arguments.resume);
  if (!rows) return tl::unexpected(rows.error());
  return arguments.patients.empty() ? run_places(arguments, *rows) : run_patients(arguments, *rows);
}

}  // namespace
}  // namespace brainshift::surgeries

int main(int argc, char** argv) {
  brainshift::linalg::choose_blas_kernel();
  brainshift::surgeries::Arguments arguments;
  CLI::App app{"Different simulated surgeries on one head, scored: a row per update.", "surgeries"};
  app.add_option("--head", arguments.head, "case file of the head")->capture_default_str();
  app.add_option("--places", arguments.places, "tumours with their openings")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  app.add_option("--seeds", arguments.seeds, "surgeries per place and scenario")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  app.add_option("--patients", arguments.patients,
                 "of the paper, instead of places: patient-N.yaml beside the head's case file")
      ->check(CLI::Range(1, 5));
  app.add_flag("--fixed-strengths", arguments.fixed_strengths,
               "estimate with prior.scales: fixed, which the default is compared with");
  app.add_option("--scenarios", arguments.scenarios, "names, separated by spaces")
      ->check([](const std::string& name) {
        return brainshift::client::find_scenario(name) ? "" : name + " is unknown";
      });
  app.add_option("--kinds", arguments.kinds,
                 "of truths from outside, separated by commas, or all; with --scenarios or --kinds "
                 "only what is named is played")
      ->delimiter(',')
      ->check([](const std::string& name) {
        return name == "all" || brainshift::outside::find_kind(name) ? "" : name + " is unknown";
      });
  brainshift::surgeries::add_study_options(app, arguments);
  return brainshift::surgeries::run_study(app, argc, argv,
                                          [&] { return brainshift::surgeries::run(arguments); });
}
