// SPDX-License-Identifier: GPL-3.0-or-later
// advice_study: is the advice right? Simulated surgeries on many patients of one head; in each one
// something has been measured, every candidate is ranked, and then every one is made, with noise,
// and estimated with what was there. One row per surgery and candidate.
//
// What was measured before (state), by the surgery's number:
//   cortex   the whole opening, by stereo
//   half     the half of the tumour's boundary that lies to a side drawn at random
//   points   the middles of the opening's patches, by pointer
//   both     cortex and half
// Noise is the case's inversion.sigma_mm per component of every place. Patients, scenarios and
// seeds are those of `make surgeries` (tests/surgeries/surgeries.cpp); the published run begins at
// seed 1001: the trial seeds.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "client/tools/twin/scenario.hpp"
#include "common/advice/advice.hpp"
#include "common/core/random.hpp"
#include "common/core/stopwatch.hpp"
#include "common/geometry/surface.hpp"
#include "common/linalg/openblas.hpp"
#include "common/patient/read_patient.hpp"
#include "common/registration/surface_distances.hpp"
#include "tests/benchmarks/bench_head.hpp"
#include "tests/simulation/variation.hpp"
#include "tests/surgeries/row_file.hpp"
#include "tests/surgeries/study_program.hpp"

namespace brainshift::surgeries {
namespace {

using advice::Candidate;
using advice::Kind;

const std::vector<std::string> kScenarios = {
    "paper", "distension", "joint-sag", "joint-tangential", "joint-mixed", "retraction"};
const std::vector<std::string> kStates = {"cortex", "half", "points", "both"};

struct Arguments : StudyArguments {
  std::filesystem::path head = BRAINSHIFT_DEFAULT_CASE;
  int places = 10, seeds = 12;
};

struct Patient {
  bench::Head head;
  pipeline::Pipeline pipeline;
  std::vector<Candidate> candidates;
  advice::Target target;
};

Points at(const Patient& patient, const Points& places, const Points& field) {
  Points u(3, places.cols());
  for (Eigen::Index i = 0; i < u.cols(); ++i) {
    u.col(i) = geometry::value_at(patient.head.locator->locate(places.col(i)), field);
  }
  return u;
}

// The candidate as it is measured where the brain truly lies.
Observation measured(const Patient& patient, const Candidate& candidate, const Points& truth,
                     Random& random, const std::string& source) {
  Points u = at(patient, candidate.places, truth);
  for (double& value : u.reshaped())
    value += patient.head.config.inversion.sigma_mm * random.normal();
  Observation observation = advice::observed(candidate, u);
  observation.case_id = patient.head.model->case_id;
  observation.source = source;
  return observation;
}

std::vector<Observation> measured_before(const Patient& patient, const std::string& state,
                                         const Points& truth, Random& random) {
  const BrainModel& model = *patient.head.model;
  const auto whole = [](const TriangleSurface& surface) {
    return geometry::sample_surface(surface, static_cast<int>(geometry::area(surface)), 7);
  };
  std::vector<Observation> made;
  if (state == "cortex" || state == "both") {
    const Candidate cortex{"", Kind::kCortex, whole(registration::craniotomy_patch(model).surface)};
    made.push_back(measured(patient, cortex, truth, random, "stereo"));
  }
  if (state == "half" || state == "both") {
    const Points places = whole(model.tumour);
    const Vec3 side = random.direction(), centre = places.rowwise().mean();
    std::vector<int> columns;
    for (int i = 0; i < places.cols(); ++i) {
      if (side.dot(places.col(i) - centre) > 0.0) columns.push_back(i);
    }
    made.push_back(
        measured(patient, {"", Kind::kSweep, places(Eigen::all, columns)}, truth, random, "ius"));
  }
  if (state == "points") {
    std::vector<Vec3> middles;
    for (const Candidate& each : patient.candidates) {
      if (each.kind == Kind::kPoint) middles.push_back(each.centre());
    }
    middles.pop_back();  // that at the tumour
    made.push_back(
        measured(patient, {"", Kind::kPoint, columns_of(middles)}, truth, random, "pointer"));
  }
  return made;
}

// Root mean square error per component at the target.
double error_mm(const Patient& patient, const Points& estimate, const Points& truth) {
  const Points off = at(patient, patient.target.points, estimate - truth);
  return std::sqrt(off.squaredNorm() / static_cast<double>(off.size()));
}

struct State {
  double sd_mm = 0.0, ratio = 1.0, error_mm = 0.0;  // sd with misfit ratio 1
};

// One more observation. A source's newest replaces the one before, so that candidates of one source
// are made one after the other, each beside what was measured before them all.
Result<State> observe(Patient& patient, const Observation& observation, const Points& truth,
                      Estimate& estimate) {
  auto update = patient.pipeline.run(observation);
  if (!update) return tl::unexpected(update.error());
  estimate = std::move(update->estimate);
  if (!estimate.quality.usable()) return fail(ErrorCode::kNotConverged, estimate.quality.reason);
  const advice::Posterior posterior(*patient.pipeline.posterior(), *patient.head.locator);
  const auto target = posterior.at(patient.target.points);
  if (!target) return tl::unexpected(target.error());
  return State{posterior.sd_mm(*target), std::max(1.0, estimate.misfit_ratio),
               error_mm(patient, estimate.displacement, truth)};
}

Row row_of(int nodes, int place, std::uint64_t seed, const std::string& scenario,
           const std::string& state, const advice::Advice& one, const State& before,
           const State& after, const std::string& refused) {
  Cells cells;
  cells.add("place", std::to_string(place));
  cells.add("seed", std::to_string(seed));
  cells.add("scenario", scenario);
  cells.add("state", state);
  cells.add("nodes", std::to_string(nodes));
  cells.add("candidate", cell_text(one.candidate.name));
  cells.add("kind", std::string(to_string(one.candidate.kind)));
  cells.add("data", one.data);
  cells.add("before_sd_mm", one.before_mm);
  cells.add("predicted_sd_mm", one.reason.empty() ? one.after_mm : NAN);
  cells.add("made_sd_mm", after.sd_mm * after.ratio);
  cells.add("before_ratio", before.ratio);
  cells.add("made_ratio", after.ratio);
  cells.add("before_error_mm", before.error_mm);
  cells.add("made_error_mm", after.error_mm);
  cells.add("refused", cell_text(one.reason + refused));
  return cells.take();
}

Status play(Patient& patient, int place, std::uint64_t seed, RowFile& rows) {
  const Stopwatch watch;
  const std::string& name = kScenarios[seed % kScenarios.size()];
  const std::string& state = kStates[seed / kScenarios.size() % kStates.size()];
  const bench::Head& head = patient.head;
  const auto surgery = client::play_scenario(
      *head.model, head.config, client::vary(*client::find_scenario(name), seed), seed);
  if (!surgery) return fail(surgery.error().code, name + ": " + surgery.error().message);
  const Points& truth = surgery->truths.back().displacement;
  Random random(seed);
  Estimate estimate;
  Result<State> before = fail(ErrorCode::kEmptySet, "nothing is measured");
  patient.pipeline.reset();
  for (const Observation& each : measured_before(patient, state, truth, random)) {
    before = observe(patient, each, truth, estimate);
  }
  if (!before) return fail(before.error().code, state + ": " + before.error().message);
  const auto ranked = advice::rank(patient.pipeline, head.config, *head.locator, estimate,
                                   patient.candidates, patient.target);
  if (!ranked) return tl::unexpected(ranked.error());
  std::vector<Row> made;
  for (const advice::Advice& one : *ranked) {
    Estimate then;
    const auto after =
        observe(patient, measured(patient, one.candidate, truth, random, "advice"), truth, then);
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    made.push_back(row_of(head.model->mesh.num_nodes(), place, seed, name, state, one, *before,
                          after.value_or(State{kNaN, kNaN, kNaN}),
                          after ? std::string() : after.error().message));
  }
  std::fprintf(stderr, "  place %d seed %llu %s after %s: best %s, sd %.2f -> %.2f mm; %.1f s\n",
               place, static_cast<unsigned long long>(seed), name.c_str(), state.c_str(),
               ranked->front().candidate.name.c_str(), ranked->front().before_mm,
               ranked->front().after_mm, watch.seconds());
  return rows.append(made);
}

Result<Patient> make_patient(const Arguments& arguments, const CaseConfig& config,
                             const TetMesh& brain, int place) {
  auto varied = client::vary_patient(config, brain,
                                     arguments.first_seed + static_cast<std::uint64_t>(place - 1));
  if (!varied) return tl::unexpected(varied.error());
  auto head = bench::make_head(*varied, {varied->case_id, arguments.thousand_nodes});
  if (!head) return tl::unexpected(head.error());
  auto inverter = inversion::condensed_inverter(head->operators, head->locator, head->config);
  if (!inverter) return tl::unexpected(inverter.error());
  auto pipeline = pipeline::Pipeline::build(*head->model, head->config, Method::kCondensed,
                                            Boundary::kContact, std::move(*inverter));
  if (!pipeline) return tl::unexpected(pipeline.error());
  auto candidates = advice::default_candidates(*head->model);
  auto target = advice::tumour_target(*head->model);
  return Patient{std::move(*head), std::move(*pipeline), std::move(candidates), std::move(target)};
}

Status run(const Arguments& arguments) {
  const auto config = read_head(arguments.head);
  if (!config) return tl::unexpected(config.error());
  auto rows = RowFile::open(arguments.out, row_of(0, 0, 0, "", "", {}, {}, {}, ""),
                            {"place", "seed"}, arguments.resume);
  if (!rows) return tl::unexpected(rows.error());
  const auto brain = patient::build_patient(*config);
  if (!brain) return tl::unexpected(brain.error());
  for (int place = 1; place <= arguments.places; ++place) {
    std::vector<std::uint64_t> seeds;
    for (int i = 0; i < arguments.seeds; ++i) {
      const auto seed =
          arguments.first_seed + static_cast<std::uint64_t>((place - 1) * arguments.seeds + i);
      if (!rows->has({std::to_string(place), std::to_string(seed)})) seeds.push_back(seed);
    }
    if (seeds.empty()) continue;
    auto patient = make_patient(arguments, *config, brain->mesh, place);
    if (!patient)
      return fail(patient.error().code,
                  fmt::format("place {}: {}", place, patient.error().message));
    for (const std::uint64_t seed : seeds) {
      if (Status ok = play(*patient, place, seed, *rows); !ok) {
        // It is no surgery of this study: the scenario does nothing here, or the field is unusable.
        std::fprintf(stderr, "  place %d seed %llu left out: %s\n", place,
                     static_cast<unsigned long long>(seed), ok.error().message.c_str());
        if (ok.error().code == ErrorCode::kWriteFailed) return ok;
      }
    }
  }
  return {};
}

}  // namespace
}  // namespace brainshift::surgeries

int main(int argc, char** argv) {
  brainshift::linalg::choose_blas_kernel();
  brainshift::surgeries::Arguments arguments;
  arguments.first_seed = 1001;
  arguments.thousand_nodes = 6;
  CLI::App app{"Advice on what to measure next against brute force: a row per candidate.",
               "advice_study"};
  app.add_option("--head", arguments.head, "case file of the head")->capture_default_str();
  app.add_option("--places", arguments.places, "tumours with their openings")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  app.add_option("--seeds", arguments.seeds, "surgeries per place")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  brainshift::surgeries::add_study_options(app, arguments);
  return brainshift::surgeries::run_study(app, argc, argv,
                                          [&] { return brainshift::surgeries::run(arguments); });
}
