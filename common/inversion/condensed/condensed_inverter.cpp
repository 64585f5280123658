// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/condensed_inverter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/core/stopwatch.hpp"
#include "common/core/thread_team.hpp"
#include "common/inversion/condensed/omission_estimates.hpp"
#include "common/inversion/condensed/reason.hpp"
#include "common/inversion/condensed/robust_weights.hpp"
#include "common/inversion/condensed/settled_loads.hpp"
#include "common/inversion/condensed/update_deadline.hpp"
#include "common/inversion/contract/estimate_check.hpp"
#include "common/linalg/openblas.hpp"

namespace brainshift::inversion {
namespace {

// Data per update for which memory is reserved up front: more than instruments give at once.
constexpr int kReservedData = 1000;
// Loads of one update that the history has room for before it grows: eleven descents.
constexpr int kReservedDescents = 11;
// An update that has taken less shows no provisional field, ms: nobody sees the difference.
constexpr double kProvisionalAfter_ms = 100.0;

}  // namespace

struct CondensedInverter::Impl {
  Impl(std::shared_ptr<const CondensedOperators> given,
       std::shared_ptr<const geometry::TetLocator> given_locator, const CaseConfig& config,
       const CondensedOptions& given_options)
      : operators(std::move(given)),
        options(given_options),
        window(mode_window(*operators, options)),
        condensed(config.condensed),
        deadline(config.condensed.deadline_ms),
        poisson_ratio(largest_poisson_ratio(config.material)),
        team(options.threads),
        deformation(given_locator->nodes(), given_locator->tets(), team),
        rebuild(*operators, window, team, options.region_of_interest),
        loads(operators, std::move(given_locator), window, config, options.contact, team, rebuild,
              profile),
        source_checks(static_cast<std::size_t>(team.size())) {
    for (int slave = 0; options.contact && slave < operators->num_slaves(); ++slave) {
      const NodeIndex node = operators->slaves[static_cast<std::size_t>(slave)];
      const auto& region = options.region_of_interest;
      if (region.empty() || std::binary_search(region.begin(), region.end(), node)) {
        rebuilt_slaves.push_back(slave);
      }
    }
    history.reserve(static_cast<std::size_t>(kReservedDescents) *
                    static_cast<std::size_t>(condensed.max_contact_iterations + 1));
    loads.reserve(kReservedData);
    contradictions.reserve(kReservedData);
    if (options.contact) loads.descent().prepare();
  }

  static ModeWindow mode_window(const CondensedOperators& operators,
                                const CondensedOptions& options) {
    ModeWindow window;
    window.first = options.gravity_modes ? 0 : operators.gravity_modes();
    const int last =
        options.rank > 0 ? std::min(options.rank, operators.num_modes()) : operators.num_modes();
    window.count = std::max(0, last - window.first);
    return window;
  }

  DescentLimits limits(const InversionOptions& asked);
  void record();
  // The field of a mean that a closer one will follow, to whoever asked, once in an update.
  Status show_provisional(const InversionOptions& asked);
  // Displacement and standard deviation of the last mean.
  void rebuild_field(const ModePosterior::Misfit& misfit, Estimate& estimate);
  Status finish(EstimateStatus outcome, Estimate& estimate);
  Status estimate_omissions();
  // compare: with each other.
  void summarise_sources(bool compare, Estimate& estimate);

  std::shared_ptr<const CondensedOperators> operators;
  CondensedOptions options;
  ModeWindow window;
  CondensedConfig condensed;
  UpdateDeadline deadline;
  double poisson_ratio;
  ThreadTeam team;
  UpdateProfile profile;  // of the last update
  fem::DeformationCheck deformation;
  FieldRebuild rebuild;
  SettledLoads loads;
  Contradictions contradictions;

  std::vector<int> rebuilt_slaves;  // whose displacement is not interpolated
  std::vector<IterationRecord> history;
  Estimate provisional;
  bool shown = false;                      // the provisional estimate of this update
  linalg::GrowingMatrix explained;         // by the data, under the broad hypothesis
  VecX prior_variances;                    // of the modes, under the same
  std::vector<SourceCheck> source_checks;  // by member of the team
  OmissionErrors errors;
};

DescentLimits CondensedInverter::Impl::limits(const InversionOptions& asked) {
  DescentLimits limits;
  limits.max_steps = condensed.max_contact_iterations;
  limits.stop = asked.stop;
  limits.out_of_time = [this] { return deadline.over(); };
  limits.on_step = [this] { record(); };
  return limits;
}

void CondensedInverter::Impl::record() {
  const SampledOperators& sampled = loads.sampled();
  const LoadDescent& descent = loads.descent();
  const int m = sampled.size();
  double sum = 0.0, squares = 0.0;
  for (int i = 0; i < m; ++i) {
    const double norm = descent.posterior().misfit(sampled, i) * sampled.sd(i);
    sum += norm;
    squares += norm * norm;
  }
  IterationRecord entry;
  entry.iteration = static_cast<int>(history.size()) + 1;
  entry.misfit_mm.mean = sum / m;
  entry.misfit_mm.std = m > 1 ? std::sqrt(std::max(0.0, (squares - sum * sum / m) / (m - 1))) : 0.0;
  const PenetrationSummary summary = summarise_penetration(descent.contact().penetration());
  entry.penetrating = summary.penetrating;
  entry.max_penetration_mm = summary.max_mm;
  entry.elapsed_ms = deadline.elapsed_ms();
  history.push_back(entry);
}

void CondensedInverter::Impl::rebuild_field(const ModePosterior::Misfit& misfit,
                                            Estimate& estimate) {
  const LoadDescent& descent = loads.descent();
  if (options.uncertainty) {
    const StageClock clock(profile, UpdateStage::kDeviation);
    rebuild.standard_deviation(team, descent.reduction(), descent.covariance_factor(),
                               loads.remainder_variances(), estimate.sd_mm);
    // Where data lie farther off than chance explains, so may the estimate (Birge 1932).
    if (misfit.ratio > misfit.by_chance) estimate.sd_mm *= misfit.ratio;
  } else {
    estimate.sd_mm.resize(0);
  }
  const StageClock clock(profile, UpdateStage::kField);
  rebuild.displacement(team, descent.z(), descent.contact(), estimate.displacement);
}

Status CondensedInverter::Impl::show_provisional(const InversionOptions& asked) {
  if (shown || asked.spent_ms + deadline.elapsed_ms() < kProvisionalAfter_ms) return {};
  shown = true;
  if (auto status = loads.spread(); !status) return status;
  rebuild_field(loads.descent().posterior().misfit(), provisional);
  const IterationRecord& last = history.back();
  provisional.status = EstimateStatus::kIterating;
  provisional.reason = "provisional: the search goes on";
  provisional.history = history;
  provisional.misfit_mm = last.misfit_mm;
  provisional.initial_misfit_mm = mean_std_of_norms(loads.data().displacements);
  provisional.contact = {loads.descent().contact().size(), last.penetrating,
                         last.max_penetration_mm, static_cast<int>(history.size())};
  provisional.prior_scales = loads.strengths().mean();
  asked.on_iterate(provisional);
  return {};
}

Status CondensedInverter::Impl::finish(EstimateStatus outcome, Estimate& estimate) {
  const LoadDescent& descent = loads.descent();
  const PriorStrengths& strengths = loads.strengths();
  record();  // of the mean over the hypotheses
  const Stopwatch rebuilding;
  const auto misfit = loads.descent().posterior().misfit();
  rebuild_field(misfit, estimate);
  if (options.uncertainty) {
    const StageClock clock(profile, UpdateStage::kDeviation);
    if (!loads.strengths().explained_broadly(explained, prior_variances)) {
      return fail(ErrorCode::kNotFinite, "inversion: the broad hypothesis is not finite");
    }
    rebuild.known(team, explained, prior_variances, estimate.known);
    double sum = 0.0;
    for (const NodeIndex node : operators->region) sum += estimate.known[node];
    estimate.region_known = sum / static_cast<double>(operators->region.size());
  } else {
    estimate.known.resize(0);
    estimate.region_known = std::numeric_limits<double>::quiet_NaN();
  }
  const ContactAtLoads& contact = descent.contact();
  const StageClock checking(profile, UpdateStage::kCheck);
  if (auto status = check_equilibrium(*operators, rebuilt_slaves, contact.penetration(),
                                      estimate.displacement);
      !status) {
    return status;
  }
  const auto measured = deformation.measure(estimate.displacement);
  if (auto status = check_deformation(measured, estimate); !status) return status;
  estimate.rebuild_ms = rebuilding.milliseconds();
  if (auto status = estimate_omissions(); !status) return status;

  const IterationRecord& last = history.back();
  estimate.misfit_mm = last.misfit_mm;
  estimate.initial_misfit_mm = mean_std_of_norms(loads.data().displacements);
  estimate.contact = {contact.size(), last.penetrating, last.max_penetration_mm,
                      static_cast<int>(history.size())};
  estimate.contact.decrement = descent.decrement();
  estimate.contact.max_violation_mm = contact.violation_mm();
  estimate.active_slaves.clear();
  estimate.contact_force_n = contact.forces();
  for (const int slave : contact.active()) {
    estimate.active_slaves.push_back(operators->slaves[static_cast<std::size_t>(slave)]);
  }
  estimate.history = history;
  estimate.prior_scales = strengths.mean();
  estimate.prior_absent = strengths.absent();
  estimate.prior_at_bound = strengths.at_bound();
  estimate.hypotheses = strengths.hypotheses();
  std::sort(estimate.hypotheses.begin(), estimate.hypotheses.end(),
            [](const Hypothesis& a, const Hypothesis& b) { return a.weight > b.weight; });
  estimate.misfit_ratio = misfit.ratio;
  estimate.data_outside_region = loads.sampled().data_outside_region();
  // Loads that a search had no time for may contradict any source.
  summarise_sources(outcome != EstimateStatus::kDeadline, estimate);
  return {};
}

void CondensedInverter::Impl::summarise_sources(bool compare, Estimate& estimate) {
  const SparseData& data = loads.data();
  const std::size_t count = data.sources.size();
  estimate.sources.resize(count);
  compare = compare && count > 1;
  auto summarise = [&](int member) {
    for (auto i = static_cast<std::size_t>(member); i < count;
         i += static_cast<std::size_t>(team.size())) {
      const DataSource& source = data.sources[i];
      SourceSummary& summary = estimate.sources[i];
      summary = {};
      summary.source = source.name;
      summary.data = source.count;
      summary.outliers = loads.weights().outliers(source.first, source.count);
      Consistency consistency;
      if (!compare || !loads.descent().posterior().check_source(
                          loads.sampled(), loads.strengths(), source,
                          source_checks[static_cast<std::size_t>(member)], consistency)) {
        continue;
      }
      summary.chi_square = consistency.chi_square;
      summary.degrees_of_freedom = consistency.degrees_of_freedom;
      summary.p_value = consistency.p_value;
      summary.consistent = !(consistency.p_value < kInconsistent);
    }
  };
  team.run(summarise);
}

Status CondensedInverter::Impl::estimate_omissions() {
  const LoadDescent& descent = loads.descent();
  const VecX& penetration = descent.contact().penetration();
  errors.nearest_slave_mm =
      penetration.size() > 0 ? -penetration.maxCoeff() : std::numeric_limits<double>::infinity();
  errors.contact_mm = descent.contact().size() == 0 ? contact_error_mm(penetration) : 0.0;
  errors.far_field_mm = rebuild.far_field_error_mm();
  errors.gravity_modes_mm = 0.0;
  if (options.gravity_modes) return {};
  const auto error = gravity_modes_error_mm(loads.sampled(), descent.reduction(), rebuild,
                                            descent.posterior(), penetration);
  if (!error) return tl::unexpected(error.error());
  errors.gravity_modes_mm = *error;
  return {};
}

CondensedInverter::CondensedInverter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
CondensedInverter::CondensedInverter(CondensedInverter&&) noexcept = default;
CondensedInverter& CondensedInverter::operator=(CondensedInverter&&) noexcept = default;
CondensedInverter::~CondensedInverter() = default;

Result<CondensedInverter> CondensedInverter::build(
    std::shared_ptr<const CondensedOperators> operators,
    std::shared_ptr<const geometry::TetLocator> locator, const CaseConfig& config,
    const CondensedOptions& options) {
  if (operators->num_nodes() != operators->control_neighbours.cols() ||
      operators->responses.num_columns() != operators->num_modes() + operators->num_slaves()) {
    return invalid("condensed operators: the arrays do not belong to one mesh");
  }
  linalg::use_single_threaded_blas();
  auto impl = std::make_unique<Impl>(std::move(operators), std::move(locator), config, options);
  return CondensedInverter(std::move(impl));
}

const OmissionErrors& CondensedInverter::omission_errors() const { return impl_->errors; }
VecX CondensedInverter::weights() const { return impl_->loads.weights().values(); }
const UpdateProfile& CondensedInverter::profile() const { return impl_->profile; }

PosteriorModes CondensedInverter::posterior() const {
  const LoadDescent& descent = impl_->loads.descent();
  const ContactReduction& contact = descent.reduction();
  return {impl_->operators,
          impl_->window.first,
          descent.covariance_factor().triangularView<Eigen::Lower>(),
          contact.active(),
          contact.response().leftCols(impl_->window.count),
          impl_->loads.remainder_variances()};
}

Status CondensedInverter::update(const SparseData& data, Estimate& estimate,
                                 const InversionOptions& asked) {
  Impl& impl = *impl_;
  impl.deadline.begin(asked.spent_ms);
  impl.history.clear();
  impl.profile = {};
  if (auto status = impl.loads.take(data); !status) return status;
  impl.contradictions.reserve(data.size());
  impl.shown = false;
  std::function<Status()> on_answer;
  if (asked.on_iterate) on_answer = [&impl, &asked] { return impl.show_provisional(asked); };
  const auto outcome = impl.loads.settle(asked, impl.limits(asked), on_answer);
  if (!outcome) return tl::unexpected(outcome.error());
  const LoadDescent& descent = impl.loads.descent();
  if (!descent.z().allFinite() || !descent.contact().forces().allFinite()) {
    return fail(ErrorCode::kNotFinite, "inversion: the estimate is not finite");
  }
  if (auto status = impl.finish(*outcome, estimate); !status) {
    estimate.status = EstimateStatus::kNotRun;
    return status;
  }
  estimate.status = *outcome;
  set_reason(*outcome, impl.condensed.deadline_ms, estimate);
  append_sources(estimate);
  const SparseData& followed = impl.loads.data();
  if (followed.sources.empty()) {
    append_outliers(impl.loads.weights().outliers(0, followed.size()), followed.size(),
                    estimate.reason);
  }
  append_contradiction(impl.contradictions.find(followed), followed, estimate.reason);
  append_warnings(estimate, impl.poisson_ratio, estimate.reason);
  impl.deadline.end();
  return {};
}

}  // namespace brainshift::inversion
