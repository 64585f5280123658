// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/stability/toy_problem.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/core/statistics.hpp"
#include "common/fem/deformation.hpp"
#include "common/fem/gravity.hpp"
#include "common/fem/sampling.hpp"
#include "common/inversion/prepared/condense.hpp"
#include "common/inversion/condensed/condensed_inverter.hpp"
#include "common/inversion/prepared/data_region.hpp"
#include "common/inversion/invert.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::stability {
namespace {

Result<Estimate> condensed(const ToyProblem& problem, const SparseData& data) {
  auto operators = inversion::condense(*problem.model);
  if (!operators) return tl::unexpected(operators.error());
  auto inverter = inversion::CondensedInverter::build(
      std::make_shared<const CondensedOperators>(std::move(*operators)),
      std::make_shared<const geometry::TetLocator>(problem.brain->mesh), problem.config);
  if (!inverter) return tl::unexpected(inverter.error());
  Estimate estimate;
  if (auto status = inverter->update(data, estimate); !status) {
    return tl::unexpected(status.error());
  }
  return estimate;
}

// Misfit and contact forces recomputed from the field.
void compare_with_itself(const ToyProblem& problem, const SparseData& data,
                         const Estimate& estimate, Point& point) {
  const auto sampling = fem::sampling_matrix(problem.model->locator(),
                                             problem.brain->mesh.num_nodes(), data.positions, 5.0);
  const Points sampled = (*sampling * estimate.displacement.transpose()).transpose();
  const MeanStd misfit = mean_std_of_norms(data.displacements - sampled);
  point.difference = std::abs(misfit.mean - estimate.misfit_mm.mean);
  const contact::PenaltyContact& contact = problem.model->forward().contact();
  const VecX penetration = contact.penetration(estimate.displacement);
  for (int i = 0; i < contact.num_slaves(); ++i) {
    const auto found = std::find(estimate.active_slaves.begin(), estimate.active_slaves.end(),
                                 contact.pairs()[static_cast<std::size_t>(i)].slave);
    if (found == estimate.active_slaves.end()) continue;
    const double force = estimate.contact_force_n[found - estimate.active_slaves.begin()];
    point.difference =
        std::max(point.difference,
                 std::abs(force - contact.beta() * penetration[i]) * problem.slave_compliance[i]);
  }
  point.bound = 1e-6;
}

}  // namespace

CaseConfig stability_config() {
  CaseConfig config = test_support::toy_config();
  config.brain = "toy";  // validate() asks for a mask to mesh; the toy patient needs none
  config.condensed.max_rank = 600;
  config.condensed.uncertainty_nodes = 64;
  config.condensed.deadline_ms = 1e5;  // no answer depends on the machine's speed
  return config;
}

Result<ToyProblem> ToyProblem::make(const CaseConfig& config, int cells) {
  if (auto status = validate(config); !status) return tl::unexpected(status.error());
  ToyProblem problem;
  problem.brain = std::make_shared<const BrainModel>(test_support::toy_patient(cells));
  problem.config = config;
  auto model = inversion::PreparedModel::prepare(problem.brain, config, Boundary::kContact);
  if (!model) return tl::unexpected(model.error());
  problem.model = std::make_unique<const inversion::PreparedModel>(std::move(*model));
  const contact::ForwardModel& forward = problem.model->forward();
  problem.reference = std::make_unique<Reference>(
      reference_stiffness(problem.brain->mesh, {fem::elasticity_from(config.material)},
                          forward.dofs()),
      forward.dofs(), &forward.contact());
  problem.slave_compliance.resize(forward.contact().num_slaves());
  for (int i = 0; i < forward.contact().num_slaves(); ++i) {
    const contact::ContactPair& pair = forward.contact().pairs()[static_cast<std::size_t>(i)];
    Points unit = Points::Zero(3, problem.brain->mesh.num_nodes());
    unit.col(pair.slave) = pair.normal;
    problem.slave_compliance[i] = pair.normal.dot(forward.solve(unit).col(pair.slave));
  }
  return problem;
}

Points sagging_load(const ToyProblem& problem, double largest_mm) {
  const BrainModel& brain = *problem.brain;
  const Points load =
      fem::buoyancy_load(brain.mesh, problem.config.material, brain.gravity_direction,
                         brain.fluid_plane_depth_mm + 25.0, brain.gravity_direction);
  const Points u = problem.model->forward().solve(load);
  return largest_mm / u.colwise().norm().maxCoeff() * load;
}

Result<SparseData> sagging_data(const ToyProblem& problem, const DataOptions& options) {
  const auto truth =
      problem.model->forward().solve_with_contact(sagging_load(problem, options.largest_mm));
  if (!truth) return tl::unexpected(truth.error());
  const std::vector<NodeIndex> region = inversion::data_region(*problem.brain);
  Random random(options.seed);
  const std::vector<int> chosen = random.choose(options.count, static_cast<int>(region.size()));
  const auto m = static_cast<Eigen::Index>(chosen.size());
  SparseData data{Points(3, m), Points(3, m), VecX::Constant(m, options.sd_mm)};
  for (Eigen::Index i = 0; i < m; ++i) {
    const NodeIndex node = region[static_cast<std::size_t>(chosen[static_cast<std::size_t>(i)])];
    data.positions.col(i) = problem.brain->mesh.nodes.col(node);
    data.displacements.col(i) =
        truth->displacement.col(node) + options.noise_mm * random.normal() * random.direction();
  }
  return data;
}

void compare_with_posterior(ToyProblem& problem, const SparseData& data, const Estimate& estimate,
                            Point& point) {
  point.bound = kInversionBound_mm;
  PosteriorReference right;
  if (!reference_posterior(*problem.reference, *problem.model, data, estimate, right)) {
    point.difference = std::numeric_limits<double>::quiet_NaN();
    return;
  }
  point.difference = greatest_difference(estimate.displacement, right.displacement);
  const contact::PenaltyContact& contact = problem.model->forward().contact();
  for (int i = 0; i < contact.num_slaves(); ++i) {
    const auto found = std::find(estimate.active_slaves.begin(), estimate.active_slaves.end(),
                                 contact.pairs()[static_cast<std::size_t>(i)].slave);
    const double penetration = static_cast<double>(right.penetration[i]);
    double wrong = penetration;  // of an open slave
    if (found != estimate.active_slaves.end()) {
      const double force =
          static_cast<double>(static_cast<Real>(contact.beta()) * right.penetration[i]);
      const double answer = estimate.contact_force_n[found - estimate.active_slaves.begin()];
      point.difference =
          std::max(point.difference, std::abs(answer - force) * problem.slave_compliance[i]);
      wrong = -force * problem.slave_compliance[i];
    }
    if (estimate.status == EstimateStatus::kConverged) {
      point.difference = std::max(point.difference, wrong);
    }
  }
  point.must_warn =
      point.must_warn ||
      fem::measure_deformation(problem.brain->mesh, estimate.displacement).inverted > 0;
}

void invert_and_record(ToyProblem& problem, const SparseData& data, Method method, Point point,
                       const Options& options) {
  if (point.row.empty()) point.row = std::string(to_string(method));
  point.unit = "mm";
  point.rcond = problem.model->forward().factor().rcond();
  point.backward_error = std::numeric_limits<double>::quiet_NaN();
  inversion::InversionOptions inversion_options;
  inversion_options.method = method;
  auto estimate = method == Method::kCondensed
                      ? condensed(problem, data)
                      : inversion::invert(*problem.model, data, inversion_options);
  if (!estimate) {
    set_refused(estimate.error(), point);
    return options.record(point);
  }
  set_answered(*estimate, point);
  if (options.faults != nullptr) options.faults->estimate(*estimate, point);
  if (method == Method::kCondensed || method == Method::kCondensedExact) {
    compare_with_posterior(problem, data, *estimate, point);
  } else {
    compare_with_itself(problem, data, *estimate, point);
  }
  options.record(point);
}

void solve_and_record(ToyProblem& problem, const Points& load, Point point,
                      const Options& options) {
  point.unit = "relative";
  point.rcond = problem.model->forward().factor().rcond();
  auto solution = problem.model->forward().solve_with_contact(load);
  if (!solution) {
    set_refused(solution.error(), point);
    return options.record(point);
  }
  point.answered = true;
  point.warned = !solution->converged;
  point.status = solution->converged ? "solved" : "not_converged";
  point.reason = solution->converged ? "" : "contact did not settle";
  point.backward_error = solution->backward_error;
  point.iterations = solution->iterations;
  if (options.faults != nullptr) options.faults->field(solution->displacement, point);
  point.min_volume_ratio =
      fem::measure_deformation(problem.brain->mesh, solution->displacement).min_volume_ratio;
  VectorR right;
  point.difference = problem.reference->solve_contact(load, right)
                         ? relative_difference(solution->displacement, right)
                         : std::numeric_limits<double>::quiet_NaN();
  point.bound = rounding_bound(problem.reference->condition());
  options.record(point);
}

double rounding_bound(double condition) {
  constexpr double kUnitRoundoff = 0x1.0p-53;
  return std::min(10.0 * condition * kUnitRoundoff, 1e-3);
}

}  // namespace brainshift::stability
