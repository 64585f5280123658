// SPDX-License-Identifier: GPL-3.0-or-later
// ModePosterior: prior modes z and amplitudes c of the common errors, given the data and a set of
// active slaves, by the linear model of that set.
//
//   whitened data   [common | J | d - A G f0]                               rows x (q + r + 1)
//                   = R^-1/2 [common error | A U - A G_A T | d - A G_A f0]
//   objective       J(z) = 1/2 |d - J z - common c|^2 + 1/2 |V^-1/2 c|^2 + 1/2 |x|^2,   z = S x
// with T and f0 of ContactReduction, S the strengths of the prior's parts (0: the part is absent),
// V the common errors' variances under the held hypothesis (SparseData::common_variance),
// everything whitened by SampledOperators. Contact does not touch the common error. Nothing is
// allocated as long as the data fit what was reserved.
#pragma once

#include <cmath>

#include "common/core/error.hpp"
#include "common/core/thread_team.hpp"
#include "common/core/types.hpp"
#include "common/inversion/condensed/sampled_operators.hpp"
#include "common/inversion/skull/contact_reduction.hpp"
#include "common/inversion/strengths/prior_strengths.hpp"
#include "common/linalg/blas.hpp"
#include "common/linalg/growing_matrix.hpp"
#include "common/values/sparse_data.hpp"

namespace brainshift::inversion {

// Does a source of data agree with what the other sources and the prior predict for it?
//
// Unknowns x of a linear model with prior information P0 (diagonal). Source s contributes
// G_s = J^T R^-1 J and b_s = J^T R^-1 d. The others know x to
// (P0 + sum_{t != s} G_t)^-1 = (L L^T)^-1 about their mean m. The score of the source there, in
// units of what the others know,
//   y = L^-1 (b_s - G_s m)      has covariance   S = M + M^2,   M = L^-1 G_s L^-T
// when the model is right. Directions that the source hardly sees are damped instead of cut off:
//   T = y^T (S + d I)^-1 y,   E T = tr A S,   var T = 2 tr (A S)^2,   A = (S + d I)^-1
// T is compared with the scaled chi-square of that mean and variance (Satterthwaite 1946). Only
// what the source can say about x enters, so the many rows that are noise to everyone do not dilute
// the test.
struct Consistency {
  double chi_square = 0.0;          // scaled to degrees_of_freedom
  double degrees_of_freedom = 0.0;  // not an integer
  double p_value = 1.0;             // of a larger chi_square by chance
};

// Keeps its workspace from call to call.
class SourceCheck {
 public:
  // gram, right: of all sources; own_gram, own_right: of the source; lower triangles, without the
  // prior. prior: diagonal of P0, > 0. False when the others' normal equations are not positive
  // definite.
  [[nodiscard]] bool run(const linalg::blas::In<double>& gram, const Eigen::Ref<const VecX>& right,
                         const linalg::blas::In<double>& own_gram,
                         const Eigen::Ref<const VecX>& own_right,
                         const Eigen::Ref<const VecX>& prior, Consistency& out);

 private:
  friend class ModePosterior;
  Eigen::MatrixXd factor_, whitened_, score_covariance_, inverse_;
  VecX mean_, score_;
  // Of ModePosterior::check_source().
  Eigen::MatrixXd own_gram_;
  VecX own_right_, precision_;
};

class ModePosterior {
 public:
  explicit ModePosterior(ModeWindow window);
  void reserve(int data);

  // The linear model of the reduction's set: J, G = J^T J and b = J^T d. same_data: the last call
  // was for the same data and for the set before, so that J follows the reduction's changes.
  void linearise(SampledOperators& sampled, const ContactReduction& reduction, bool same_data,
                 ThreadTeam& team);
  // Standard deviation of common error `k` under an error hypothesis.
  double common_sd(Eigen::Index k, int error) const {
    return common_variance_.cols() > 0 ? std::sqrt(common_variance_(k, error)) : 1.0;
  }
  // Minimises the objective for the held strengths and takes the minimum for the answer.
  // kNotFinite when the normal equations are not positive definite.
  Status minimise(const PriorStrengths& strengths);
  // Of the last minimise().
  const VecX& z() const { return z_; }
  // Q x with step = S x and Q^T Q = H, the objective's second derivative for x with c eliminated:
  // |Q x| is the length of a step of z in posterior standard deviations. Modes of absent parts do
  // not count.
  void whiten(const VecX& step, VecX& out) const;
  // The step of z for its image Q x; 0 for modes of absent parts.
  void unwhiten(const VecX& image, VecX& step) const;
  // Q x of the Newton step -H^-1 gradient.
  void whitened_newton_step(const VecX& gradient, VecX& out) const;

  // Takes for the answer: z, and the amplitudes of the last minimise() and a change of them. The
  // residuals and the misfit below are those of the answer in the linear model.
  void set_answer(const Eigen::Ref<const VecX>& change_of_common, const VecX& z);

  int unknowns() const { return common_ + window_.count; }
  // J^T J of (c, z), lower triangle, without the prior; and J^T d.
  Eigen::Map<const Eigen::MatrixXd> gram() const {
    return {gram_storage_.data(), unknowns(), unknowns()};
  }
  auto right_hand_side() const { return right_.head(unknowns()); }
  auto jacobian() const { return jacobian_.topLeftCorner(rows_, unknowns()); }
  // X = (S^-2 + G)^-1 X, q + r rows; rows of absent parts become 0.
  void solve_normal(Eigen::MatrixXd& x) const;

  // d - A u - common error, whitened, rows.
  auto residual() const { return residual_.head(rows_); }
  // ratio: sqrt(|residual|^2 / n), n = rows - k; k = tr(G Cov(c, z)) of the last minimise() counts
  // the unknowns that the data decide. Where the model holds |residual|^2 has the mean n, so that 1
  // says that the data lie as far off as their standard deviations say. by_chance: the ratio of a
  // chi-square of n degrees of freedom two standard deviations above its mean.
  struct Misfit {
    double ratio = 0.0, by_chance = 1.0;
  };
  Misfit misfit();
  // |d - A u| of one datum, whitened: with what is put down to the common error.
  double misfit(const SampledOperators& sampled, int datum) const;
  // |d - A u - common error| of one datum, whitened.
  double residual_norm(const SampledOperators& sampled, int datum) const;

  // Consistency of the rows of one source with the others (SourceCheck) under the held
  // strengths. Where its p_value is below kInconsistent, p_value is the mean over the hypotheses
  // instead, or the part of that mean that reaches kInconsistent: what contradicts under one
  // hypothesis may well agree under the next. false when it cannot be computed. Threads may check
  // several sources at once, each with a `check` of its own.
  [[nodiscard]] bool check_source(const SampledOperators& sampled, const PriorStrengths& strengths,
                                  const DataSource& source, SourceCheck& check,
                                  Consistency& out) const;

 private:
  Eigen::Map<const Eigen::MatrixXd> factor() const {
    return {factor_storage_.data(), unknowns(), unknowns()};
  }
  void fill_scales(const PriorStrengths& strengths);
  void update_residual();
  void follow_changes(SampledOperators& sampled, const ContactReduction& reduction,
                      ThreadTeam& team);

  ModeWindow window_;
  int common_ = 0;
  Eigen::Index rows_ = 0;
  Eigen::MatrixXd jacobian_, changed_;  // changed_: R^-1/2 A of what changes of the set move
  VecX residual_, gram_storage_, factor_storage_, right_, solution_, z_;
  VecX scales_;  // V^1/2 for c, s for z
  linalg::GrowingMatrix common_variance_;
  mutable VecX full_;
  Eigen::MatrixXd inverse_;
};

}  // namespace brainshift::inversion
