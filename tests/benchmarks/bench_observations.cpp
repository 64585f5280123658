// SPDX-License-Identifier: GPL-3.0-or-later
// A surgery file without truth for measuring latency: every moment of a scenario is observed again
// and again, with other points and other noise each time, so that no observation is there twice.
//   build/release/bin/bench_observations --scenario sag-progress --each 100 --out sag.surgery
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>

#include "client/tools/twin/simulate.hpp"
#include "client/tools/twin/surgery.hpp"
#include "client/tools/twin/truth_brain.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/linalg/openblas.hpp"
#include "common/patient/read_patient.hpp"
#include "common/wire/convert.hpp"

namespace brainshift {
namespace {

struct Arguments {
  std::filesystem::path case_file = BRAINSHIFT_DEFAULT_CASE;
  std::filesystem::path out;
  std::string scenario;
  int each = 1;
  std::uint64_t seed = 1;
};

// Solves anew only where the load is another one than before.
class LastSolution final : public client::TruthSource {
 public:
  explicit LastSolution(client::TruthSource& solver) : solver_(solver) {}

  Result<client::Truth> solve(const Points& load) override {
    if (solved_ && load.cols() == load_.cols() && load == load_) return *solved_;
    auto solved = solver_.solve(load);
    if (!solved) return solved;
    load_ = load;
    solved_ = *solved;
    return solved;
  }

 private:
  client::TruthSource& solver_;
  Points load_;
  std::optional<client::Truth> solved_;
};

client::Scenario observed_often(const client::Scenario& scenario, int each) {
  client::Scenario often = scenario;
  often.fluid_levels_mm.clear();
  for (const double level : scenario.fluid_levels_mm) {
    often.fluid_levels_mm.insert(often.fluid_levels_mm.end(), static_cast<std::size_t>(each),
                                 level);
  }
  return often;
}

Status run(const Arguments& arguments) {
  const client::Scenario* scenario = client::find_scenario(arguments.scenario);
  if (scenario == nullptr) {
    return invalid("--scenario " + arguments.scenario +
                   ": unknown; see brainshift simulate --list");
  }
  const auto patient = patient::read_patient(arguments.case_file);
  if (!patient) return tl::unexpected(patient.error());
  const client::Scenario often = observed_often(*scenario, arguments.each);
  const auto brain = client::truth_brain(patient->model, patient->config, often, arguments.seed);
  if (!brain) return tl::unexpected(brain.error());
  const auto forward = client::truth_forward(*brain);
  if (!forward) return tl::unexpected(forward.error());
  client::TruthSolver solver(*forward);
  LastSolution last(solver);
  const auto surgery = client::play_scenario(*brain, last, often, arguments.seed);
  if (!surgery) return tl::unexpected(surgery.error());

  const io::SurgeryMeta meta =
      client::simulated_meta(patient->model, arguments.case_file, scenario->name, arguments.seed,
                             "brainshift bench_observations");
  auto file = io::SurgeryFile::create(arguments.out, meta);
  if (!file) return tl::unexpected(file.error());
  Status status;
  for (const Observation& observation : surgery->observations) {
    status = file->append({io::RecordKind::kObservation, observation.sequence,
                           observation.acquired_ns, wire::encode(observation)});
    if (!status) break;
  }
  if (status) status = file->close();
  if (!status) io::discard_surgery(arguments.out);
  return status;
}

}  // namespace
}  // namespace brainshift

int main(int argc, char** argv) {
  using namespace brainshift;
  linalg::choose_blas_kernel();
  linalg::use_single_threaded_blas();
  Arguments arguments;
  CLI::App app("Observations for measuring latency, none of them twice.", "bench_observations");
  app.add_option("--case", arguments.case_file, "case file")->capture_default_str();
  app.add_option("--scenario", arguments.scenario, "what happens")->required();
  app.add_option("--each", arguments.each, "observations of every instrument at every moment")
      ->capture_default_str()
      ->check(CLI::Range(1, 100000));
  app.add_option("--seed", arguments.seed, "of points and noise")->capture_default_str();
  app.add_option("--out", arguments.out, "surgery file to make")->required();
  CLI11_PARSE(app, argc, argv);
  const Status status = run(arguments);
  if (status) return 0;
  std::fprintf(stderr, "bench_observations: %s\n", status.error().message.c_str());
  return status.error().code == ErrorCode::kWriteFailed ? 1 : 2;
}
