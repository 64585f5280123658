// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed_inverter.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "common/core/thread_team.hpp"
#include "common/fem/blas.hpp"
#include "common/fem/blas_threads.hpp"
#include "common/inversion/contact_reduction.hpp"
#include "common/inversion/data_check.hpp"
#include "common/inversion/estimate_check.hpp"
#include "common/inversion/field_rebuild.hpp"
#include "common/inversion/invert.hpp"
#include "common/inversion/prior_scales.hpp"
#include "common/inversion/sampled_operators.hpp"
#include "common/inversion/set_search.hpp"

namespace brainshift::inversion {
namespace {

namespace blas = fem::blas;
using Eigen::MatrixXd;
using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// From here on the reason says that the data are not explained. 600 independent residuals exceed it by chance never.
constexpr double kUnexplained = 1.5;

// Contact and scales settle in turn; twice is the rule when a surgery begins, once later.
constexpr int kScaleRounds = 4;

// Into memory that `reason` has already.
void set_reason(EstimateStatus outcome, const SetSearch& search, const CondensedConfig& config,
                double misfit_ratio, std::string& reason) {
  char text[240];
  switch (outcome) {
    case EstimateStatus::kConverged:
      std::snprintf(text, sizeof text, "contact holds to %g mm at iteration %d",
                    kContactTolerance_mm, search.iteration());
      break;
    case EstimateStatus::kDeadline:
      std::snprintf(text, sizeof text,
                    "deadline of %g ms reached after %d contact sets; best iterate returned",
                    config.deadline_ms, search.iteration());
      break;
    default:
      std::snprintf(text, sizeof text,
                    "contact did not settle in %d iterations; best iterate returned",
                    search.iteration());
  }
  reason.assign(text);
  if (misfit_ratio > kUnexplained) {
    std::snprintf(text, sizeof text,
                  "; the prior does not explain the data: they lie %.1f standard deviations off",
                  misfit_ratio);
    reason.append(text);
  }
}

}  // namespace

struct CondensedInverter::Impl {
  Impl(std::shared_ptr<const CondensedOperators> given,
       std::shared_ptr<const geometry::TetLocator> given_locator, const CaseConfig& config,
       const CondensedOptions& given_options)
      : operators(std::move(given)),
        options(given_options),
        window(mode_window(*operators, options)),
        condensed(config.condensed),
        poisson_ratio(largest_poisson_ratio(config.material)),
        team(options.threads),
        deformation(given_locator->nodes(), given_locator->tets(), team),
        sampled(operators, std::move(given_locator), window, condensed.outside_region, team),
        reduction(*operators, window, config.contact.penalty_n_per_mm, team),
        rebuild(*operators, window, options.region_of_interest),
        scales(operators->gravity_modes, window, SparseData::kMaxCommonErrors),
        estimate_scales(config.prior.estimate_scales),
        search(options.contact ? operators->num_slaves() : 0, condensed.max_contact_iterations) {
    const Eigen::Index most = SparseData::kMaxCommonErrors + window.count;
    gram_storage.resize(most * most);
    normal_storage.resize(most * most);
    right.setZero(most);
    solution.setZero(most);
    z.setZero(window.count);
    for (int slave = 0; options.contact && slave < operators->num_slaves(); ++slave) {
      const NodeIndex node = operators->slaves[static_cast<std::size_t>(slave)];
      const auto& region = options.region_of_interest;
      if (region.empty() || std::binary_search(region.begin(), region.end(), node)) {
        rebuilt_slaves.push_back(slave);
      }
    }
    reserve(options.capacity);
  }

  // Grows what depends on the number of data; nothing happens while they fit.
  void reserve(int data) {
    if (3 * data <= jacobian.rows()) return;
    jacobian.resize(3 * data, SparseData::kMaxCommonErrors + window.count + 1);
    residual.resize(3 * data);
    sampled.reserve(data);
  }

  static ModeWindow mode_window(const CondensedOperators& operators,
                                const CondensedOptions& options) {
    ModeWindow window;
    window.first = options.gravity_modes ? 0 : operators.gravity_modes;
    const int last =
        options.rank > 0 ? std::min(options.rank, operators.num_modes()) : operators.num_modes();
    window.count = std::max(0, last - window.first);
    return window;
  }

  void reset() {
    search.forget();
    scales.reset();
  }
  // Contact for the present scales, from the last set on: kConverged, kIterationLimit or kDeadline.
  Result<EstimateStatus> settle_contact(const SparseData& data, Clock::time_point start);
  // Posterior mean of z and the contact forces for the set of `reduction`; fills penetration of every slave.
  Status estimate_for_set(const SparseData& data);
  void record(const SparseData& data, Clock::time_point start);
  Status finish(const SparseData& data, Estimate& estimate);
  void estimate_omissions(const SparseData& data);

  std::shared_ptr<const CondensedOperators> operators;
  CondensedOptions options;
  ModeWindow window;
  CondensedConfig condensed;
  double poisson_ratio;
  ThreadTeam team;
  fem::DeformationCheck deformation;
  SampledOperators sampled;
  ContactReduction reduction;
  FieldRebuild rebuild;
  PriorScales scales;
  bool estimate_scales;
  SetSearch search;

  // J^T R^-1 J of (c, z), lower triangle, without the prior.
  Eigen::Map<MatrixXd> gram() {
    const Eigen::Index size = sampled.common() + window.count;
    return {gram_storage.data(), size, size};
  }
  // Lower Cholesky factor of the normal equations of (c, z), (q + r) x (q + r).
  Eigen::Map<MatrixXd> normal() {
    const Eigen::Index size = sampled.common() + window.count;
    return {normal_storage.data(), size, size};
  }

  MatrixXd jacobian;  // whitened [common error | J | d - A G f0], 3m x (q + r + 1)
  VecX residual;      // whitened d - A u, 3m
  VecX gram_storage, normal_storage, right, solution, z;
  std::vector<int> rebuilt_slaves;  // whose displacement is not interpolated
  double misfit_ratio =
      0.0;  // root mean square of d - A u - common error over its standard deviation
  std::vector<IterationRecord> history;
  OmissionErrors errors;
};

Status CondensedInverter::Impl::estimate_for_set(const SparseData& data) {
  const Eigen::Index rows = 3 * data.size(), r = window.count, unknowns = sampled.common() + r;
  auto j = jacobian.topLeftCorner(rows, unknowns + 1);
  j = sampled.free_body();
  if (reduction.size() > 0) {  // contact does not touch the common error
    const auto contact = sampled.contact(reduction.active());
    const auto response = reduction.response();
    team.split(r + 1, [&](long begin, long end) {
      blas::multiply(-1.0, contact, response.middleCols(begin, end - begin), 1.0,
                     j.middleCols(sampled.common() + begin, end - begin));
    });
  }
  auto g = gram();
  blas::gram(j.leftCols(unknowns), 0.0, g);
  auto factor = normal();
  factor = g;
  factor.diagonal().head(sampled.common()).array() += 1.0;
  for (int i = 0; i < r; ++i) {
    const double scale = scales.of_mode(i);
    factor(sampled.common() + i, sampled.common() + i) += 1.0 / (scale * scale);
  }
  if (!blas::cholesky(factor)) {
    return fail(ErrorCode::kNotFinite, "inversion: the normal equations are not positive definite");
  }
  right.head(unknowns).noalias() = j.leftCols(unknowns).transpose() * j.col(unknowns);
  auto cz = solution.head(unknowns);
  cz = right.head(unknowns);
  blas::solve_lower(factor, cz);
  blas::solve_lower_transposed(factor, cz);
  z = cz.tail(r);
  residual.head(rows) = j.col(unknowns);
  residual.head(rows).noalias() -= j.leftCols(unknowns) * cz;
  misfit_ratio = std::sqrt(residual.head(rows).squaredNorm() / static_cast<double>(rows));
  residual.head(rows).noalias() += j.leftCols(sampled.common()) * cz.head(sampled.common());
  reduction.update_forces(z);
  return {};
}

Result<EstimateStatus> CondensedInverter::Impl::settle_contact(const SparseData& data,
                                                               Clock::time_point start) {
  search.begin();
  EstimateStatus outcome = EstimateStatus::kIterating;
  while (outcome == EstimateStatus::kIterating) {
    if (auto status = reduction.activate(search.current()); !status) {
      return tl::unexpected(status.error());
    }
    if (auto status = estimate_for_set(data); !status) return tl::unexpected(status.error());
    record(data, start);
    switch (search.next(reduction.all_forces(), reduction.penetration(),
                        reduction.compliance_diagonal())) {
      case SetSearch::Step::kSolved: outcome = EstimateStatus::kConverged; break;
      case SetSearch::Step::kExhausted: outcome = EstimateStatus::kIterationLimit; break;
      case SetSearch::Step::kContinue: break;
    }
    if (outcome == EstimateStatus::kIterating &&
        (options.stop.stop_requested() || milliseconds_since(start) > condensed.deadline_ms)) {
      outcome = EstimateStatus::kDeadline;
    }
  }
  if (outcome == EstimateStatus::kConverged) return outcome;
  // The best set seen, evaluated once more.
  if (auto status = reduction.activate(search.best()); !status) {
    return tl::unexpected(status.error());
  }
  if (auto status = estimate_for_set(data); !status) return tl::unexpected(status.error());
  record(data, start);
  search.adopt_best();
  return outcome;
}

void CondensedInverter::Impl::record(const SparseData& data, Clock::time_point start) {
  const int m = data.size();
  double sum = 0.0, squares = 0.0;
  for (int i = 0; i < m; ++i) {
    const double norm = residual.segment<3>(3 * i).norm() * sampled.sd(i);
    sum += norm;
    squares += norm * norm;
  }
  IterationRecord entry;
  entry.iteration = static_cast<int>(history.size()) + 1;
  entry.misfit_mm.mean = sum / m;
  entry.misfit_mm.std = m > 1 ? std::sqrt(std::max(0.0, (squares - sum * sum / m) / (m - 1))) : 0.0;
  const VecX& penetration = reduction.penetration();
  for (Eigen::Index i = 0; i < penetration.size(); ++i) {
    if (penetration[i] > kPenetrationTolerance_mm) ++entry.penetrating;
    entry.max_penetration_mm = std::max(entry.max_penetration_mm, penetration[i]);
  }
  entry.elapsed_ms = milliseconds_since(start);
  history.push_back(entry);
}

Status CondensedInverter::Impl::finish(const SparseData& data, Estimate& estimate) {
  const auto start = Clock::now();
  if (options.uncertainty) {
    // The common error comes first, so the last block is the factor of the Schur complement of z.
    rebuild.standard_deviation(team, reduction,
                               normal().bottomRightCorner(window.count, window.count),
                               scales.of_other() * scales.of_other(), estimate.sd_mm);
    // Data that lie farther off than their standard deviations say: so may the estimate (Birge 1932).
    if (misfit_ratio > 1.0) estimate.sd_mm *= misfit_ratio;
  } else {
    estimate.sd_mm.resize(0);
  }
  rebuild.displacement(team, z, reduction, estimate.displacement);
  if (auto status = check_equilibrium(*operators, rebuilt_slaves, reduction.penetration(),
                                      estimate.displacement);
      !status) {
    return status;
  }
  const auto measured = deformation.measure(estimate.displacement);
  if (auto status = check_deformation(measured, estimate); !status) return status;
  estimate.rebuild_ms = milliseconds_since(start);
  estimate_omissions(data);

  const IterationRecord& last = history.back();
  estimate.misfit_mm = last.misfit_mm;
  estimate.initial_misfit_mm = mean_std_of_norms(data.displacements);
  estimate.contact = {reduction.size(), last.penetrating, last.max_penetration_mm,
                      static_cast<int>(history.size())};
  estimate.active_slaves.clear();
  estimate.contact_force_n = reduction.forces();
  for (const int slave : reduction.active()) {
    estimate.active_slaves.push_back(operators->slaves[static_cast<std::size_t>(slave)]);
  }
  estimate.history = history;
  estimate.prior_scales = scales.scales();
  return {};
}

void CondensedInverter::Impl::estimate_omissions(const SparseData& data) {
  const VecX& penetration = reduction.penetration();
  errors.nearest_slave_mm =
      penetration.size() > 0 ? -penetration.maxCoeff() : std::numeric_limits<double>::infinity();
  errors.contact_mm = reduction.size() == 0 ? contact_error_mm(penetration) : 0.0;
  errors.far_field_mm = rebuild.far_field_error_mm();
  errors.gravity_modes_mm = 0.0;
  if (!options.gravity_modes) {
    const Eigen::Index rows = 3 * data.size(), q = sampled.common();
    const VecX unexplained =
        residual.head(rows) - jacobian.topLeftCorner(rows, q) * solution.head(q);
    errors.gravity_modes_mm = gravity_modes_error_mm(sampled, reduction, rebuild,
                                                     jacobian.topLeftCorner(rows, q + window.count),
                                                     unexplained, normal());
  }
}

CondensedInverter::CondensedInverter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
CondensedInverter::CondensedInverter(CondensedInverter&&) noexcept = default;
CondensedInverter& CondensedInverter::operator=(CondensedInverter&&) noexcept = default;
CondensedInverter::~CondensedInverter() = default;

Result<CondensedInverter> CondensedInverter::build(
    std::shared_ptr<const CondensedOperators> operators,
    std::shared_ptr<const geometry::TetLocator> locator, const CaseConfig& config,
    const CondensedOptions& options) {
  if (operators->modes.rows() != 3 * operators->control_neighbours.cols() ||
      operators->slave_modes.cols() != operators->modes.cols()) {
    return fail(ErrorCode::kInvalidArgument,
                "condensed operators: the arrays do not belong to one mesh");
  }
  fem::use_single_threaded_blas();
  auto impl = std::make_unique<Impl>(std::move(operators), std::move(locator), config, options);
  impl->history.reserve(static_cast<std::size_t>(kScaleRounds + 1) *
                        static_cast<std::size_t>(config.condensed.max_contact_iterations + 1));
  return CondensedInverter(std::move(impl));
}

void CondensedInverter::reset() { impl_->reset(); }
const OmissionErrors& CondensedInverter::omission_errors() const { return impl_->errors; }

Status CondensedInverter::update(const SparseData& data, Estimate& estimate) {
  const auto start = Clock::now();
  Impl& impl = *impl_;
  if (auto status = check_data(data); !status) return status;
  impl.reserve(data.size());
  SetSearch& search = impl.search;
  if (!impl.options.warm_start) impl.reset();
  impl.history.clear();
  EstimateStatus outcome = EstimateStatus::kIterating;
  for (int round = 0;; ++round) {
    if (round == 0 || impl.sampled.outside_region()) {
      if (auto status = impl.sampled.sample(data, impl.scales.of_other()); !status) return status;
    }
    const auto settled = impl.settle_contact(data, start);
    if (!settled) return tl::unexpected(settled.error());
    outcome = *settled;
    if (outcome != EstimateStatus::kConverged || !impl.estimate_scales || round == kScaleRounds ||
        !impl.scales.fit(impl.gram(), impl.right.head(impl.gram().rows()))) {
      break;
    }
  }
  if (!impl.z.allFinite() || !impl.reduction.forces().allFinite()) {
    impl.reset();
    return fail(ErrorCode::kNotFinite, "inversion: the estimate is not finite");
  }
  if (auto status = impl.finish(data, estimate); !status) {
    estimate.status = EstimateStatus::kNotRun;
    impl.reset();
    return status;
  }
  estimate.status = outcome;
  set_reason(outcome, search, impl.condensed, impl.misfit_ratio, estimate.reason);
  append_warnings(estimate, impl.poisson_ratio, estimate.reason);
  return {};
}

}  // namespace brainshift::inversion
