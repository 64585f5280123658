// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/strengths/prior_strengths.hpp"

#include <algorithm>
#include <tuple>

namespace brainshift::inversion {
namespace {

namespace blas = linalg::blas;

using Blocks = StrengthEvidence::Blocks;

constexpr int kMaxSteps = 60;
// Of ln p, which is known to about 1e-7.
constexpr double kMinGain = 1e-6;
// A hypothesis of less weight than this changes nothing that anyone sees; of the others, so many
// are kept.
constexpr double kMinWeight = 0.01;
constexpr std::size_t kMaxHypotheses = 20;
// Columns of a triangular matrix that are computed at once.
constexpr Eigen::Index kTogether = 24;
// Makes the covariance of absent parts, which is zero, positive definite.
constexpr double kJitter = 1e-12;

StrengthProfile log_prior() {
  StrengthProfile result{};
  double sum = 0.0;
  for (std::size_t i = 1; i < kStrengths.size(); ++i) {
    const double log_strength = std::log(kStrengths[i]) / kLogStrengthSd;
    result[i] = std::exp(-0.5 * log_strength * log_strength);
    sum += result[i];
  }
  result[0] = std::log(kAbsent);
  for (std::size_t i = 1; i < kStrengths.size(); ++i) {
    result[i] = std::log((1.0 - kAbsent) * result[i] / sum);
  }
  return result;
}

// Root mean square of a strength before the data, of a part that is there.
double before_data() {
  const StrengthProfile log_p = log_prior();
  double mean_square = 0.0;
  for (std::size_t i = 1; i < kStrengths.size(); ++i) {
    mean_square += std::exp(log_p[i]) * kStrengths[i] * kStrengths[i];
  }
  return std::sqrt(mean_square / (1.0 - kAbsent));
}

const double kBeforeData = before_data();  // 2.40

std::size_t index_of(double strength) {
  return static_cast<std::size_t>(std::find(kStrengths.begin(), kStrengths.end(), strength) -
                                  kStrengths.begin());
}

tl::unexpected<Error> not_finite() {
  return fail(ErrorCode::kNotFinite,
              "inversion: the marginal likelihood of the prior's strengths is not finite");
}

PerPart<int> modes_of_window(const PerPart<int>& columns, ModeWindow window) {
  PerPart<int> counts{};
  int column = 0;
  for (std::size_t part = 0; part < columns.size(); ++part) {
    for (int i = 0; i < columns[part]; ++i, ++column) {
      if (column >= window.first && column < window.first + window.count) ++counts[part];
    }
  }
  return counts;
}

}  // namespace

PriorStrengths::PriorStrengths(const PerPart<int>& columns, ModeWindow window, int max_common,
                               bool estimate, double broad_weight, ThreadTeam& team)
    : window_(window),
      estimate_(estimate),
      broad_weight_(broad_weight),
      team_(&team),
      count_(modes_of_window(columns, window)),
      evidence_(count_, max_common),
      works_(static_cast<std::size_t>(team.size())),
      projections_(works_.size()),
      log_prior_(log_prior()) {
  for (std::size_t part = 0; part < count_.size(); ++part) {
    part_of_mode_.insert(part_of_mode_.end(), static_cast<std::size_t>(count_[part]), part);
  }
  hypotheses_.reserve(kMaxHypotheses + 1);
  done_.reserve(kMaxHypotheses + 1);
  candidates_.reserve((1 + kPriorParts + kOutlineErrors.size()) * kPriorParts * kStrengths.size());
  reset();
}

void PriorStrengths::reset() {
  hypotheses_.assign(1, {as_in_the_case(), 1.0});
  set_far(hypotheses_.front().scales);
  floor_ = {};
  evidence_.forget();
}

// 0 for parts that the window does not have.
PriorScaleValues PriorStrengths::as_in_the_case() const {
  PriorScaleValues scales = kAsInTheCase;
  for (std::size_t part = 0; part < count_.size(); ++part) {
    if (count_[part] == 0) scales[part] = 0.0;
  }
  return scales;
}

PriorStrengths::Modes PriorStrengths::modes_of(PriorPart part) const {
  const auto which = static_cast<std::size_t>(part);
  Modes modes{0, count_[which]};
  for (std::size_t before = 0; before < which; ++before) modes.first += count_[before];
  return modes;
}

void PriorStrengths::set_far(PriorScaleValues& scales) const {
  const auto of = [&](PriorPart part) -> double& { return scales[static_cast<std::size_t>(part)]; };
  if (!estimate_ || count_[static_cast<std::size_t>(PriorPart::kFar)] == 0) return;
  of(PriorPart::kFar) = std::max({kBeforeData, of(PriorPart::kMedium), of(PriorPart::kCoarse)});
}

Hypothesis PriorStrengths::broad() const {
  Hypothesis result{as_in_the_case(), broad_weight_, held_error()};
  if (!estimate_) return result;
  for (std::size_t part = 0; part < result.scales.size(); ++part) {
    result.scales[part] *= std::max(kBeforeData, held()[part]);
  }
  set_far(result.scales);
  return result;
}

PriorScaleValues PriorStrengths::absent_parts() const {
  PriorScaleValues scales = as_in_the_case();
  for (std::size_t part = 0; part < count_.size(); ++part) {
    if (searched(part)) scales[part] = 0.0;
  }
  return scales;
}

Variances PriorStrengths::variances(const Hypothesis& hypothesis) const {
  Variances result{{}, hypothesis.error};
  for (std::size_t part = 0; part < result.size(); ++part) {
    result[part] = variance(part, hypothesis.scales);
  }
  return result;
}

double PriorStrengths::log_prior_of_error(int error) const {
  const int errors = evidence_.errors();
  if (errors == 1) return 0.0;
  return std::log(error == 0 ? kNoOutlineError : (1.0 - kNoOutlineError) / (errors - 1));
}

PerPart<double> PriorStrengths::floors() const {
  PerPart<double> result{};
  for (std::size_t part = 0; part < result.size(); ++part) {
    result[part] = floor_[part] * floor_[part];
  }
  return result;
}

void PriorStrengths::add_prior(Profiles& log_p) const {
  for (StrengthProfile& profile : log_p) {
    for (std::size_t i = 0; i < profile.size(); ++i) profile[i] += log_prior_[i];
  }
}

bool PriorStrengths::log_posterior(const Hypothesis& hypothesis, Workspace& work,
                                   double& out) const {
  if (!evidence_.log_evidence(variances(hypothesis), work, out)) return false;
  out += log_prior_of_error(hypothesis.error);
  for (std::size_t part = 0; part < count_.size(); ++part) {
    if (searched(part)) out += log_prior_[index_of(hypothesis.scales[part])];
  }
  return true;
}

bool PriorStrengths::ascend(Hypothesis& hypothesis, Projection& projection, Workspace& work,
                            const GiveUp& give_up) const {
  PriorScaleValues& scales = hypothesis.scales;
  Profiles log_p{};
  for (int step = 0; step < kMaxSteps; ++step) {
    if (give_up && give_up()) return true;
    double gain = 0.0;
    std::size_t best_part = 0, best_strength = 0;
    const Variances own = variances(hypothesis);
    if (!evidence_.project(own, Blocks::kOfEachPart, projection, work) ||
        !evidence_.profiles(projection, own, floors(), log_p, work)) {
      return false;
    }
    add_prior(log_p);
    for (std::size_t part = 0; part < count_.size(); ++part) {
      if (!searched(part)) continue;
      const auto best = std::max_element(log_p[part].begin(), log_p[part].end());
      if (*best - log_p[part][index_of(scales[part])] <= gain) continue;
      gain = *best - log_p[part][index_of(scales[part])];
      best_part = part;
      best_strength = static_cast<std::size_t>(best - log_p[part].begin());
    }
    if (gain > kMinGain) {
      scales[best_part] = kStrengths[best_strength];
      continue;
    }
    const int before = hypothesis.error;
    if (!ascend_error(hypothesis, work)) return false;
    if (hypothesis.error == before) return true;
  }
  return true;
}

bool PriorStrengths::ascend_error(Hypothesis& hypothesis, Workspace& work) const {
  if (evidence_.errors() == 1) return true;
  Hypothesis tried = hypothesis;
  double best = 0.0;
  if (!log_posterior(hypothesis, work, best)) return false;
  for (tried.error = 0; tried.error < evidence_.errors(); ++tried.error) {
    double log_p = 0.0;
    if (!log_posterior(tried, work, log_p)) return false;
    if (log_p <= best + kMinGain) continue;
    best = log_p;
    hypothesis.error = tried.error;
  }
  return true;
}

bool PriorStrengths::search(Hypothesis& best, const GiveUp& give_up) {
  struct Ascent {
    Hypothesis hypothesis;
    double log_p = 0.0;
    bool done = false;
  };
  const int last = evidence_.errors() - 1;
  std::array<Ascent, 2> ascents{Ascent{{absent_parts(), 1.0, 0}},
                                Ascent{{as_in_the_case(), 1.0, last}}};
  auto ascend_from = [&](int member) {
    const auto own = static_cast<std::size_t>(member);
    for (std::size_t i = own; i < ascents.size(); i += works_.size()) {
      Ascent& each = ascents[i];
      each.done = ascend(each.hypothesis, projections_[own], works_[own], give_up) &&
                  log_posterior(each.hypothesis, works_[own], each.log_p);
    }
  };
  team_->run(ascend_from);
  const Ascent* found = nullptr;
  for (const Ascent& each : ascents) {
    if (!each.done) return false;
    if (found == nullptr || each.log_p > found->log_p) found = &each;
  }
  best = found->hypothesis;
  return true;
}

bool PriorStrengths::weigh(const Hypothesis& best) {
  const Variances own = variances(best);
  if (!evidence_.project(own, Blocks::kAll, projections_.front(), works_.front()) ||
      !evidence_.profiles(projections_.front(), own, floors(), profiles_, works_.front())) {
    return false;
  }
  add_prior(profiles_);
  if (!gather_candidates(best)) return false;
  weigh_candidates(best);
  return true;
}

void PriorStrengths::gather_neighbours(const Profiles& log_p, const Hypothesis& from,
                                       double log_weight) {
  for (std::size_t part = 0; part < count_.size(); ++part) {
    if (!searched(part)) continue;
    const std::size_t own = index_of(from.scales[part]);
    for (std::size_t i = 0; i < kStrengths.size(); ++i) {
      if (i == own) continue;
      candidates_.push_back(
          {from.scales, log_weight + log_p[part][i] - log_p[part][own], from.error});
      candidates_.back().scales[part] = kStrengths[i];
    }
  }
}

bool PriorStrengths::gather_candidates(const Hypothesis& best) {
  // Of each part: what it becomes where two parts change.
  PerPart<std::size_t> other{};
  PerPart<char> done{};
  for (std::size_t part = 0; part < count_.size(); ++part) {
    const StrengthProfile& log_p = profiles_[part];
    if (index_of(best.scales[part]) > 0) continue;
    other[part] =
        static_cast<std::size_t>(std::max_element(log_p.begin() + 1, log_p.end()) - log_p.begin());
  }
  auto profile = [&](int member) {
    const auto own = static_cast<std::size_t>(member);
    for (std::size_t part = own; part < count_.size(); part += works_.size()) {
      if (!searched(part)) continue;
      Hypothesis changed = best;
      changed.scales[part] = kStrengths[other[part]];
      const bool found = evidence_.changed_profiles(projections_.front(), variances(best), part,
                                                    variance(part, changed.scales), floors(),
                                                    changed_profiles_[part], works_[own]);
      add_prior(changed_profiles_[part]);
      done[part] = found ? 1 : 0;
    }
  };
  team_->run(profile);
  candidates_.clear();
  gather_neighbours(profiles_, best, 0.0);
  for (std::size_t part = 0; part < count_.size(); ++part) {
    if (!searched(part)) continue;
    if (!done[part]) return false;
    Hypothesis changed = best;
    changed.scales[part] = kStrengths[other[part]];
    gather_neighbours(changed_profiles_[part], changed,
                      profiles_[part][other[part]] - profiles_[part][index_of(best.scales[part])]);
  }
  if (evidence_.errors() > 1 && !gather_other_errors(best)) return false;
  // Two changes of one part may lead back.
  std::erase_if(candidates_, [&](const Hypothesis& each) {
    return each.scales == best.scales && each.error == best.error;
  });
  return true;
}

bool PriorStrengths::gather_other_errors(const Hypothesis& best) {
  std::array<char, kOutlineErrors.size()> done{};
  auto profile = [&](int member) {
    const auto own = static_cast<std::size_t>(member);
    for (std::size_t e = own; e < static_cast<std::size_t>(evidence_.errors());
         e += works_.size()) {
      const Hypothesis changed{best.scales, 1.0, static_cast<int>(e)};
      const Variances there = variances(changed);
      done[e] =
          log_posterior(changed, works_[own], error_log_p_[e]) &&
                  evidence_.project(there, Blocks::kOfEachPart, projections_[own], works_[own]) &&
                  evidence_.profiles(projections_[own], there, floors(), error_profiles_[e],
                                     works_[own])
              ? 1
              : 0;
      add_prior(error_profiles_[e]);
    }
  };
  team_->run(profile);
  for (int e = 0; e < evidence_.errors(); ++e) {
    const auto at = static_cast<std::size_t>(e);
    if (!done[at]) return false;
    if (e == best.error) continue;
    const double log_weight = error_log_p_[at] - error_log_p_[static_cast<std::size_t>(best.error)];
    candidates_.push_back({best.scales, log_weight, e});
    gather_neighbours(error_profiles_[at], {best.scales, 1.0, e}, log_weight);
  }
  return true;
}

void PriorStrengths::weigh_candidates(const Hypothesis& best) {
  std::sort(candidates_.begin(), candidates_.end(), [](const Hypothesis& a, const Hypothesis& b) {
    return std::tie(b.weight, a.error, a.scales) < std::tie(a.weight, b.error, b.scales);
  });
  hypotheses_.assign(1, {best.scales, 1.0, best.error});
  set_far(hypotheses_.front().scales);
  for (const Hypothesis& each : candidates_) {
    if (hypotheses_.size() >= kMaxHypotheses) break;
    // The same pair of changes may come in either order.
    const bool known =
        std::any_of(hypotheses_.begin(), hypotheses_.end(), [&](const Hypothesis& other) {
          return other.scales == each.scales && other.error == each.error;
        });
    if (!known) hypotheses_.push_back({each.scales, std::exp(each.weight), each.error});
  }
  for (Hypothesis& each : hypotheses_) set_far(each.scales);
  const auto sum = [&] {
    double total = 0.0;
    for (const Hypothesis& each : hypotheses_) total += each.weight;
    return total;
  };
  const double all = sum();
  while (hypotheses_.size() > 1 && hypotheses_.back().weight < kMinWeight * all) {
    hypotheses_.pop_back();
  }
  const double kept = sum() / (1.0 - broad_weight_);
  for (Hypothesis& each : hypotheses_) each.weight /= kept;
  if (broad_weight_ > 0.0) hypotheses_.push_back(broad());
}

bool PriorStrengths::climb(const GiveUp& give_up) {
  for (int step = 0; step < kMaxSteps && gain() > kMinGain; ++step) {
    if (give_up && give_up()) return true;
    Hypothesis next = candidates_.front();
    if (!ascend(next, projections_.front(), works_.front(), give_up) || !weigh(next)) return false;
  }
  return true;
}

Status PriorStrengths::fit(const blas::In<double>& gram, const Eigen::Ref<const VecX>& right,
                           const Eigen::MatrixXd& common_variance, const GiveUp& give_up) {
  if (!evidence_.take(gram, right, common_variance)) return not_finite();
  if (!estimate_) return {};
  Hypothesis best;
  if (!search(best, give_up) || !weigh(best) || !climb(give_up)) keep_held();
  return {};
}

Result<bool> PriorStrengths::refit(const blas::In<double>& gram,
                                   const Eigen::Ref<const VecX>& right, bool may_change,
                                   const Eigen::MatrixXd& common_variance, const GiveUp& give_up) {
  if (!evidence_.holds(gram, right, common_variance)) {
    if (!evidence_.take(gram, right, common_variance)) return not_finite();
    hypotheses_.front().error = std::min(held_error(), evidence_.errors() - 1);
    const Hypothesis same = hypotheses_.front();
    if (estimate_ && !weigh(same)) keep_held();
  }
  if (!estimate_ || !may_change || gain() <= kWorthwhile) return false;
  if (!climb(give_up)) keep_held();
  return true;
}

void PriorStrengths::keep_held() {
  candidates_.clear();
  weigh_candidates(Hypothesis(hypotheses_.front()));
}

template <typename Work>
bool PriorStrengths::for_each_hypothesis(Work&& work_on) {
  done_.assign(hypotheses_.size(), 0);
  auto share = [&](int member) {
    const auto own = static_cast<std::size_t>(member);
    for (std::size_t h = own; h < hypotheses_.size(); h += works_.size()) {
      const bool done = work_on(static_cast<Eigen::Index>(h), hypotheses_[h], works_[own]);
      done_[h] = done ? 1 : 0;
    }
  };
  team_->run(share);
  return std::all_of(done_.begin(), done_.end(), [](char done) { return done != 0; });
}

bool PriorStrengths::mean_shift(Eigen::Ref<VecX> out) {
  const auto hypotheses = static_cast<Eigen::Index>(hypotheses_.size());
  means_.resize(evidence_.size(), hypotheses + 1);
  auto mean = means_.col(hypotheses);
  mean.setZero();
  if (!for_each_hypothesis([&](Eigen::Index h, const Hypothesis& each, Workspace& work) {
        return evidence_.mean(variances(each), work, means_.col(h));
      })) {
    return false;
  }
  for (Eigen::Index h = 0; h < hypotheses; ++h) {
    mean += hypotheses_[static_cast<std::size_t>(h)].weight * means_.col(h);
  }
  out = mean - means_.col(0);
  return out.allFinite();
}

// sum w_h (S_h^2 - X_h^T X_h + (m_h - z)(m_h - z)^T)
bool PriorStrengths::covariance(blas::Out<double> factor) {
  const Eigen::Index r = window_.count, rank = evidence_.rank();
  const auto hypotheses = static_cast<Eigen::Index>(hypotheses_.size());
  explained_.resize(hypotheses * rank, r);
  apart_.resize(hypotheses, r);
  if (!for_each_hypothesis([&](Eigen::Index h, const Hypothesis& each, Workspace& work) {
        const double root = std::sqrt(each.weight);
        auto x = explained_.middleRows(h * rank, rank);
        if (!evidence_.explained(variances(each), work, x)) return false;
        x *= root;
        apart_.row(h) = root * (means_.col(h) - means_.col(hypotheses)).tail(r).transpose();
        return true;
      })) {
    return false;
  }
  // The lower triangle, in blocks of columns that do not depend on the team.
  auto subtract_explained = [&](int member) {
    for (Eigen::Index first = kTogether * member; first < r; first += kTogether * team_->size()) {
      const Eigen::Index columns = std::min(kTogether, r - first), rows = r - first;
      auto block = factor.block(first, first, rows, columns);
      blas::multiply_transposed(-1.0, explained_.rightCols(rows),
                                explained_.middleCols(first, columns), 0.0, block);
      blas::multiply_transposed(1.0, apart_.rightCols(rows), apart_.middleCols(first, columns), 1.0,
                                block);
    }
  };
  team_->run(subtract_explained);
  for (const Hypothesis& each : hypotheses_) {
    for (int i = 0; i < r; ++i) {
      factor(i, i) +=
          each.weight * variance(part_of_mode_[static_cast<std::size_t>(i)], each.scales);
    }
  }
  factor.diagonal().array() += kJitter * (1.0 + factor.diagonal().maxCoeff());
  factor.triangularView<Eigen::StrictlyUpper>().setZero();
  return blas::cholesky(factor);
}

bool PriorStrengths::explained_broadly(linalg::GrowingMatrix& x, VecX& variances_of_modes) {
  const Variances variances_of_parts = variances(broad());
  variances_of_modes.resize(window_.count);
  for (int i = 0; i < window_.count; ++i) {
    variances_of_modes[i] = variances_of_parts[part_of_mode_[static_cast<std::size_t>(i)]];
  }
  x.resize(evidence_.rank(), window_.count);
  return evidence_.explained(variances_of_parts, works_.front(), x);
}

PriorScaleValues PriorStrengths::mean() const {
  PriorScaleValues result{};
  for (const Hypothesis& each : hypotheses_) {
    for (std::size_t g = 0; g < result.size(); ++g) result[g] += each.weight * each.scales[g];
  }
  return result;
}

PriorScaleValues PriorStrengths::mean_square() const {
  PriorScaleValues result{};
  for (const Hypothesis& each : hypotheses_) {
    for (std::size_t g = 0; g < result.size(); ++g) {
      result[g] += each.weight * variance(g, each.scales);
    }
  }
  return result;
}

PriorScaleValues PriorStrengths::absent() const {
  PriorScaleValues result{};
  for (const Hypothesis& each : hypotheses_) {
    for (std::size_t g = 0; g < result.size(); ++g) {
      if (each.scales[g] == 0.0) result[g] += each.weight;
    }
  }
  return result;
}

PerPart<bool> PriorStrengths::at_bound() const {
  PerPart<bool> result{};
  for (std::size_t g = 0; estimate_ && g < result.size(); ++g) {
    result[g] = held()[g] >= kLargestStrength;
  }
  return result;
}

}  // namespace brainshift::inversion
