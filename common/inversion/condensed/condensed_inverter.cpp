// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/condensed_inverter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "common/core/stopwatch.hpp"
#include "common/core/thread_team.hpp"
#include "common/inversion/condensed/contradictions.hpp"
#include "common/inversion/condensed/field_rebuild.hpp"
#include "common/inversion/condensed/load_descent.hpp"
#include "common/inversion/condensed/omission_estimates.hpp"
#include "common/inversion/condensed/reason.hpp"
#include "common/inversion/condensed/robust_weights.hpp"
#include "common/inversion/condensed/sampled_operators.hpp"
#include "common/inversion/contract/data_check.hpp"
#include "common/inversion/contract/estimate_check.hpp"
#include "common/inversion/contract/penetration.hpp"
#include "common/inversion/strengths/prior_strengths.hpp"
#include "common/linalg/blas_threads.hpp"

namespace brainshift::inversion {
namespace {

// Rounds of weights and places of data, each with a descent; then the data stay where they are.
// Until half of them the strengths may change again.
constexpr int kMaxRounds = 10;
constexpr int kMaxFits = 6;
constexpr int kMaxFirstRounds = 6;  // of weights
// Variances that differ by less than this part change nothing that anyone sees.
constexpr double kSameVariance = 0.1;

// By how much the displacement of a brain differs whose tissue is 30 % stiffer here and softer
// there than the case says, as a part of the displacement: 0.09 to 0.15 in sag, more where tissue
// swells (decision 0018). There the strength of the same part grows with the data.
constexpr double kModelError = 0.1;

// Standard deviation of a displacement component that the modes of `part` stand for, mm; 0 without
// modes.
double displacement_sd_mm(const CondensedOperators& operators, PriorPart part) {
  const int first = operators.first_column(part), count = operators.columns(part);
  if (count == 0) return 0.0;
  double squares = 0.0;
  for (int j = first; j < first + count; ++j) squares += operators.responses.squared_norm(j);
  return std::sqrt(squares / static_cast<double>(3 * operators.num_nodes()));
}

bool same(const RemainderVariances& a, const RemainderVariances& b) {
  return ((a - b).array().abs() <= kSameVariance * a.array().max(b.array())).all();
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
        strengths(operators->part_columns, window, SparseData::kMaxCommonErrors,
                  config.prior.estimate_scales, team),
        descent(*operators, window, config.contact.penalty_n_per_mm, options.contact, team,
                profile),
        rebuild(*operators, window, team, options.region_of_interest),
        robust(config.sensing.robust_weights),
        medium_sd_mm(displacement_sd_mm(*operators, PriorPart::kMedium)) {
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
    descent.reserve(data);
    sampled.reserve(data);
    weights.reserve(data);
    contradictions.reserve(data);
    norms.resize(data);
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

  // Checks and places data that are new.
  Status accept(const SparseData& data);
  // Loads with contact, strengths, weights and moving data in turn, until nothing changes. `data`
  // follows `moved`. Errors of LoadDescent and PriorStrengths, and of moving data that are not fit.
  Result<EstimateStatus> settle(const SparseData*& data, const InversionOptions& asked);
  // Of the part that stands for the model's own error, in units of its standard deviation.
  double model_error_floor(const SparseData& data);
  // Samples the data and takes their linear model.
  Status sample(const SparseData& data);
  Status distrust_outliers(const SparseData& data);
  // PriorStrengths::fit and refit for the present linear model.
  Status fit();
  Result<bool> refit(bool may_change);
  // Strengths and rough descents in turn until the strengths stay.
  Status find_strengths(const DescentLimits& limits, EstimateStatus& outcome);
  // Weights and places of the data for the present estimate; whether anything changed.
  Result<bool> follow(const SparseData*& data, const InversionOptions& asked);
  RemainderVariances remainder_variances() const;
  bool reweigh(const SparseData& data);
  Result<bool> relocate(const SparseData& data, const MovingData& moving);
  void record();
  Status finish(const SparseData& data, Estimate& estimate);
  Status estimate_omissions();
  void summarise_sources(const SparseData& data, Estimate& estimate);

  std::shared_ptr<const CondensedOperators> operators;
  CondensedOptions options;
  ModeWindow window;
  CondensedConfig condensed;
  double poisson_ratio;
  ThreadTeam team;
  UpdateProfile profile;  // of the last update
  fem::DeformationCheck deformation;
  SampledOperators sampled;
  PriorStrengths strengths;
  LoadDescent descent;
  FieldRebuild rebuild;
  RobustWeights weights;
  Contradictions contradictions;
  bool robust;
  double medium_sd_mm;

  Stopwatch watch;                         // of the update
  std::vector<int> rebuilt_slaves;         // whose displacement is not interpolated
  VecX norms;                              // of the residuals, per datum
  RemainderVariances left_out;             // what `sampled` knows
  SparseData moved;                        // the data where they are now, when they move
  std::vector<DataSource> sources_before;  // of `moved`, before they moved
  Points moving_displacement;
  std::vector<IterationRecord> history;
  OmissionErrors errors;
};

Status CondensedInverter::Impl::accept(const SparseData& data) {
  if (auto status = check_data(data); !status) return status;
  reserve(data.size());
  const StageClock clock(profile, UpdateStage::kLocate);
  return sampled.locate(data);
}

bool CondensedInverter::Impl::reweigh(const SparseData& data) {
  if (!robust) return false;
  auto out = norms.head(data.size());
  for (int i = 0; i < data.size(); ++i) out[i] = descent.posterior().residual_norm(sampled, i);
  return weights.update(data, out);
}

Result<bool> CondensedInverter::Impl::relocate(const SparseData& data, const MovingData& moving) {
  if (&data != &moved) moved = data;
  sources_before = moved.sources;
  {
    const StageClock clock(profile, UpdateStage::kFollow);
    rebuild.displacement_at(team, moving.nodes, descent.z(), descent.contact(),
                            moving_displacement);
    if (!moving.relocate(moving_displacement, moved)) return false;
  }
  if (auto status = accept(moved); !status) return tl::unexpected(status.error());
  weights.follow(sources_before, moved);
  return true;
}

RemainderVariances CondensedInverter::Impl::remainder_variances() const {
  const PriorScaleValues squares = strengths.mean_square();
  RemainderVariances variances;
  for (int g = 0; g < kRemainders; ++g) {
    variances[g] = squares[static_cast<std::size_t>(Eigen::Index{kLoadParts} + g)];
  }
  return variances;
}

// Before strengths are fitted, which would grow until gross errors are no residuals any more:
// weights under the case's own strengths, without contact.
Status CondensedInverter::Impl::distrust_outliers(const SparseData& data) {
  for (int round = 0; round < kMaxFirstRounds; ++round) {
    if (auto status = descent.minimise(strengths); !status) return status;
    if (!reweigh(data)) return {};
    if (auto status = sample(data); !status) return status;
  }
  return {};
}

Status CondensedInverter::Impl::fit() {
  const StageClock clock(profile, UpdateStage::kHypotheses);
  return strengths.fit(descent.posterior().gram(), descent.posterior().right_hand_side());
}

Result<bool> CondensedInverter::Impl::refit(bool may_change) {
  const StageClock clock(profile, UpdateStage::kHypotheses);
  return strengths.refit(descent.posterior().gram(), descent.posterior().right_hand_side(),
                         may_change);
}

Status CondensedInverter::Impl::find_strengths(const DescentLimits& limits,
                                               EstimateStatus& outcome) {
  if (auto status = fit(); !status) return status;
  for (int fit = 1;; ++fit) {
    if (auto status = descent.jump(sampled, strengths); !status) return status;
    const auto descended = descent.descend(sampled, strengths, false, limits);
    if (!descended) return tl::unexpected(descended.error());
    outcome = *descended;
    // Strengths that change need loads of their own.
    const bool may_change = outcome == EstimateStatus::kConverged && fit < kMaxFits;
    const auto changed = refit(may_change);
    if (!changed) return tl::unexpected(changed.error());
    if (!*changed) return {};
  }
}

Result<bool> CondensedInverter::Impl::follow(const SparseData*& data,
                                             const InversionOptions& asked) {
  const bool reweighed = reweigh(*data);
  bool relocated = false;
  if (asked.moving != nullptr) {
    const auto changed = relocate(*data, *asked.moving);
    if (!changed) return tl::unexpected(changed.error());
    relocated = *changed;
    if (relocated) data = &moved;
  }
  const RemainderVariances now = remainder_variances();
  const bool resampled = sampled.data_outside_region() > 0 && !same(now, left_out);
  return reweighed || relocated || resampled;
}

// The upper quartile of the measured motion without outliers: of a surface that is measured along
// its normals it is near the motion itself.
double CondensedInverter::Impl::model_error_floor(const SparseData& data) {
  if (!(medium_sd_mm > 0.0)) return 0.0;
  int count = 0;
  for (int i = 0; i < data.size(); ++i) {
    if (weights.values()[i] >= kOutlierWeight) norms[count++] = data.displacements.col(i).norm();
  }
  if (count == 0) return 0.0;
  double* const upper = norms.data() + 3 * count / 4;
  std::nth_element(norms.data(), upper, norms.data() + count);
  return kModelError * *upper / (std::sqrt(3.0) * medium_sd_mm);
}

Status CondensedInverter::Impl::sample(const SparseData& data) {
  left_out = remainder_variances();
  {
    const StageClock clock(profile, UpdateStage::kSample);
    sampled.sample(data, left_out, weights.values());
  }
  return descent.take(sampled);
}

Result<EstimateStatus> CondensedInverter::Impl::settle(const SparseData*& data,
                                                       const InversionOptions& asked) {
  DescentLimits limits;
  limits.max_steps = condensed.max_contact_iterations;
  limits.stop = asked.stop;
  limits.out_of_time = [this] { return watch.milliseconds() > condensed.deadline_ms; };
  limits.on_step = [this] { record(); };
  strengths.reset();
  strengths.set_floor(PriorPart::kMedium, model_error_floor(*data));
  auto outcome = EstimateStatus::kConverged;
  if (auto status = sample(*data); !status) return tl::unexpected(status.error());
  if (auto status = distrust_outliers(*data); !status) return tl::unexpected(status.error());
  // Once more, without them.
  strengths.set_floor(PriorPart::kMedium, model_error_floor(*data));
  if (auto status = find_strengths(limits, outcome); !status) {
    return tl::unexpected(status.error());
  }
  bool fine = false, unsettled = false;
  for (int round = 0;; ++round) {
    if (auto status = descent.average(sampled, strengths); !status)
      return tl::unexpected(status.error());
    if (outcome != EstimateStatus::kConverged) break;
    if (unsettled) {
      outcome = EstimateStatus::kIterationLimit;
      break;
    }
    const auto followed = follow(data, asked);
    if (!followed) return tl::unexpected(followed.error());
    if (!*followed && fine) break;
    unsettled = *followed && round >= kMaxRounds;  // the data stay where they are now
    fine = !*followed || unsettled;
    if (*followed) {
      if (auto status = sample(*data); !status) return tl::unexpected(status.error());
    }
    const auto descended = descent.descend(sampled, strengths, fine, limits);
    if (!descended) return tl::unexpected(descended.error());
    outcome = *descended;
    const bool may_change = outcome == EstimateStatus::kConverged && round < kMaxRounds / 2;
    const auto changed = refit(may_change);
    if (!changed) return tl::unexpected(changed.error());
    if (*changed) {
      if (auto status = find_strengths(limits, outcome); !status) {
        return tl::unexpected(status.error());
      }
      fine = false;
    }
  }
  if (auto status = descent.spread(strengths); !status) return tl::unexpected(status.error());
  return outcome;
}

void CondensedInverter::Impl::record() {
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
  entry.elapsed_ms = watch.milliseconds();
  history.push_back(entry);
}

Status CondensedInverter::Impl::finish(const SparseData& data, Estimate& estimate) {
  record();  // of the mean over the hypotheses
  const Stopwatch rebuilding;
  const double misfit_ratio = descent.posterior().misfit_ratio();
  if (options.uncertainty) {
    const StageClock clock(profile, UpdateStage::kDeviation);
    rebuild.standard_deviation(team, descent.reduction(), descent.covariance_factor(),
                               remainder_variances(), estimate.sd_mm);
    // Where data lie farther off than their standard deviations, so may the estimate (Birge 1932).
    if (misfit_ratio > 1.0) estimate.sd_mm *= misfit_ratio;
  } else {
    estimate.sd_mm.resize(0);
  }
  const ContactAtLoads& contact = descent.contact();
  {
    const StageClock clock(profile, UpdateStage::kField);
    rebuild.displacement(team, descent.z(), contact, estimate.displacement);
  }
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
  estimate.initial_misfit_mm = mean_std_of_norms(data.displacements);
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
  estimate.misfit_ratio = misfit_ratio;
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
    if (data.sources.size() < 2 ||
        !descent.posterior().check_source(sampled, strengths, source, consistency)) {
      continue;
    }
    summary.chi_square = consistency.chi_square;
    summary.degrees_of_freedom = consistency.degrees_of_freedom;
    summary.p_value = consistency.p_value;
    summary.consistent = !(consistency.p_value < kInconsistent);
  }
}

Status CondensedInverter::Impl::estimate_omissions() {
  const VecX& penetration = descent.contact().penetration();
  errors.nearest_slave_mm =
      penetration.size() > 0 ? -penetration.maxCoeff() : std::numeric_limits<double>::infinity();
  errors.contact_mm = descent.contact().size() == 0 ? contact_error_mm(penetration) : 0.0;
  errors.far_field_mm = rebuild.far_field_error_mm();
  errors.gravity_modes_mm = 0.0;
  if (options.gravity_modes) return {};
  const auto error = gravity_modes_error_mm(sampled, descent.reduction(), rebuild,
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
    return fail(ErrorCode::kInvalidArgument,
                "condensed operators: the arrays do not belong to one mesh");
  }
  linalg::use_single_threaded_blas();
  auto impl = std::make_unique<Impl>(std::move(operators), std::move(locator), config, options);
  return CondensedInverter(std::move(impl));
}

const OmissionErrors& CondensedInverter::omission_errors() const { return impl_->errors; }
VecX CondensedInverter::weights() const { return impl_->weights.values(); }
const UpdateProfile& CondensedInverter::profile() const { return impl_->profile; }

Status CondensedInverter::update(const SparseData& data, Estimate& estimate,
                                 const InversionOptions& asked) {
  Impl& impl = *impl_;
  impl.watch = Stopwatch();
  impl.descent.forget();
  impl.history.clear();
  impl.profile = {};
  if (auto status = impl.accept(data); !status) return status;
  impl.weights.reset(data.size());
  const SparseData* followed = &data;
  const auto outcome = impl.settle(followed, asked);
  if (!outcome) return tl::unexpected(outcome.error());
  if (!impl.descent.z().allFinite() || !impl.descent.contact().forces().allFinite()) {
    return fail(ErrorCode::kNotFinite, "inversion: the estimate is not finite");
  }
  if (auto status = impl.finish(*followed, estimate); !status) {
    estimate.status = EstimateStatus::kNotRun;
    return status;
  }
  estimate.status = *outcome;
  set_reason(*outcome, impl.condensed.deadline_ms, estimate);
  append_sources(estimate);
  if (followed->sources.empty()) {
    append_outliers(impl.weights.outliers(0, followed->size()), followed->size(), estimate.reason);
  }
  append_contradiction(impl.contradictions.find(*followed), *followed, estimate.reason);
  append_warnings(estimate, impl.poisson_ratio, estimate.reason);
  return {};
}

}  // namespace brainshift::inversion
