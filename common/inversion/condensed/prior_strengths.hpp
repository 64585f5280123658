// SPDX-License-Identifier: GPL-3.0-or-later
// PriorStrengths: how strong each part of the force prior is, estimated from the data of an update.
//
// The case names the loads that may act and their rough strength; which of them do, and how
// strongly, differs from surgery to surgery. Modes of part g are z ~ N(0, s_g^2 I), and s_g is one
// of the values of kStrengths with
//
//   p(s_g = 0) = kAbsent        p(s_g) ~ exp(-ln^2 s_g / (2 kLogStrengthSd^2)) for the others
//
// A *hypothesis* is one strength for every part. For the linear model of one contact set, with G =
// J^T R^-1 J and b = J^T R^-1 d of [common errors | modes], its evidence is
//
//   ln p(d | s) = -1/2 ln |I + S G S| + 1/2 b^T S (I + S G S)^-1 S b + const
//
// A part may have a *floor*: variance that it has besides, whatever its strength, because something
// else acts through it that is never absent (the model's own error, condensed_inverter.hpp). s_g^2
// then stands for s_g^2 + floor_g^2 everywhere below.
//
// The *neighbours* of a hypothesis differ from it in one part, or in two of which one vanishes or
// enters: two families may explain the same data. fit() finds a hypothesis that is more probable
// than its neighbours by coordinate ascent, best part first, from s = 0 and from s = 1, and takes
// in the neighbours that have weight. Their weights are p(d | s) p(s), normalised (spike and slab:
// Mitchell & Beauchamp 1988, JASA 83:1023; averaging: Hoeting et al. 1999, Stat. Sci. 14:382).
// Estimate and covariance are those of the mixture:
//
//   z = sum w_h m_h        Cov = sum w_h (C_h + (m_h - z)(m_h - z)^T)
//
// The result depends on G and b alone, not on earlier updates.
//
// Cheap because the data say little: a pivoted Cholesky factor G ~ L L^T with few columns (some
// tens), L y = b, makes y ~ N(0, I + sum s_g^2 L_g^T L_g) all that the data say about s.
// Allocates nothing after construction but when more columns are needed than ever before.
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"
#include "common/inversion/skull/mode_window.hpp"
#include "common/linalg/blas.hpp"
#include "common/linalg/growing_matrix.hpp"
#include "common/values/case_config.hpp"
#include "common/values/estimate.hpp"

namespace brainshift::inversion {

// In units of the case's standard deviations.
inline constexpr std::array<double, 8> kStrengths = {0.0, 0.125, 0.25, 0.5,
                                                     1.0, 2.0,   4.0,  kLargestStrength};
inline constexpr double kAbsent = 0.5;
// ln 3: the case's strengths are right to a factor of 9 (two standard deviations).
inline constexpr double kLogStrengthSd = 1.0986122886681098;

// Of ln p.
inline constexpr double kWorthwhile = 1.0;

class PriorStrengths {
 public:
  // columns: of the operators, by part. estimate: false keeps every strength at 1.
  PriorStrengths(const PerPart<int>& columns, ModeWindow window, int max_common, bool estimate);

  // gram: G, lower triangle; right: b; the common errors come first. kNotFinite when G is not
  // positive semidefinite or not finite.
  Status fit(const linalg::blas::In<double>& gram, const Eigen::Ref<const VecX>& right);
  // The same for another linear model of the same data. The held hypothesis stays while no
  // neighbour is more probable by kWorthwhile: the data hardly tell such two apart, and a search
  // would wander between them. It stays in any case without may_change, for loads that are
  // its own and that nobody will descend from again. Whether it did not stay.
  Result<bool> refit(const linalg::blas::In<double>& gram, const Eigen::Ref<const VecX>& right,
                     bool may_change);
  // Every strength as in the case, before the first fit(), and no floor.
  void reset();
  // In units of the case's standard deviation. Without effect where strengths are not estimated.
  void set_floor(PriorPart part, double floor) {
    if (estimate_) floor_[static_cast<std::size_t>(part)] = floor;
  }

  // The held one first; the weights of the others fall. They sum to 1.
  const std::vector<Hypothesis>& hypotheses() const { return hypotheses_; }
  // Of the hypothesis that a descent is for: a most probable one.
  const PriorScaleValues& held() const { return hypotheses_.front().scales; }
  // Of mode `mode` of the window under the held hypothesis, with its part's floor.
  double scale_of(int mode) const { return scale_of(mode, held()); }
  // The same under other strengths.
  double scale_of(int mode, const PriorScaleValues& scales) const {
    return std::sqrt(variance(part_of_mode_[static_cast<std::size_t>(mode)], scales));
  }
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

 private:
  // ln p for every value of kStrengths of a part when the others are as in `scales`, up to a
  // constant for each part; for every part that the window has.
  using Profile = std::array<double, kStrengths.size()>;
  bool profiles(const PriorScaleValues& scales, PerPart<Profile>& out);
  double variance(std::size_t part, const PriorScaleValues& scales) const {
    return scales[part] * scales[part] + floor_[part] * floor_[part];
  }
  bool compress(const linalg::blas::In<double>& gram, const Eigen::Ref<const VecX>& right);
  // Whether candidates_ are those of the held hypothesis for this linear model.
  bool weighed_for(const linalg::blas::In<double>& gram, const Eigen::Ref<const VecX>& right) const;
  // Omega = I + sum s_g^2 L_g^T L_g, common errors included.
  void fill_omega(const PriorScaleValues& scales);
  PriorScaleValues as_in_the_case() const;
  bool ascend(PriorScaleValues& scales);  // to the next maximum over one part at a time
  double log_posterior(const PriorScaleValues& scales);
  bool search(PriorScaleValues& best);
  bool weigh(const PriorScaleValues& best);
  // candidates_: those that differ from `from`, whose profiles are given, in one part. Their
  // weights are ln p, `log_weight` that of `from`.
  void gather_neighbours(const PerPart<Profile>& log_p, const PriorScaleValues& from,
                         double log_weight);
  bool take_neighbours(const PriorScaleValues& best);
  // Of ln p, from the held hypothesis to the most probable neighbour; they have been weighed.
  double gain() const { return candidates_.empty() ? 0.0 : candidates_.front().weight; }
  // From the held hypothesis to one that is more probable than its neighbours.
  bool climb();

  ModeWindow window_;
  bool estimate_;
  int max_common_;
  std::vector<std::size_t> part_of_mode_;  // of the window
  PerPart<int> first_ = {}, count_ = {};   // columns of the window, by part
  std::vector<Hypothesis> hypotheses_, candidates_;
  PriorScaleValues floor_{};
  Profile log_prior_{};
  PerPart<Profile> profiles_{}, changed_profiles_{};

  Eigen::Index common_ = 0, size_ = 0, rank_ = 0;  // q, q + r, columns of L
  linalg::GrowingMatrix gram_;                     // G and b of the last compress()
  linalg::GrowingVector right_;
  Eigen::MatrixXd left_;  // L, (q + r) x rank
  VecX residual_diagonal_, row_;
  linalg::GrowingVector y_;
  PerPart<linalg::GrowingMatrix> of_part_;  // L_g^T L_g
  linalg::GrowingMatrix means_;             // (c, z) by hypothesis, then their mean
  linalg::GrowingMatrix of_common_, omega_, solved_, small_, scratch_;
  Eigen::MatrixXd covariance_;
  linalg::GrowingVector whitened_, projected_, mean_of_;
  std::vector<Eigen::Index> pivots_;
};

}  // namespace brainshift::inversion
