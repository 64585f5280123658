// SPDX-License-Identifier: GPL-3.0-or-later
// Speed of the forward model on the default head: assembly, analysis
// and factorisation, single solve, solves in blocks of 64, prior. One
// BLAS thread. The case file may be given in BRAINSHIFT_CASE.
#include <benchmark/benchmark.h>

#include <cstdio>
#include <cstdlib>
#include <memory>

#include "common/contact/forward_model.hpp"
#include "common/inversion/prepared/prepared_model.hpp"
#include "common/linalg/openblas.hpp"
#include "common/operators/encode_columns.hpp"
#include "common/patient/read_patient.hpp"

namespace brainshift {
namespace {

const patient::Patient& head() {
  static const patient::Patient loaded = [] {
    const char* name = std::getenv("BRAINSHIFT_CASE");
    auto made = patient::read_patient(name != nullptr ? name : BRAINSHIFT_DEFAULT_CASE);
    if (!made) {
      std::fprintf(stderr, "%s\n", made.error().message.c_str());
      std::exit(2);
    }
    return std::move(*made);
  }();
  return loaded;
}

const contact::ForwardModel& forward() {
  static const auto model =
      contact::ForwardModel::build(head().model, head().config, Boundary::kContact);
  return *model;
}

void Assembly(benchmark::State& state) {
  const contact::ForwardModel& model = forward();
  for (auto _ : state) {
    benchmark::DoNotOptimize(fem::assemble_stiffness(
        head().model.mesh, fem::elasticity_from(head().config.material), model.dofs()));
  }
  state.counters["nodes"] = head().model.mesh.num_nodes();
  state.counters["tets"] = head().model.mesh.num_tets();
}
BENCHMARK(Assembly)->Unit(benchmark::kMillisecond);

void AnalyseAndFactorise(benchmark::State& state) {
  double factor_s = 0.0, analyse_s = 0.0;
  for (auto _ : state) {
    auto factor = linalg::SparseCholesky::factorise(forward().stiffness());
    factor_s += factor->factor_seconds();
    analyse_s += factor->analyse_seconds();
    benchmark::DoNotOptimize(factor);
  }
  const auto runs = static_cast<double>(state.iterations());
  state.counters["factor_s"] = factor_s / runs;
  state.counters["analyse_s"] = analyse_s / runs;
  state.counters["nnz_L"] = static_cast<double>(forward().factor().nonzeros());
}
BENCHMARK(AnalyseAndFactorise)->Unit(benchmark::kMillisecond)->Iterations(3);

void SingleSolve(benchmark::State& state) {
  const VecX b = VecX::LinSpaced(forward().dofs().num_unknowns(), -1.0, 1.0);
  VecX x;
  for (auto _ : state) {
    forward().factor().solve(b, x);
    benchmark::DoNotOptimize(x.data());
  }
}
BENCHMARK(SingleSolve)->Unit(benchmark::kMillisecond);

void solve_rows(const Eigen::MatrixXd& b, benchmark::State& state) {
  for (auto _ : state) {
    fem::StiffnessFactor::Workspace workspace;
    Eigen::MatrixXd x;
    forward().factor().solve_rows(b, x, workspace);
    benchmark::DoNotOptimize(x.data());
  }
}

void SolveInBlocksOf64(benchmark::State& state) {
  const Eigen::MatrixXd b = Eigen::MatrixXd::Random(64, forward().dofs().num_unknowns());
  solve_rows(b, state);
  state.counters["per_column"] = benchmark::Counter(
      64.0, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(SolveInBlocksOf64)->Unit(benchmark::kMillisecond);

// Loads of 64 slaves that are neighbours, as the contact columns are solved: the forward half skips
// what they do not reach.
void SolveNeighboursInBlocksOf64(benchmark::State& state) {
  const auto& pairs = forward().contact().pairs();
  Points slaves(3, static_cast<Eigen::Index>(pairs.size()));
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    slaves.col(static_cast<Eigen::Index>(i)) = head().model.mesh.nodes.col(pairs[i].slave);
  }
  const SpatialBlocks blocks = spatial_blocks(slaves, 64);
  const auto first = blocks.block(blocks.size() / 2);
  Points nodal;
  VecX column;
  Eigen::MatrixXd b(static_cast<Eigen::Index>(first.size()), forward().dofs().num_unknowns());
  for (std::size_t j = 0; j < first.size(); ++j) {
    const auto& pair = pairs[static_cast<std::size_t>(first[j])];
    nodal.setZero(3, head().model.mesh.num_nodes());
    nodal.col(pair.slave) = pair.normal;
    forward().dofs().restrict_to(nodal, column);
    b.row(static_cast<Eigen::Index>(j)) = column.transpose();
  }
  solve_rows(b, state);
  state.counters["per_column"] = benchmark::Counter(
      static_cast<double>(first.size()),
      benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(SolveNeighboursInBlocksOf64)->Unit(benchmark::kMillisecond);

void ApplyPrior(benchmark::State& state) {
  static const auto prepared = inversion::PreparedModel::prepare(
      std::make_shared<const BrainModel>(head().model), head().config, Boundary::kContact);
  const prior::ForcePrior& prior = prepared->prior();
  const Points w = Points::Random(3, head().model.mesh.num_nodes());
  Points f;
  for (auto _ : state) {
    prior.apply(w, f);
    benchmark::DoNotOptimize(f.data());
  }
}
BENCHMARK(ApplyPrior)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace brainshift

int main(int argc, char** argv) {
  brainshift::linalg::choose_blas_kernel();
  brainshift::linalg::use_single_threaded_blas();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
