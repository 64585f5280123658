// SPDX-License-Identifier: GPL-3.0-or-later
// evidence_calculix: what goes into CalculiX and what comes out of it, for
// cmake/scripts/calculix.sh.
//   write  the includes of calculix/patient.inp for the twin of one of the paper's patients, with
//          the load of its consistency truth
//   read   what CalculiX printed, as a table beside nodes.csv; says how far it lies from that truth
// For `make bench` too (peers.csv): forward.csv has how long the twin's own forward model takes for
// the same forces, apart.csv how far CalculiX lies from it.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <utility>

#include "client/tools/twin/load.hpp"
#include "client/tools/twin/truth_load.hpp"
#include "common/anatomy/brain_model_builder.hpp"
#include "common/core/stopwatch.hpp"
#include "common/io/config/config_file.hpp"
#include "common/linalg/openblas.hpp"
#include "tests/benchmarks/bench_head.hpp"
#include "tests/evidence/calculix.hpp"
#include "tests/evidence/patient_twin.hpp"
#include "tests/surgeries/played_brain.hpp"
#include "tests/surgeries/study_program.hpp"

namespace brainshift::evidence {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  fs::path cases = BRAINSHIFT_CASES, folder = ".";
  int patient = 1;
  double thousand_nodes = 18.0;
  bool linear = false;
};

struct Twin {
  std::unique_ptr<surgeries::PlayedBrain> played;
  DeckLoad load;
  Points displacement;  // of the consistency truth
};

// The load of the consistency truth: what acts, times the scale that the twin found for it.
DeckLoad load_of(const client::TruthBrain& brain, const client::Scenario& scenario,
                 const io::SurgeryTruth& truth) {
  const double scale = truth.scalars.at("load_scale");
  const client::Gravity gravity = client::gravity_of(brain.model, scenario);
  const Points& nodes = brain.model.mesh.nodes;
  const Vec3 centre = client::swelling_centre(brain.model, scenario.swelling);
  DeckLoad load;
  load.forces = scale * client::gravity_load(brain, gravity, truth.scalars.at("fluid_level_mm"));
  load.volume_strain.resize(nodes.cols());
  for (Eigen::Index i = 0; i < nodes.cols(); ++i) {
    load.volume_strain[i] =
        scale * client::volume_strain_at(scenario.swelling, (nodes.col(i) - centre).norm());
  }
  return load;
}

Result<Twin> make_twin(const Arguments& arguments) {
  const std::string name = "patient-" + std::to_string(arguments.patient);
  auto config = surgeries::read_head(arguments.cases / (name + ".yaml"));
  if (!config) return tl::unexpected(config.error());
  const bench::MeshWish wish{name, arguments.thousand_nodes};
  if (Status ok = bench::scale_edges(*config, wish); !ok) return tl::unexpected(ok.error());
  const auto inputs = io::load_case_inputs(*config);
  if (!inputs) return tl::unexpected(inputs.error());
  const auto model = anatomy::build_brain_model(*inputs);
  if (!model) return tl::unexpected(model.error());
  const client::Scenario& scenario = *client::find_scenario(name);
  constexpr std::uint64_t kSeed = 1;  // of the noise, which no load depends on
  auto brain = client::truth_brain(*model, *config, scenario, kSeed);
  if (!brain) return tl::unexpected(brain.error());
  auto played = surgeries::factorised(std::move(*brain));
  if (!played) return tl::unexpected(played.error());
  const auto surgery = client::play_scenario((*played)->brain, (*played)->solver, scenario, kSeed);
  if (!surgery) return tl::unexpected(surgery.error());
  const io::SurgeryTruth& truth = surgery->truths.front();
  DeckLoad load = load_of((*played)->brain, scenario, truth);
  return Twin{std::move(*played), std::move(load), truth.displacement};
}

Status write_line(const fs::path& file, const std::string& heading, double first, double second) {
  std::ofstream out(file);
  out << fmt::format("{}\n{:.6g},{:.6g}\n", heading, first, second);
  out.close();
  if (out) return {};
  return fail(ErrorCode::kWriteFailed, file.string() + ": cannot be written");
}

// Assembly and factorisation, and contact for these forces from the empty set; seconds.
Status time_forward(const Twin& twin, const fs::path& file) {
  const Stopwatch factorising;
  const auto forward = client::truth_forward(twin.played->brain);
  if (!forward) return tl::unexpected(forward.error());
  const double factor_s = 1e-3 * factorising.milliseconds();
  client::TruthSolver solver(*forward);
  const Stopwatch solving;
  if (auto solved = solver.solve(twin.load.forces); !solved) return tl::unexpected(solved.error());
  return write_line(file, "factor_s,solve_s", factor_s, 1e-3 * solving.milliseconds());
}

Status write(const Arguments& arguments) {
  const auto twin = make_twin(arguments);
  if (!twin) return tl::unexpected(twin.error());
  const client::TruthBrain& brain = twin->played->brain;
  if (Status ok = write_deck(brain, twin->played->forward.contact(), twin->load, arguments.folder,
                             arguments.linear ? Tissue::kLinear : Tissue::kNeoHookean);
      !ok)
    return ok;
  if (Status ok = time_forward(*twin, arguments.folder / "forward.csv"); !ok) return ok;
  if (Status ok = write_points(brain.model.mesh.nodes, arguments.folder / "nodes.csv"); !ok) {
    return ok;
  }
  return write_points(twin->displacement, arguments.folder / "linear.csv");
}

// How far another code's field lies from the twin's own.
Status read(const Arguments& arguments) {
  const auto nodes = read_points(arguments.folder / "nodes.csv");
  if (!nodes) return tl::unexpected(nodes.error());
  const auto linear = read_points(arguments.folder / "linear.csv");
  if (!linear) return tl::unexpected(linear.error());
  const auto u =
      read_printed_displacements(arguments.folder / "patient.dat", static_cast<int>(nodes->cols()));
  if (!u) return tl::unexpected(u.error());
  const VecX apart = (*u - *linear).colwise().norm(), moved = linear->colwise().norm();
  std::printf(
      "patient %d: motion %.3f mm on average, %.3f mm at most; CalculiX differs by %.3f mm on "
      "average, %.3f mm at most\n",
      arguments.patient, moved.mean(), moved.maxCoeff(), apart.mean(), apart.maxCoeff());
  if (Status ok = write_line(arguments.folder / "apart.csv", "mean_mm,max_mm", apart.mean(),
                             apart.maxCoeff());
      !ok) {
    return ok;
  }
  return write_points(*u,
                      arguments.folder / ("patient-" + std::to_string(arguments.patient) + ".csv"));
}

}  // namespace
}  // namespace brainshift::evidence

int main(int argc, char** argv) {
  using namespace brainshift;
  linalg::choose_blas_kernel();
  evidence::Arguments arguments;
  CLI::App app{"Decks for CalculiX of the paper's patients, and the fields that it found.",
               "evidence_calculix"};
  app.require_subcommand(1);
  CLI::App* write = app.add_subcommand("write", "what calculix/patient.inp includes");
  CLI::App* read = app.add_subcommand("read", "patient.dat of CalculiX as patient-N.csv");
  for (CLI::App* command : {write, read}) {
    command->add_option("--patient", arguments.patient, "of the paper")
        ->required()
        ->check(CLI::Range(1, evidence::kPatients));
    command->add_option("--folder", arguments.folder, "of these files; it must exist")
        ->required()
        ->check(CLI::ExistingDirectory);
  }
  write->add_option("--cases", arguments.cases, "folder with patient-N.yaml")
      ->capture_default_str();
  write->add_option("--thousand-nodes", arguments.thousand_nodes, "size of the mesh")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 1000.0));
  write->add_flag("--linear", arguments.linear, "linear elastic tissue: for a deck without NLGEOM");
  return surgeries::run_study(app, argc, argv, [&] {
    return write->parsed() ? evidence::write(arguments) : evidence::read(arguments);
  });
}
