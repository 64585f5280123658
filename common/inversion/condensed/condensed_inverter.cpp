// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/condensed_inverter.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "common/contact/set_search.hpp"
#include "common/core/stopwatch.hpp"
#include "common/core/thread_team.hpp"
#include "common/inversion/condensed/contact_reduction.hpp"
#include "common/inversion/condensed/contradictions.hpp"
#include "common/inversion/condensed/field_rebuild.hpp"
#include "common/inversion/condensed/find_contact_set.hpp"
#include "common/inversion/condensed/mode_posterior.hpp"
#include "common/inversion/condensed/omission_estimates.hpp"
#include "common/inversion/condensed/prior_scales.hpp"
#include "common/inversion/condensed/robust_weights.hpp"
#include "common/inversion/condensed/sampled_operators.hpp"
#include "common/inversion/contract/data_check.hpp"
#include "common/inversion/contract/estimate_check.hpp"
#include "common/inversion/contract/penetration.hpp"
#include "common/linalg/blas_threads.hpp"

namespace brainshift::inversion {
namespace {

// Contact, scales, robust weights and places of moving data settle in turn. Two rounds are the rule
// when a surgery begins, one later.
constexpr int kMaxRounds = 6;

// Sets of a cycle from whose mean of loads the search tries to leave it.
constexpr int kMaxRelaxations = 10;

// Into memory that `reason` has already.
void set_reason(EstimateStatus outcome, const contact::SetSearch& search,
                const CondensedConfig& config, double misfit_ratio, std::string& reason) {
  char text[240];
  switch (outcome) {
    case EstimateStatus::kConverged:
      std::snprintf(text, sizeof text, "contact holds to %.1g mm at iteration %d",
                    search.violation_mm(), search.iteration());
      break;
    case EstimateStatus::kDeadline:
      std::snprintf(text, sizeof text,
                    "deadline of %g ms reached after %d contact sets; best iterate returned",
                    config.deadline_ms, search.iteration());
      break;
    default:
      std::snprintf(text, sizeof text,
                    "contact did not settle in %d iterations; best iterate returned, "
                    "which violates it by %.2g mm",
                    search.iteration(), search.best_violation_mm());
  }
  reason.assign(text);
  if (misfit_ratio > kUnexplainedMisfit) {
    std::snprintf(text, sizeof text,
                  "; the prior does not explain the data: they lie %.1f standard deviations off",
                  misfit_ratio);
    reason.append(text);
  }
}

// Outliers, and sources that contradict the others.
void append_sources(Estimate& estimate) {
  for (const SourceSummary& source : estimate.sources) {
    char text[240];
    if (source.outliers > 0) {
      std::snprintf(text, sizeof text, "; %d of %d data of \"%.64s\" count less as outliers",
                    source.outliers, source.data, source.source.c_str());
      estimate.reason.append(text);
    }
    if (!source.consistent) {
      std::snprintf(
          text, sizeof text,
          "; \"%.64s\" contradicts the other sources: chi-square %.0f for %.0f degrees of "
          "freedom",
          source.source.c_str(), source.chi_square, source.degrees_of_freedom);
      estimate.reason.append(text);
    }
  }
}

// Of data without named sources.
void append_outliers(const RobustWeights& weights, int data, std::string& reason) {
  const int outliers = weights.outliers(0, data);
  if (outliers == 0) return;
  char text[80];
  std::snprintf(text, sizeof text, "; %d of %d data count less as outliers", outliers, data);
  reason.append(text);
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
        posterior(window),
        rebuild(*operators, window, options.region_of_interest),
        scales({operators->gravity_modes, operators->swelling_modes}, window,
               SparseData::kMaxCommonErrors),
        estimate_scales(config.prior.estimate_scales),
        robust(config.sensing.robust_weights),
        search(options.contact ? operators->num_slaves() : 0, condensed.max_contact_iterations) {
    for (int slave = 0; options.contact && slave < operators->num_slaves(); ++slave) {
      const NodeIndex node = operators->slaves[static_cast<std::size_t>(slave)];
      const auto& region = options.region_of_interest;
      if (region.empty() || std::binary_search(region.begin(), region.end(), node)) {
        rebuilt_slaves.push_back(slave);
      }
    }
    history.reserve(static_cast<std::size_t>(kMaxRounds + 1) *
                    static_cast<std::size_t>(condensed.max_contact_iterations + 1));
    reserve(options.capacity);
  }

  // Grows what depends on the number of data; nothing happens while they fit.
  void reserve(int data) {
    if (data <= norms.size()) return;
    posterior.reserve(data);
    sampled.reserve(data);
    weights.reserve(data);
    contradictions.reserve(data);
    norms.resize(data);
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
  // Checks and places data that are new.
  Status accept(const SparseData& data);
  // Contact, scales, weights and moving data in turn, until nothing changes. `data` follows
  // `moving`. Errors of evaluate(), of moving data that are not fit, and stopped().
  Result<EstimateStatus> settle(const SparseData*& data, const InversionOptions& asked);
  // Contact for the present scales and weights, from the last set on: kConverged, kIterationLimit
  // or kDeadline.
  Result<EstimateStatus> settle_contact(const std::stop_token& stop);

  // What find_contact_set() asks of a method.
  Status evaluate(const contact::ActiveSet& set);
  const VecX& all_forces() const { return reduction.all_forces(); }
  const VecX& penetration() const { return reduction.penetration(); }
  const VecX& compliance_diagonal() const { return reduction.compliance_diagonal(); }
  void keep();
  void leave_cycle();
  bool out_of_time() const { return watch.milliseconds() > condensed.deadline_ms; }

  bool reweigh(const SparseData& data);
  Result<bool> relocate(const SparseData& data, const MovingData& moving);
  void record();
  Status finish(const SparseData& data, Estimate& estimate);
  void estimate_omissions();
  void summarise_sources(const SparseData& data, Estimate& estimate);

  std::shared_ptr<const CondensedOperators> operators;
  CondensedOptions options;
  ModeWindow window;
  CondensedConfig condensed;
  double poisson_ratio;
  ThreadTeam team;
  fem::DeformationCheck deformation;
  SampledOperators sampled;
  ContactReduction reduction;
  ModePosterior posterior;
  FieldRebuild rebuild;
  PriorScales scales;
  bool estimate_scales;
  RobustWeights weights;
  Contradictions contradictions;
  bool robust;
  contact::SetSearch search;

  Stopwatch watch;                  // of the update
  std::vector<int> rebuilt_slaves;  // whose displacement is not interpolated
  int relaxations = 0;
  VecX relaxed;      // modes between those of the last sets, once they cycle
  VecX norms;        // of the residuals, per datum
  SparseData moved;  // the data where they are now, when they move
  Points moving_displacement;
  std::vector<IterationRecord> history;
  OmissionErrors errors;
};

Status CondensedInverter::Impl::accept(const SparseData& data) {
  if (auto status = check_data(data); !status) return status;
  reserve(data.size());
  return sampled.locate(data);
}

// Posterior mean of z and the contact forces for the set; penetration of every slave.
Status CondensedInverter::Impl::evaluate(const contact::ActiveSet& set) {
  if (auto status = reduction.activate(set); !status) return status;
  if (auto status = posterior.solve(sampled, reduction, scales, team); !status) return status;
  reduction.update_forces(posterior.z());
  record();
  return {};
}

void CondensedInverter::Impl::keep() {
  relaxed = posterior.z();
  relaxations = 0;
}

// The contact set at a point between the last sets' estimates: the mean of their loads.
void CondensedInverter::Impl::leave_cycle() {
  for (int k = 0; k < kMaxRelaxations; ++k) {
    relaxed += (posterior.z() - relaxed) / static_cast<double>(++relaxations + 1);
    reduction.update_forces(relaxed);
    if (search.follow(reduction.all_forces(), reduction.penetration())) return;
  }
}

bool CondensedInverter::Impl::reweigh(const SparseData& data) {
  if (!robust) return false;
  auto out = norms.head(data.size());
  for (int i = 0; i < data.size(); ++i) out[i] = posterior.residual_norm(sampled, i);
  return weights.update(data, out);
}

Result<bool> CondensedInverter::Impl::relocate(const SparseData& data, const MovingData& moving) {
  rebuild.displacement_at(moving.nodes, posterior.z(), reduction, moving_displacement);
  if (&data != &moved) moved = data;
  const int before = moved.size();
  if (!moving.relocate(moving_displacement, moved)) return false;
  if (auto status = accept(moved); !status) return tl::unexpected(status.error());
  if (moved.size() != before) weights.reset(moved.size());
  return true;
}

Result<EstimateStatus> CondensedInverter::Impl::settle(const SparseData*& data,
                                                       const InversionOptions& asked) {
  bool sample = true;
  for (int round = 0;; ++round) {
    if (sample) sampled.sample(*data, scales.of_other(), weights.values());
    const auto settled = settle_contact(asked.stop);
    if (!settled || *settled != EstimateStatus::kConverged || round == kMaxRounds) return settled;
    const bool rescaled =
        estimate_scales && scales.fit(posterior.gram(), posterior.right_hand_side());
    const bool reweighed = reweigh(*data);
    bool relocated = false;
    if (asked.moving != nullptr) {
      const auto changed = relocate(*data, *asked.moving);
      if (!changed) return tl::unexpected(changed.error());
      relocated = *changed;
      if (relocated) data = &moved;
    }
    if (!rescaled && !reweighed && !relocated) return settled;
    sample = reweighed || relocated || sampled.data_outside_region() > 0;
  }
}

Result<EstimateStatus> CondensedInverter::Impl::settle_contact(const std::stop_token& stop) {
  const auto end = find_contact_set(search, *this, stop);
  if (!end) return tl::unexpected(end.error());
  switch (*end) {
    case SearchEnd::kSolved: return EstimateStatus::kConverged;
    case SearchEnd::kDeadline: return EstimateStatus::kDeadline;
    case SearchEnd::kExhausted: break;
  }
  return search.best_violation_mm() <= contact::kHolds_mm ? EstimateStatus::kConverged
                                                          : EstimateStatus::kIterationLimit;
}

void CondensedInverter::Impl::record() {
  const int m = sampled.size();
  double sum = 0.0, squares = 0.0;
  for (int i = 0; i < m; ++i) {
    const double norm = posterior.misfit(sampled, i) * sampled.sd(i);
    sum += norm;
    squares += norm * norm;
  }
  IterationRecord entry;
  entry.iteration = static_cast<int>(history.size()) + 1;
  entry.misfit_mm.mean = sum / m;
  entry.misfit_mm.std = m > 1 ? std::sqrt(std::max(0.0, (squares - sum * sum / m) / (m - 1))) : 0.0;
  const PenetrationSummary summary = summarise_penetration(reduction.penetration());
  entry.penetrating = summary.penetrating;
  entry.max_penetration_mm = summary.max_mm;
  entry.elapsed_ms = watch.milliseconds();
  history.push_back(entry);
}

Status CondensedInverter::Impl::finish(const SparseData& data, Estimate& estimate) {
  const Stopwatch rebuilding;
  if (options.uncertainty) {
    rebuild.standard_deviation(team, reduction,
                               posterior.factor().bottomRightCorner(window.count, window.count),
                               scales.of_other() * scales.of_other(), estimate.sd_mm);
    // Where data lie farther off than their standard deviations, so may the estimate (Birge 1932).
    if (posterior.misfit_ratio() > 1.0) estimate.sd_mm *= posterior.misfit_ratio();
  } else {
    estimate.sd_mm.resize(0);
  }
  rebuild.displacement(team, posterior.z(), reduction, estimate.displacement);
  if (auto status = check_equilibrium(*operators, rebuilt_slaves, reduction.penetration(),
                                      estimate.displacement);
      !status) {
    return status;
  }
  const auto measured = deformation.measure(estimate.displacement);
  if (auto status = check_deformation(measured, estimate); !status) return status;
  estimate.rebuild_ms = rebuilding.milliseconds();
  estimate_omissions();

  const IterationRecord& last = history.back();
  estimate.misfit_mm = last.misfit_mm;
  estimate.initial_misfit_mm = mean_std_of_norms(data.displacements);
  estimate.contact = {reduction.size(), last.penetrating, last.max_penetration_mm,
                      static_cast<int>(history.size())};
  if (options.contact) estimate.contact.max_violation_mm = search.violation_mm();
  estimate.active_slaves.clear();
  estimate.contact_force_n = reduction.forces();
  for (const int slave : reduction.active()) {
    estimate.active_slaves.push_back(operators->slaves[static_cast<std::size_t>(slave)]);
  }
  estimate.history = history;
  estimate.prior_scales = scales.scales();
  // A bound of 1 is the case's own strength, where the search begins: it tells nothing.
  for (std::size_t part = 0; part < kLargestScales.size(); ++part) {
    estimate.prior_at_bound[part] = estimate_scales && kLargestScales[part] > 1.0 &&
                                    estimate.prior_scales[part] >= kLargestScales[part];
  }
  estimate.misfit_ratio = posterior.misfit_ratio();
  estimate.data_outside_region = sampled.data_outside_region();
  summarise_sources(data, estimate);
  return {};
}

void CondensedInverter::Impl::summarise_sources(const SparseData& data, Estimate& estimate) {
  estimate.sources.resize(data.sources.size());
  for (std::size_t i = 0; i < data.sources.size(); ++i) {
    const DataSource& source = data.sources[i];
    SourceSummary& summary = estimate.sources[i];
    summary = {};
    summary.source = source.name;
    summary.data = source.count;
    summary.outliers = weights.outliers(source.first, source.count);
    Consistency consistency;
    if (data.sources.size() < 2 || !posterior.check_source(sampled, scales, source, consistency)) {
      continue;
    }
    summary.chi_square = consistency.chi_square;
    summary.degrees_of_freedom = consistency.degrees_of_freedom;
    summary.p_value = consistency.p_value;
    summary.consistent = !(consistency.p_value < kInconsistent);
  }
}

void CondensedInverter::Impl::estimate_omissions() {
  const VecX& penetration = reduction.penetration();
  errors.nearest_slave_mm =
      penetration.size() > 0 ? -penetration.maxCoeff() : std::numeric_limits<double>::infinity();
  errors.contact_mm = reduction.size() == 0 ? contact_error_mm(penetration) : 0.0;
  errors.far_field_mm = rebuild.far_field_error_mm();
  errors.gravity_modes_mm = 0.0;
  if (!options.gravity_modes) {
    errors.gravity_modes_mm =
        gravity_modes_error_mm(sampled, reduction, rebuild, posterior.jacobian(),
                               posterior.residual(), posterior.factor());
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
  linalg::use_single_threaded_blas();
  auto impl = std::make_unique<Impl>(std::move(operators), std::move(locator), config, options);
  return CondensedInverter(std::move(impl));
}

void CondensedInverter::reset() { impl_->reset(); }
const OmissionErrors& CondensedInverter::omission_errors() const { return impl_->errors; }

Status CondensedInverter::update(const SparseData& given, Estimate& estimate,
                                 const InversionOptions& asked) {
  Impl& impl = *impl_;
  impl.watch = Stopwatch();
  if (!impl.options.warm_start) impl.reset();
  impl.history.clear();
  if (auto status = impl.accept(given); !status) return status;
  impl.weights.reset(given.size());
  const SparseData* data = &given;
  const auto outcome = impl.settle(data, asked);
  if (!outcome) {
    impl.reset();
    return tl::unexpected(outcome.error());
  }
  if (!impl.posterior.z().allFinite() || !impl.reduction.forces().allFinite()) {
    impl.reset();
    return fail(ErrorCode::kNotFinite, "inversion: the estimate is not finite");
  }
  if (auto status = impl.finish(*data, estimate); !status) {
    estimate.status = EstimateStatus::kNotRun;
    impl.reset();
    return status;
  }
  estimate.status = *outcome;
  set_reason(*outcome, impl.search, impl.condensed, impl.posterior.misfit_ratio(), estimate.reason);
  append_sources(estimate);
  if (data->sources.empty()) append_outliers(impl.weights, data->size(), estimate.reason);
  append_contradiction(impl.contradictions.find(*data), *data, estimate.reason);
  append_warnings(estimate, impl.poisson_ratio, estimate.reason);
  return {};
}

}  // namespace brainshift::inversion
