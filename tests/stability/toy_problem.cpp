// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/stability/toy_problem.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "common/core/random.hpp"
#include "common/fem/body_loads.hpp"
#include "common/fem/deformation.hpp"
#include "common/inversion/inverter.hpp"
#include "tests/stability/linear_body.hpp"
#include "tests/stability/reference_descent.hpp"
#include "tests/support/contact_search.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::stability {
namespace {

constexpr double kWrongScale = 1.1;
constexpr PriorScaleValues kAsTheCaseSays = kAsInTheCase;

// The model was not built const. No input of the product gives one slave a wrong normal or gap
// alone.
void spoil_contact(inversion::PreparedModel& model, Fault fault, const std::vector<int>& slaves) {
  auto& contact = const_cast<contact::PenaltyContact&>(model.forward().contact());
  std::vector<contact::ContactPair> pairs = contact.pairs();
  for (const int slave : slaves) {
    contact::ContactPair& pair = pairs[static_cast<std::size_t>(slave)];
    if (fault == Fault::kSign) pair.initial_penetration_mm = -pair.initial_penetration_mm;
    if (fault == Fault::kNormal) pair.normal = turned(pair.normal);
  }
  contact = contact::PenaltyContact(std::move(pairs), contact.beta());
}

int most_pressing(const inversion::PreparedModel& model, const Points& load) {
  const auto solution = test_support::solve_with_contact(model.forward(), load);
  if (!solution) return 0;
  Eigen::Index slave = 0;
  model.forward().contact().penetration(solution->displacement).maxCoeff(&slave);
  return static_cast<int>(slave);
}

// Forces of all slaves, N: 0 where open.
VecX forces_of(const ToyProblem& problem, const Estimate& estimate) {
  const auto& pairs = problem.patient->system.pairs();
  VecX forces = VecX::Zero(static_cast<Eigen::Index>(pairs.size()));
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto found =
        std::find(estimate.active_slaves.begin(), estimate.active_slaves.end(), pairs[i].slave);
    if (found == estimate.active_slaves.end()) continue;
    forces[static_cast<Eigen::Index>(i)] =
        estimate.contact_force_n[found - estimate.active_slaves.begin()];
  }
  return forces;
}

contact::ActiveSet set_of(const ToyProblem& problem, const Estimate& estimate) {
  const auto& pairs = problem.patient->system.pairs();
  contact::ActiveSet set(pairs.size(), 0);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    set[i] = std::count(estimate.active_slaves.begin(), estimate.active_slaves.end(),
                        pairs[i].slave) > 0;
  }
  return set;
}

// Of fields, and of contact forces as lengths.
double difference_mm(const ToyProblem& problem, const Estimate& estimate,
                     const VectorR& displacement, const VectorR& penetration,
                     const contact::ActiveSet& set) {
  double worst = greatest_difference(estimate.displacement, displacement);
  const VecX forces = forces_of(problem, estimate);
  for (Eigen::Index i = 0; i < forces.size(); ++i) {
    const bool active = set[static_cast<std::size_t>(i)] != 0;
    const Real right = active ? problem.patient->system.beta() * penetration[i] : Real(0);
    const Real apart =
        std::abs(static_cast<Real>(forces[i]) - right) * problem.patient->compliance(i, i);
    worst = std::max(worst, static_cast<double>(apart));
  }
  return worst;
}

void compare_with_descent(ToyProblem& problem, const SparseData& data, Method method,
                          const Estimate& estimate, Point& point) {
  point.bound = kInversionBound_mm;
  point.difference = std::numeric_limits<double>::quiet_NaN();
  const Steps steps = method == Method::kIterativeSolver ? Steps::kConjugate : Steps::kSteepest;
  const auto right = descend(*problem.patient, data, problem.config.inversion, steps);
  if (!right) return;
  const double misfit =
      std::abs(static_cast<double>(right->mean_misfit_mm) - estimate.misfit_mm.mean);
  point.difference = std::max(misfit, difference_mm(problem, estimate, right->displacement,
                                                    right->penetration, right->active));
  if (right->converged != (estimate.status == EstimateStatus::kConverged)) {
    point.objection = "the same descent in long double stops otherwise, at iteration " +
                      std::to_string(right->iterations);
  }
  ReferencePosterior posterior(*problem.patient, data);
  if (const auto set = posterior.find_set(kAsTheCaseSays)) {
    if (const auto minimum = posterior.of_set(*set, kAsTheCaseSays)) {
      point.from_posterior_mm = greatest_difference(estimate.displacement, minimum->displacement);
    }
  }
}

}  // namespace

CaseConfig stability_config() {
  CaseConfig config = test_support::toy_config();
  config.brain = "toy";  // validate() asks for a mask to mesh; the toy patient needs none
  config.condensed.max_rank = 600;
  // What the reference assembles: gravity and the paper's residual field.
  config.prior.gravity_sides_sd = config.prior.gravity_ends_sd = config.prior.broad_weight = 0.0;
  config.prior.medium_density_sd_n_m3 = config.prior.coarse_density_sd_n_m3 = 0.0;
  config.prior.tumour_volume_strain_sd = config.prior.brain_volume_strain_sd = 0.0;
  config.prior.resection_weight_sd = config.prior.resection_stress_sd_pa = 0.0;
  config.prior.opening_pressure_sd_pa = config.prior.tract_pressure_sd_pa = 0.0;
  config.prior.ventricle_volume_strain_sd = 0.0;
  config.condensed.uncertainty_nodes = 64;
  config.condensed.deadline_ms = 1e5;  // no answer depends on the machine's speed
  return config;
}

Result<ToyProblem> ToyProblem::make(const CaseConfig& config, Fault fault, int cells) {
  if (auto status = validate(config); !status) return tl::unexpected(status.error());
  ToyProblem problem;
  problem.brain = std::make_shared<const BrainModel>(test_support::toy_patient(cells));
  problem.config = config;
  auto truth = inversion::PreparedModel::prepare(problem.brain, config, Boundary::kContact);
  if (!truth) return tl::unexpected(truth.error());
  problem.truth = std::make_shared<const inversion::PreparedModel>(std::move(*truth));
  problem.weighty_slaves = {most_pressing(*problem.truth, sagging_load(problem, 8.0)),
                            most_pressing(*problem.truth, sagging_load(problem, -8.0))};
  if (problem.weighty_slaves[0] == problem.weighty_slaves[1]) problem.weighty_slaves.pop_back();
  problem.model = problem.truth;
  if (fault != Fault::kNone) {
    if (fault == Fault::kScale) problem.config.material.shear_modulus_pa *= kWrongScale;
    auto wrong =
        inversion::PreparedModel::prepare(problem.brain, problem.config, Boundary::kContact);
    if (!wrong) return tl::unexpected(wrong.error());
    auto spoilt = std::make_shared<inversion::PreparedModel>(std::move(*wrong));
    if (fault != Fault::kScale) spoil_contact(*spoilt, fault, problem.weighty_slaves);
    problem.model = std::move(spoilt);
  }
  problem.patient = std::make_unique<ReferencePatient>(
      *problem.brain, config,
      patient_matrices(*problem.brain, config, problem.model->forward().contact().pairs()));
  return problem;
}

Points sagging_load(const ToyProblem& problem, double largest_mm) {
  const BrainModel& brain = *problem.brain;
  const Points load =
      fem::buoyancy_load(brain.mesh, problem.truth->config().material, brain.gravity_direction,
                         brain.fluid_plane_depth_mm + 25.0, brain.gravity_direction);
  const Points u = problem.truth->forward().solve(load);
  return largest_mm / u.colwise().norm().maxCoeff() * load;
}

Result<SparseData> sagging_data(const ToyProblem& problem, const DataOptions& options) {
  const auto truth = test_support::solve_with_contact(problem.truth->forward(),
                                                      sagging_load(problem, options.largest_mm));
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
  point.difference = std::numeric_limits<double>::quiet_NaN();
  point.must_warn =
      point.must_warn ||
      fem::measure_deformation(problem.brain->mesh, estimate.displacement).inverted > 0;
  ReferencePosterior reference(*problem.patient, data);
  const std::vector<Hypothesis> hypotheses =
      estimate.hypotheses.empty() ? std::vector<Hypothesis>{{}} : estimate.hypotheses;
  const PriorScaleValues& scales = hypotheses.front().scales;
  const contact::ActiveSet product_set = set_of(problem, estimate);
  const auto difference = [&](const Posterior& right) {
    return difference_mm(problem, estimate, right.displacement, right.penetration, right.active);
  };
  contact::ActiveSet judged = product_set;
  const auto own_set = reference.find_set(scales);
  if (own_set) {
    if (const auto right = reference.of_set(*own_set, hypotheses)) {
      point.difference = difference(*right);
      judged = *own_set;
    }
  }
  if (!(point.difference <= point.bound) && own_set != product_set) {
    // Another set may repeat itself too, and some data have none that does.
    const auto right = reference.of_set(product_set, hypotheses);
    if (!right) return;
    judged = product_set;
    point.difference = difference(*right);
    point.sets = "product's";
    if (estimate.status == EstimateStatus::kConverged) {
      point.difference = std::max(point.difference, static_cast<double>(right->violation_mm));
    }
  }
  const auto gain = reference.gain_left(judged, scales);
  if (gain) point.scales_gain = static_cast<double>(*gain);
  if (point.scales_gain <= kScalesBound) return;
  char text[100];
  std::snprintf(text, sizeof text, "the prior's scales leave %.2f to gain in ln p",
                point.scales_gain);
  point.objection = text;
}

void invert_and_record(ToyProblem& problem, const SparseData& data, Method method, Point point,
                       const Options& options) {
  if (point.row.empty()) point.row = std::string(to_string(method));
  point.unit = "mm";
  point.rcond = problem.model->forward().factor().rcond();
  point.backward_error = std::numeric_limits<double>::quiet_NaN();
  const auto estimate = inversion::invert(*problem.model, data, method);
  if (!estimate) return options.record_refused(estimate.error(), point);
  set_answered(*estimate, point);
  if (method == Method::kCondensed) {
    compare_with_posterior(problem, data, *estimate, point);
  } else {
    compare_with_descent(problem, data, method, *estimate, point);
  }
  options.record(point);
}

void solve_and_record(ToyProblem& problem, const Points& load, Point point,
                      const Options& options) {
  point.unit = "relative";
  point.rcond = problem.model->forward().factor().rcond();
  const auto solution = test_support::solve_with_contact(problem.model->forward(), load);
  if (!solution) return options.record_refused(solution.error(), point);
  point.answered = true;
  point.warned = !solution->converged;
  point.status = solution->converged ? "solved" : "not_converged";
  point.reason = solution->converged ? "" : "contact did not settle";
  point.backward_error = solution->backward_error;
  point.iterations = solution->iterations;
  point.min_volume_ratio =
      fem::measure_deformation(problem.brain->mesh, solution->displacement).min_volume_ratio;
  Reference& reference = problem.patient->system;
  VectorR right;
  point.difference = reference.solve_contact(load, right)
                         ? relative_difference(solution->displacement, right)
                         : std::numeric_limits<double>::quiet_NaN();
  point.bound = rounding_bound(reference.condition());
  options.record(point);
}

double rounding_bound(double condition) {
  constexpr double kUnitRoundoff = 0x1.0p-53;
  return std::min(10.0 * condition * kUnitRoundoff, 1e-3);
}

}  // namespace brainshift::stability
