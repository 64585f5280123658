// SPDX-License-Identifier: GPL-3.0-or-later
// How far method condensed is from the posterior that it stands for, at
// every node of a real head.
//
// The reference takes another road. For the final active set of the method it factorises K_p = K +
// Q^T beta Q anew (paper eq. 16), solves for the 3m columns V = K_p^-1 A^T, and (Sigma with the
// strength of its parts that the method has estimated)
//   u = u0 + K_p^-1 Sigma V mu,   (V^T Sigma V + R) mu = d - A u0,   K_p u0 = Q^T beta p
// with the variances R that the method gave the data: outliers count less (robust_weights.hpp).
// Exit status: 0 when the method, with all its modes, is within kReducedBound_mm; 1 when not, or on
// a failure; 2 for bad usage or bad input.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "client/tools/twin/surgery.hpp"
#include "common/core/stopwatch.hpp"
#include "common/fem/sampling.hpp"
#include "common/fem/stiffness_factor.hpp"
#include "common/inversion/condensed/condensed_inverter.hpp"
#include "common/inversion/contract/data_check.hpp"
#include "common/inversion/prepared/condense.hpp"
#include "common/io/model/model_file.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/linalg/blas.hpp"
#include "common/linalg/openblas.hpp"
#include "common/patient/read_patient.hpp"
#include "common/wire/convert.hpp"

namespace brainshift {
namespace {

using Eigen::MatrixXd;
using inversion::PreparedModel;

constexpr double kReducedBound_mm = 0.01;
constexpr int kFewerRanks[] = {32, 64};  // beside the case's own

struct Arguments {
  std::string case_file = BRAINSHIFT_DEFAULT_CASE;
  std::string model_file, surgery, out;
  std::string scenario = "paper";
  std::uint64_t seed = 1;
};

// Model and case: from a model file, or made from the case file.
Result<io::ModelFile> load_head(const Arguments& arguments) {
  if (!arguments.model_file.empty()) return io::read_model(arguments.model_file);
  auto made = patient::read_patient(arguments.case_file);
  if (!made) return tl::unexpected(made.error());
  return io::ModelFile{std::move(made->config), std::move(made->model)};
}

// The first observation: of a surgery file, or of a scenario played here.
Result<Observation> first_observation(const Arguments& arguments, const io::ModelFile& head) {
  if (arguments.surgery.empty()) {
    const auto* scenario = client::find_scenario(arguments.scenario);
    if (scenario == nullptr) return invalid("--scenario " + arguments.scenario + ": unknown");
    auto played = client::play_scenario(head.model, head.config, *scenario, arguments.seed);
    if (!played) return tl::unexpected(played.error());
    return played->observations.front();
  }
  auto file = io::SurgeryFile::open(arguments.surgery);
  if (!file) return tl::unexpected(file.error());
  const auto records = file->records(io::RecordKind::kObservation);
  if (!records) return tl::unexpected(records.error());
  if (records->empty()) return invalid(arguments.surgery + ": holds no observation");
  return wire::decode_observation(records->front().payload);
}

Result<SparseData> sparse_data(const Observation& observation, const CaseConfig& config) {
  const auto* pairs = std::get_if<LandmarkPairs>(&observation.body);
  if (pairs == nullptr) {
    return invalid(
        "the surgery's first observation holds no landmark pairs; choose a scenario with "
        "displacements, such as paper");
  }
  return SparseData{pairs->undeformed, pairs->deformed - pairs->undeformed,
                    VecX::Constant(pairs->undeformed.cols(), config.inversion.sigma_mm)};
}

Eigen::Map<const VecX> flat(const Points& field) { return {field.data(), field.size()}; }

// The posterior mean for a set of active slaves by the road described above.
Result<Points> direct_posterior(const PreparedModel& model, const SparseData& data,
                                const std::vector<NodeIndex>& active_nodes,
                                const prior::ForcePrior& prior) {
  const contact::ForwardModel& forward = model.forward();
  const int nodes = model.model().mesh.num_nodes(), rows = 3 * data.size();
  contact::ActiveSet active;
  for (const auto& pair : forward.contact().pairs()) {
    active.push_back(static_cast<char>(
        std::binary_search(active_nodes.begin(), active_nodes.end(), pair.slave)));
  }
  linalg::SymmetricMatrix k_p = forward.stiffness();
  forward.contact().add_stiffness(k_p, forward.dofs(), active);
  auto cholesky = linalg::SparseCholesky::factorise(k_p);
  if (!cholesky) return tl::unexpected(cholesky.error());
  const fem::StiffnessFactor factor(std::move(*cholesky));
  const auto solve = [&](const Points& load) {
    return forward.dofs().expand(factor.solve(forward.dofs().restrict_to(load)));
  };

  const auto weights =
      fem::sampling_matrix(model.locator(), nodes, data.positions, inversion::kOutsideTolerance_mm);
  if (!weights) return tl::unexpected(weights.error());
  MatrixXd a = MatrixXd::Zero(rows, 3 * nodes), v, forces(rows, 3 * nodes);
  for (int i = 0; i < data.size(); ++i) {
    for (fem::SamplingMatrix::InnerIterator it(*weights, i); it; ++it) {
      for (int axis = 0; axis < 3; ++axis) a(3 * i + axis, 3 * it.col() + axis) = it.value();
    }
  }
  if (auto status = fem::BlockSolver(k_p, factor, forward.dofs()).solve(a, v); !status) {
    return tl::unexpected(status.error());
  }
  for (int j = 0; j < rows; ++j) {
    const VecX one = v.row(j).transpose();
    forces.row(j) = flat(prior.apply(Eigen::Map<const Points>(one.data(), 3, nodes))).transpose();
  }
  MatrixXd covariance(rows, rows);
  linalg::blas::multiply_by_transposed(1.0, v, forces, 0.0, covariance);
  for (int i = 0; i < rows; ++i) covariance(i, i) += data.sd_mm[i / 3] * data.sd_mm[i / 3];

  Points gap_load = Points::Zero(3, nodes);
  forward.contact().add_load(gap_load, active);
  const Points shift = solve(gap_load);
  const VecX misfit = flat(data.displacements) - a * flat(shift);
  const VecX mu = covariance.llt().solve(misfit);
  const VecX load = forces.transpose() * mu;
  const Points mean = shift + solve(Eigen::Map<const Points>(load.data(), 3, nodes));
  if (!mean.allFinite()) return fail(ErrorCode::kNotFinite, "the direct posterior is not finite");
  return mean;
}

struct Difference {
  double max_mm = 0.0, mean_mm = 0.0;
};
Difference difference(const Points& a, const Points& b) {
  const VecX each = (a - b).colwise().norm();
  return {each.maxCoeff(), each.mean()};
}

// active_slaves of an estimate are in the order of the pairs.
Result<Points> direct_posterior(const PreparedModel& model, const SparseData& data,
                                const Estimate& estimate) {
  std::vector<NodeIndex> sorted = estimate.active_slaves;
  std::sort(sorted.begin(), sorted.end());
  return direct_posterior(model, data, sorted,
                          inversion::scaled_prior(model, estimate.prior_scales));
}

// How well contact holds: the deepest slave without a force, mm, and
// the strongest pull, N; 0 when it holds.
nlohmann::json contact_left_open(const PreparedModel& model, const Estimate& estimate) {
  const auto& contact = model.forward().contact();
  const VecX penetration = contact.penetration(estimate.displacement);
  std::vector<NodeIndex> active = estimate.active_slaves;
  std::sort(active.begin(), active.end());
  double deepest_mm = 0.0;
  for (int i = 0; i < contact.num_slaves(); ++i) {
    const NodeIndex slave = contact.pairs()[static_cast<std::size_t>(i)].slave;
    if (std::binary_search(active.begin(), active.end(), slave)) continue;
    deepest_mm = std::max(deepest_mm, penetration[i]);
  }
  double pull_n = 0.0;
  for (const double force : estimate.contact_force_n) pull_n = std::max(pull_n, -force);
  return {{"deepest_open_mm", deepest_mm}, {"strongest_pull_n", pull_n}};
}

struct Compared {
  nlohmann::json json;
  bool within_bounds = true;
};

// The method at every rank.
Status compare_reduced(const PreparedModel& model, const io::ModelFile& head,
                       const SparseData& data, Compared& compared) {
  const Stopwatch watch;
  auto made = inversion::condense(model);
  if (!made) return tl::unexpected(made.error());
  const auto operators = std::make_shared<const CondensedOperators>(std::move(*made));
  compared.json["reduced_prepare_s"] = watch.seconds();
  CaseConfig config = head.config;
  config.condensed.deadline_ms = 1e6;  // accuracy is asked for here, not speed
  // The direct posterior is that of one prior, not a mean over hypotheses.
  config.prior.estimate_scales = false;
  const auto locator = std::make_shared<const geometry::TetLocator>(head.model.mesh);
  std::vector<int> ranks(std::begin(kFewerRanks), std::end(kFewerRanks));
  ranks.push_back(operators->num_modes());
  for (const int rank : ranks) {
    inversion::CondensedOptions options;
    options.rank = rank;
    auto inverter = inversion::CondensedInverter::build(operators, locator, config, options);
    if (!inverter) return tl::unexpected(inverter.error());
    Estimate reduced;
    if (auto status = inverter->update(data, reduced); !status) return status;
    // Data that the update distrusts are distrusted as much.
    SparseData weighted = data;
    weighted.sd_mm.array() /= inverter->weights().array().sqrt();
    const auto own_direct = direct_posterior(model, weighted, reduced);
    if (!own_direct) return tl::unexpected(own_direct.error());
    const Difference own = difference(reduced.displacement, *own_direct);
    compared.json["reduced"].push_back({{"rank", rank},
                                        {"max_mm", own.max_mm},
                                        {"mean_mm", own.mean_mm},
                                        {"active", reduced.contact.active},
                                        {"iterations", reduced.contact.iterations},
                                        {"prior_scales", reduced.prior_scales},
                                        {"contact", contact_left_open(model, reduced)},
                                        {"status", std::string(to_string(reduced.status))}});
    if (rank == operators->num_modes()) {
      compared.json["active"] = reduced.contact.active;
      compared.json["largest_displacement_mm"] = own_direct->colwise().norm().maxCoeff();
      compared.within_bounds = compared.within_bounds && own.max_mm <= kReducedBound_mm;
    }
  }
  return {};
}

Result<Compared> compare(const Arguments& arguments) {
  const auto head = load_head(arguments);
  if (!head) return tl::unexpected(head.error());
  const auto observation = first_observation(arguments, *head);
  if (!observation) return tl::unexpected(observation.error());
  const auto data = sparse_data(*observation, head->config);
  if (!data) return tl::unexpected(data.error());
  const auto model = PreparedModel::prepare(std::make_shared<const BrainModel>(head->model),
                                            head->config, Boundary::kContact);
  if (!model) return tl::unexpected(model.error());

  Compared compared;
  compared.json = {{"case", head->config.case_id},
                   {"model_id", head->model.model_id},
                   {"scenario", arguments.surgery.empty() ? arguments.scenario : arguments.surgery},
                   {"seed", arguments.seed},
                   {"nodes", head->model.mesh.num_nodes()},
                   {"slaves", model->forward().contact().num_slaves()},
                   {"data", data->size()},
                   {"reduced", nlohmann::json::array()}};
  if (auto status = compare_reduced(*model, *head, *data, compared); !status) {
    return tl::unexpected(status.error());
  }
  compared.json["within_bounds"] = compared.within_bounds;
  return compared;
}

bool is_bad_input(ErrorCode code) {
  return code == ErrorCode::kInvalidArgument || code == ErrorCode::kNotFound ||
         code == ErrorCode::kUnreadable;
}

int run(const Arguments& arguments) {
  const std::filesystem::path out = arguments.out;
  if (out.has_parent_path()) {
    std::error_code ignored;  // writing fails then, and says so
    std::filesystem::create_directories(out.parent_path(), ignored);
  }
  const auto compared = compare(arguments);
  if (!compared) {
    std::fprintf(stderr, "bench_exactness: %s\n", compared.error().message.c_str());
    return is_bad_input(compared.error().code) ? 2 : 1;
  }
  std::ofstream file(out);
  file << compared->json.dump(2) << '\n';
  file.close();
  if (!file) {
    std::fprintf(stderr, "bench_exactness: %s: cannot be written\n", out.c_str());
    return 1;
  }
  std::cout << compared->json.dump(2) << '\n';
  return compared->within_bounds ? 0 : 1;
}

}  // namespace
}  // namespace brainshift

int main(int argc, char** argv) {
  brainshift::linalg::choose_blas_kernel();
  brainshift::linalg::use_single_threaded_blas();
  CLI::App app("Compares method condensed with the direct posterior at every node.",
               "bench_exactness");
  brainshift::Arguments arguments;
  app.add_option("--case", arguments.case_file, "Case file (YAML)");
  app.add_option("--model-file", arguments.model_file, "Model file, instead of the case file");
  app.add_option("--surgery", arguments.surgery,
                 "Surgery file whose first observation is inverted, instead of a scenario");
  app.add_option("--scenario", arguments.scenario, "Scenario to simulate (default: paper)");
  app.add_option("--seed", arguments.seed, "Seed of the scenario (default: 1)");
  app.add_option("--out", arguments.out, "JSON file to write")->required();
  app.footer(
      "Example:\n  bench_exactness --case config/cases/colin27.yaml --scenario paper --out "
      "out/bench/direct-paper.json");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return brainshift::run(arguments);
}
