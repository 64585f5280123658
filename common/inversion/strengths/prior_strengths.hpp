// SPDX-License-Identifier: GPL-3.0-or-later
// PriorStrengths: how strong each part of the force prior is, estimated from the data of an update.
//
// The case names the loads that may act and their rough strength; which of them do, and how
// strongly, differs from surgery to surgery. Modes of part g are z ~ N(0, s_g^2 I), and s_g is one
// of the values of kStrengths with
//
//   p(s_g = 0) = kAbsent        p(s_g) ~ exp(-ln^2 s_g / (2 kLogStrengthSd^2)) for the others
//
// How large the errors are that neighbours on an outline share, and over which length, is not known
// either: e is one of kOutlineErrors, with p(e) of kNoOutlineError for none and alike for the
// others.
//
// A *hypothesis* is one strength for every part, and e. Its marginal likelihood p(d | s, e) is that
// of the linear model of one contact set (strength_evidence.hpp).
//
// A part may have a *floor*: variance that it has besides, whatever its strength, because something
// else acts through it that is never absent (the model's own error, condensed_inverter.hpp). s_g^2
// then stands for s_g^2 + floor_g^2 everywhere below.
//
// The *neighbours* of a hypothesis differ from it in one part, or in two of which one vanishes or
// enters: two families may explain the same data. Or they differ in e, and in one part or none: a
// swelling that is not there explains an outline that is off. fit() finds a hypothesis that is more
// probable than its neighbours by coordinate ascent, best part first, from s = 0 without errors of
// the outline and from s = 1 with the largest, and takes in the neighbours that have weight.
// Their weights are p(d | s) p(s), normalised (spike and slab: Mitchell & Beauchamp 1988, JASA
// 83:1023; averaging: Hoeting et al. 1999, Stat. Sci. 14:382). Estimate and covariance are those of
// the mixture:
//
//   z = sum w_h m_h        Cov = sum w_h (C_h + (m_h - z)(m_h - z)^T)
//
// What the data cannot see keeps its prior. Data near the tumour say that a part is absent *there*,
// and would switch it off everywhere; two things stand against that. No data choose the strength of
// the far part (PriorPart::kFar): it is the root mean square of the prior above without s_g = 0,
// 2.4, or that of the medium and coarse fields where it is greater. And the *broad hypothesis*,
// that every part is as strong as that, or as the held one has it where that is more, has a weight
// of its own that no data change (PriorConfig::broad_weight); it comes last.
//
// The result depends on G and b alone, not on earlier updates. Neighbours are weighed by all
// threads of the team, each by one of them. Allocates nothing after construction but when more
// columns are needed than ever before.
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/core/thread_team.hpp"
#include "common/core/types.hpp"
#include "common/inversion/skull/mode_window.hpp"
#include "common/inversion/strengths/strength_evidence.hpp"
#include "common/linalg/blas.hpp"
#include "common/linalg/growing_matrix.hpp"
#include "common/values/estimate.hpp"

namespace brainshift::inversion {

inline constexpr double kAbsent = 0.5;
inline constexpr double kNoOutlineError = 0.25;
// ln 3: the case's strengths are right to a factor of 9 (two standard deviations).
inline constexpr double kLogStrengthSd = 1.0986122886681098;

// Of ln p.
inline constexpr double kWorthwhile = 1.0;

class PriorStrengths {
 public:
  using GiveUp = std::function<bool()>;

  // columns: of the operators, by part. estimate: false keeps every strength at 1. Keeps a
  // reference to the team, which shares the work.
  PriorStrengths(const PerPart<int>& columns, ModeWindow window, int max_common, bool estimate,
                 double broad_weight, ThreadTeam& team);

  // gram: G, lower triangle; right: b; the common errors come first, with their variances
  // (SparseData::common_variance). kNotFinite when G is not positive semidefinite or not finite.
  // give_up: asked before every step of a search, by any thread of the team; where it says so the
  // search ends where it is, and the neighbours of that hypothesis are weighed.
  Status fit(const linalg::blas::In<double>& gram, const Eigen::Ref<const VecX>& right,
             const Eigen::MatrixXd& common_variance = {}, const GiveUp& give_up = {});
  // The same for another linear model of the same data. The held hypothesis stays while no
  // neighbour is more probable by kWorthwhile: the data hardly tell such two apart, and a search
  // would wander between them. It stays in any case without may_change, for loads that are
  // its own and that nobody will descend from again. Whether it did not stay.
  Result<bool> refit(const linalg::blas::In<double>& gram, const Eigen::Ref<const VecX>& right,
                     bool may_change, const Eigen::MatrixXd& common_variance = {},
                     const GiveUp& give_up = {});
  // Every strength as in the case, before the first fit(), and no floor.
  void reset();
  // In units of the case's standard deviation. Without effect where strengths are not estimated.
  void set_floor(PriorPart part, double floor) {
    if (estimate_) floor_[static_cast<std::size_t>(part)] = floor;
  }

  double floor(PriorPart part) const { return floor_[static_cast<std::size_t>(part)]; }

  // The held one first; the weights of the others fall, but for the broad one, which is the last.
  // They sum to 1.
  const std::vector<Hypothesis>& hypotheses() const { return hypotheses_; }
  // Of the hypothesis that a descent is for: a most probable one.
  const PriorScaleValues& held() const { return hypotheses_.front().scales; }
  int held_error() const { return hypotheses_.front().error; }
  // Of mode `mode` of the window under the held hypothesis, with its part's floor.
  double scale_of(int mode) const { return scale_of(mode, held()); }
  // The same under other strengths.
  double scale_of(int mode, const PriorScaleValues& scales) const {
    return std::sqrt(variance(part_of_mode_[static_cast<std::size_t>(mode)], scales));
  }
  // Modes of a part in the window.
  struct Modes {
    int first = 0, count = 0;
  };
  Modes modes_of(PriorPart part) const;
  // Mean of s_g, and of s_g^2 with the floor, over the hypotheses; probability of s_g = 0.
  PriorScaleValues mean() const;
  PriorScaleValues mean_square() const;
  PriorScaleValues absent() const;
  PerPart<bool> at_bound() const;  // of the held hypothesis

  // Mean of (c, z) over the hypotheses for the linear model of the last fit, less that of the held
  // one. false when it cannot be computed.
  [[nodiscard]] bool mean_shift(Eigen::Ref<VecX> out);
  // Lower Cholesky factor F of the covariance of z, F F^T, r x r. Precondition: mean_shift() for
  // the same linear model. false when it cannot be computed.
  [[nodiscard]] bool covariance(linalg::blas::Out<double> factor);
  // Of the broad hypothesis: X, whose Cov(z) = S^2 - X^T X, and S^2. What the data take off the
  // prior where nothing else is known. Precondition: as covariance(). False as there.
  [[nodiscard]] bool explained_broadly(linalg::GrowingMatrix& x, VecX& variances);

 private:
  using Workspace = StrengthEvidence::Workspace;
  using Projection = StrengthEvidence::Projection;
  // ln p for every strength of a part when the others are as in `scales`, up to a constant for each
  // part; of the parts that the window has.
  using Profiles = PerPart<StrengthProfile>;
  void add_prior(Profiles& log_p) const;
  bool log_posterior(const Hypothesis& hypothesis, Workspace& work, double& out) const;
  double variance(std::size_t part, const PriorScaleValues& scales) const {
    return scales[part] * scales[part] + floor_[part] * floor_[part];
  }
  Variances variances(const Hypothesis& hypothesis) const;
  double log_prior_of_error(int error) const;
  PriorScaleValues as_in_the_case() const;
  // Whether the data choose the strength of a part.
  bool searched(std::size_t part) const {
    return count_[part] > 0 && part != static_cast<std::size_t>(PriorPart::kFar);
  }
  // What the data do not see, once they have said how strong the held hypothesis is.
  Hypothesis broad() const;
  // The far part is as strong as the near fields that it goes on from, and not weaker than the
  // case.
  void set_far(PriorScaleValues& scales) const;
  // The start of a search: none of the parts that the data choose.
  PriorScaleValues absent_parts() const;
  PerPart<double> floors() const;
  // To the next maximum over one part at a time.
  bool ascend(Hypothesis& hypothesis, Projection& projection, Workspace& work,
              const GiveUp& give_up) const;
  // To the most probable error for these strengths.
  bool ascend_error(Hypothesis& hypothesis, Workspace& work) const;
  bool search(Hypothesis& best, const GiveUp& give_up);
  bool weigh(const Hypothesis& best);
  // The held hypothesis alone, where rounding leaves no profile: an update is worth more than the
  // weights of its neighbours.
  void keep_held();
  // candidates_: those that differ from `from`, whose profiles are given, in one part. Their
  // weights are ln p, `log_weight` that of `from`.
  void gather_neighbours(const Profiles& log_p, const Hypothesis& from, double log_weight);
  // Those of the hypothesis whose profiles_ are given.
  bool gather_candidates(const Hypothesis& best);
  // Of them, those that differ in the error.
  bool gather_other_errors(const Hypothesis& best);
  void weigh_candidates(const Hypothesis& best);
  // Of ln p, from the held hypothesis to the most probable neighbour; they have been weighed.
  double gain() const { return candidates_.empty() ? 0.0 : candidates_.front().weight; }
  // From the held hypothesis to one that is more probable than its neighbours.
  bool climb(const GiveUp& give_up);

  // work_on(index, hypothesis, workspace) for each of them, shared by the team; false when any is.
  template <typename Work>
  bool for_each_hypothesis(Work&& work_on);

  ModeWindow window_;
  bool estimate_;
  double broad_weight_;
  ThreadTeam* team_;
  std::vector<std::size_t> part_of_mode_;  // of the window
  PerPart<int> count_ = {};                // modes of the window, by part
  StrengthEvidence evidence_;
  std::vector<Workspace> works_;  // by member of the team
  std::vector<Projection> projections_;
  std::vector<Hypothesis> hypotheses_, candidates_;
  PriorScaleValues floor_{};
  StrengthProfile log_prior_{};
  Profiles profiles_{};
  PerPart<Profiles> changed_profiles_{};                          // with that part changed
  std::array<Profiles, kOutlineErrors.size()> error_profiles_{};  // with that error
  std::array<double, kOutlineErrors.size()> error_log_p_{};

  linalg::GrowingMatrix means_;      // (c, z) by hypothesis, then their mean
  linalg::GrowingMatrix explained_;  // of every hypothesis, one below the other
  linalg::GrowingMatrix apart_;      // the means' distances from their mean, a row for each
  std::vector<char> done_;           // of every hypothesis
};

}  // namespace brainshift::inversion
