// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/settled_loads.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/inversion/contract/data_check.hpp"
#include "common/linalg/growing_matrix.hpp"

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
// there than the case says, as a part of the displacement: 0.09 to 0.15 in sag, 0.07 to 0.28 where
// tissue swells (decisions 0018, 0037). The first value counts before any load is known.
constexpr double kModelError = 0.1, kModelErrorOfVolume = 0.3;
// How much larger it is where no data correct the model (chosen on trial surgeries; decision 0037).
constexpr double kFarModelError = 1.5;
constexpr bool is_volume(PriorPart part) {
  return part == PriorPart::kTumourVolume || part == PriorPart::kBrainVolume;
}

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

SettledLoads::SettledLoads(const std::shared_ptr<const CondensedOperators>& operators,
                           std::shared_ptr<const geometry::TetLocator> locator, ModeWindow window,
                           const CaseConfig& config, bool contact, ThreadTeam& team,
                           FieldRebuild& rebuild, UpdateProfile& profile)
    : team_(team),
      rebuild_(rebuild),
      profile_(profile),
      sampled_(operators, std::move(locator), window, config.condensed.outside_region, team),
      strengths_(operators->part_columns, window, SparseData::kMaxCommonErrors,
                 config.prior.estimate_scales, config.prior.broad_weight, team),
      descent_(*operators, window, config.contact.penalty_n_per_mm, contact, team, profile),
      robust_(config.sensing.robust_weights),
      medium_sd_mm_(displacement_sd_mm(*operators, PriorPart::kMedium)),
      far_sd_mm_(displacement_sd_mm(*operators, PriorPart::kFar)) {}

void SettledLoads::reserve(int data) {
  if (data <= norms_.size()) return;
  descent_.reserve(data);
  sampled_.reserve(data);
  weights_.reserve(data);
  linalg::replace(norms_, data);
}

Status SettledLoads::take(const SparseData& data) {
  descent_.forget();
  data_ = &data;
  if (auto status = accept(data); !status) return status;
  weights_.reset(data.size());
  return {};
}

Result<EstimateStatus> SettledLoads::settle(const InversionOptions& asked,
                                            const DescentLimits& limits,
                                            const std::function<Status()>& on_answer) {
  Round round;
  round.on_answer = &on_answer;
  if (auto status = begin(limits, round.outcome); !status) return tl::unexpected(status.error());
  for (bool last = false; !last; ++round.number) {
    const auto gone = go_round(asked, limits, round);
    if (!gone) return tl::unexpected(gone.error());
    last = *gone;
  }
  if (auto status = spread(); !status) return tl::unexpected(status.error());
  return round.outcome;
}

Status SettledLoads::begin(const DescentLimits& limits, EstimateStatus& outcome) {
  strengths_.reset();
  set_model_error_floor();
  if (auto status = sample(); !status) return status;
  if (auto status = distrust_outliers(limits); !status) return status;
  set_model_error_floor();  // once more, without them
  if (auto status = find_strengths(limits, outcome); !status) return status;
  if (outcome != EstimateStatus::kConverged || !set_model_error_floor_of_loads()) return {};
  return find_strengths(limits, outcome);
}

Result<bool> SettledLoads::go_round(const InversionOptions& asked, const DescentLimits& limits,
                                    Round& round) {
  const auto averaged = descent_.average(sampled_, strengths_, limits);
  if (!averaged) return averaged;
  if (round.outcome != EstimateStatus::kConverged) return true;
  if (round.depth == Depth::kLast) {
    round.outcome = EstimateStatus::kIterationLimit;
    return true;
  }
  if (!*averaged || (round.depth != Depth::kFine && limits.over())) {
    round.outcome = EstimateStatus::kDeadline;
    return true;
  }
  if (round.depth != Depth::kFine && *round.on_answer) {
    if (auto status = (*round.on_answer)(); !status) return tl::unexpected(status.error());
  }
  const auto followed = follow(asked.moving);
  if (!followed) return tl::unexpected(followed.error());
  if (!*followed && round.depth == Depth::kFine) return true;
  const bool used_up = round.number >= kMaxRounds;
  round.depth = !*followed ? Depth::kFine : used_up ? Depth::kLast : Depth::kRough;
  if (*followed) {
    if (auto status = sample(); !status) return tl::unexpected(status.error());
  }
  if (auto status = descend(limits, round); !status) return tl::unexpected(status.error());
  return false;
}

Status SettledLoads::descend(const DescentLimits& limits, Round& round) {
  const auto descended =
      descent_.descend(sampled_, strengths_, round.depth != Depth::kRough, limits);
  if (!descended) return tl::unexpected(descended.error());
  round.outcome = *descended;
  const bool converged = round.outcome == EstimateStatus::kConverged;
  const auto changed = refit(converged && round.number < kMaxRounds / 2, limits);
  if (!changed) return tl::unexpected(changed.error());
  if (!*changed) return {};
  round.depth = Depth::kRough;
  return find_strengths(limits, round.outcome);
}

Status SettledLoads::accept(const SparseData& data) {
  if (auto status = check_data(data); !status) return status;
  reserve(data.size());
  const StageClock clock(profile_, UpdateStage::kLocate);
  return sampled_.locate(data);
}

bool SettledLoads::reweigh() {
  if (!robust_) return false;
  auto out = norms_.head(data_->size());
  for (int i = 0; i < data_->size(); ++i) out[i] = descent_.posterior().residual_norm(sampled_, i);
  return weights_.update(*data_, out);
}

Result<bool> SettledLoads::relocate(const MovingData& moving) {
  if (data_ != &moved_) moved_ = *data_;
  sources_before_ = moved_.sources;
  {
    const StageClock clock(profile_, UpdateStage::kFollow);
    rebuild_.displacement_at(team_, moving.nodes, descent_.z(), descent_.contact(),
                             moving_displacement_);
    if (!moving.relocate(moving_displacement_, moved_)) return false;
  }
  if (auto status = accept(moved_); !status) return tl::unexpected(status.error());
  weights_.follow(sources_before_, moved_);
  data_ = &moved_;
  return true;
}

RemainderVariances SettledLoads::remainder_variances() const {
  const PriorScaleValues squares = strengths_.mean_square();
  RemainderVariances variances;
  for (int g = 0; g < kRemainders; ++g) {
    variances[g] = squares[static_cast<std::size_t>(Eigen::Index{kLoadParts} + g)];
  }
  return variances;
}

// Before strengths are fitted, which would grow until gross errors are no residuals any more:
// weights under the case's own strengths, without contact.
Status SettledLoads::distrust_outliers(const DescentLimits& limits) {
  for (int round = 0; round < kMaxFirstRounds; ++round) {
    if (limits.stop.stop_requested()) return stopped(1);
    if (round > 0 && limits.over()) return {};
    if (auto status = descent_.minimise(strengths_); !status) return status;
    if (!reweigh()) return {};
    if (auto status = sample(); !status) return status;
  }
  return {};
}

Status SettledLoads::fit(const DescentLimits& limits) {
  const StageClock clock(profile_, UpdateStage::kHypotheses);
  return strengths_.fit(descent_.posterior().gram(), descent_.posterior().right_hand_side(),
                        data_->common_variance, [&limits] { return limits.over(); });
}

Result<bool> SettledLoads::refit(bool may_change, const DescentLimits& limits) {
  const StageClock clock(profile_, UpdateStage::kHypotheses);
  return strengths_.refit(descent_.posterior().gram(), descent_.posterior().right_hand_side(),
                          may_change, data_->common_variance, [&limits] { return limits.over(); });
}

Status SettledLoads::find_strengths(const DescentLimits& limits, EstimateStatus& outcome) {
  if (auto status = fit(limits); !status) return status;
  for (int fit = 1;; ++fit) {
    const auto jumped = descent_.jump(sampled_, strengths_, limits);
    if (!jumped) return tl::unexpected(jumped.error());
    outcome = EstimateStatus::kDeadline;
    if (*jumped) {
      const auto descended = descent_.descend(sampled_, strengths_, false, limits);
      if (!descended) return tl::unexpected(descended.error());
      outcome = *descended;
    }
    // Strengths that change need loads of their own.
    const bool may_change = outcome == EstimateStatus::kConverged && fit < kMaxFits;
    const auto changed = refit(may_change, limits);
    if (!changed) return tl::unexpected(changed.error());
    if (!*changed) return {};
  }
}

Result<bool> SettledLoads::follow(const MovingData* moving) {
  const bool reweighed = reweigh();
  bool relocated = false;
  if (moving != nullptr) {
    auto changed = relocate(*moving);
    if (!changed) return changed;
    relocated = *changed;
  }
  const RemainderVariances now = remainder_variances();
  const bool resampled = sampled_.data_outside_region() > 0 && !same(now, left_out_);
  return reweighed || relocated || resampled;
}

double SettledLoads::motion_of_part(PriorPart part) {
  const auto [first, count] = strengths_.modes_of(part);
  const ModePosterior& posterior = descent_.posterior();
  int data = 0;
  if (count == 0) return 0.0;
  const auto columns = posterior.jacobian().middleCols(sampled_.common() + first, count);
  const auto z = posterior.z().segment(first, count);
  for (int i = 0; i < data_->size(); ++i) {
    if (weights_.values()[i] < kOutlierWeight) continue;
    const int row = sampled_.first_row(i), rows = sampled_.first_row(i + 1) - row;
    norms_[data++] = sampled_.sd(i) * (columns.middleRows(row, rows) * z).norm();
  }
  return data > 0 ? upper_quartile(data) : 0.0;
}

double SettledLoads::upper_quartile(int count) {
  double* const upper = norms_.data() + 3 * count / 4;
  std::nth_element(norms_.data(), upper, norms_.data() + count);
  return *upper;
}

// Of each family the upper quartile of the motion that its loads explain at the data. Whether that
// makes a difference.
bool SettledLoads::set_model_error_floor_of_loads() {
  const double before = strengths_.floor(PriorPart::kMedium);
  if (!(medium_sd_mm_ > 0.0) || before == 0.0) return false;
  double squares = 0.0, plain = 0.0;
  for (int g = 0; g < kPriorParts; ++g) {
    const double moved = motion_of_part(static_cast<PriorPart>(g));
    const double share = is_volume(static_cast<PriorPart>(g)) ? kModelErrorOfVolume : kModelError;
    squares += share * share * moved * moved;
    plain += kModelError * kModelError * moved * moved;
  }
  if (!(plain > 0.0)) return false;
  const double floor = before * std::sqrt(squares / plain);
  if (floor * floor <= (1.0 + kSameVariance) * before * before) return false;
  set_floor(floor);
  return true;
}

// Far from the data nothing corrects what the model gets wrong.
void SettledLoads::set_floor(double of_medium) {
  strengths_.set_floor(PriorPart::kMedium, of_medium);
  if (far_sd_mm_ > 0.0) {
    strengths_.set_floor(PriorPart::kFar, kFarModelError * of_medium * medium_sd_mm_ / far_sd_mm_);
  }
}

// The upper quartile of the measured motion without outliers: of a surface that is measured along
// its normals it is near the motion itself.
void SettledLoads::set_model_error_floor() {
  double floor = 0.0;
  int count = 0;
  for (int i = 0; i < data_->size(); ++i) {
    if (weights_.values()[i] < kOutlierWeight) continue;
    norms_[count++] = data_->displacements.col(i).norm();
  }
  if (medium_sd_mm_ > 0.0 && count > 0) {
    floor = kModelError * upper_quartile(count) / (std::sqrt(3.0) * medium_sd_mm_);
  }
  set_floor(floor);
}

Status SettledLoads::sample() {
  left_out_ = remainder_variances();
  {
    const StageClock clock(profile_, UpdateStage::kSample);
    sampled_.sample(*data_, left_out_, weights_.values());
  }
  return descent_.take(sampled_);
}

}  // namespace brainshift::inversion
