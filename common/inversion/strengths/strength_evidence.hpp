// SPDX-License-Identifier: GPL-3.0-or-later
// StrengthEvidence: what the linear model of an update says of the strengths of the prior's parts.
//
// The model: data d = J (c, z) + e whitened, G = J^T J, b = J^T d, common errors c ~ N(0, V_e) with
// V_e = I or that of an error hypothesis e (SparseData::common_variance), modes of part g
// z_g ~ N(0, v_g I) with the part's variance v_g. Then
//
//   ln p(d | v) = -1/2 ln |I + S G S| + 1/2 b^T S (I + S G S)^-1 S b + const,   S^2 = diag(V_e, v)
//
// Cheap because the data say little: a pivoted Cholesky factor G ~ L L^T with few columns (some
// tens), L y = b, makes y ~ N(0, Omega), Omega = I + L_c^T V_e L_c + sum v_g L_g^T L_g, all that
// the data say about v; and of each part W_g W_g^T = L_g^T L_g with few columns suffices.
//
// A *profile* is ln p for every value of kStrengths of one part while the others stay. With K K^T =
// Omega, M = W_g^T Omega^-1 W_g, b = W_g^T Omega^-1 y and N = I - v_g M,
//
//   ln p(t) = ln p(0) + 1/2 ln |N| - 1/2 ln |A| + 1/2 t b^T A^-1 N^-1 b,   A = I + (t - v_g) M
//
// (Woodbury; M, N and A commute.) M is made tridiagonal once, so that every t costs a pass over its
// diagonals. Where one part's variance changes by delta, C = W^T Omega^-1 W of all parts side by
// side becomes C - delta C_g^T (I + delta C_gg)^-1 C_g. Allocates nothing after construction but
// when more columns are needed than ever before.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "common/configuration/case_config.hpp"
#include "common/core/types.hpp"
#include "common/linalg/blas.hpp"
#include "common/linalg/growing_matrix.hpp"
#include "common/values/estimate.hpp"
#include "common/values/sparse_data.hpp"

namespace brainshift::inversion {

// Strengths of a part that are compared, in units of the case's standard deviations.
inline constexpr std::array<double, 8> kStrengths = {0.0, 0.125, 0.25, 0.5,
                                                     1.0, 2.0,   4.0,  kLargestStrength};
// A number for each of them.
using StrengthProfile = std::array<double, kStrengths.size()>;

// Of every part, and which error hypothesis holds.
struct Variances : PerPart<double> {
  Variances(const PerPart<double>& parts, int error_hypothesis = 0)
      : PerPart<double>(parts), error(error_hypothesis) {}
  int error;
};

class StrengthEvidence {
 public:
  // Memory of one thread.
  struct Workspace {
    linalg::GrowingMatrix omega, gram, change, shifted;
    linalg::GrowingVector whitened, projected, changed, start, mean;
    linalg::GrowingVector diagonal, beside, pivots, factor;  // of a tridiagonal matrix
  };
  // W^T Omega^-1 [W y] of one hypothesis.
  enum class Blocks { kOfEachPart, kAll };
  struct Projection {
    // C; of its blocks those on the diagonal, and with kAll those below it. Their lower triangles.
    linalg::GrowingMatrix parts;
    linalg::GrowingVector data;
    linalg::GrowingMatrix whitened_parts;
  };

  // Modes by part, first the common errors of which there may be max_common.
  StrengthEvidence(const PerPart<int>& counts, int max_common);

  // gram: G, lower triangle; right: b; of [common errors | modes]. common_variance: V_e by column,
  // at most 1; without columns there is one hypothesis, I. false when G is not finite.
  [[nodiscard]] bool take(const linalg::blas::In<double>& gram, const Eigen::Ref<const VecX>& right,
                          const Eigen::MatrixXd& common_variance = {});
  // Whether these are what take() was given last.
  bool holds(const linalg::blas::In<double>& gram, const Eigen::Ref<const VecX>& right,
             const Eigen::MatrixXd& common_variance = {}) const;
  void forget() { size_ = 0; }

  // The functions below give false where a matrix is not positive definite or not finite.

  // ln p(d | v) but for a constant that is the same for all v.
  [[nodiscard]] bool log_evidence(const Variances& variances, Workspace& work, double& out) const;
  // blocks: changed_profiles() wants all of them, profiles() a fifth of the work.
  [[nodiscard]] bool project(const Variances& variances, Blocks blocks, Projection& out,
                             Workspace& work) const;
  // Of the hypothesis that was projected. floors: variance that a part has whatever its strength.
  // ln p(t) - ln p(0) for t = strength^2 + floor; parts without modes are left as they are.
  [[nodiscard]] bool profiles(const Projection& projection, const Variances& variances,
                              const PerPart<double>& floors, PerPart<StrengthProfile>& out,
                              Workspace& work) const;
  // The same when the variance of `part`, which has modes, is `variance` instead. Precondition: all
  // blocks were projected.
  [[nodiscard]] bool changed_profiles(const Projection& projection, const Variances& variances,
                                      std::size_t part, double variance,
                                      const PerPart<double>& floors, PerPart<StrengthProfile>& out,
                                      Workspace& work) const;
  // Posterior mean of (c, z).
  [[nodiscard]] bool mean(const Variances& variances, Workspace& work, Eigen::Ref<VecX> out) const;
  // X, rank() x modes, with Cov(z) = S^2 - X^T X.
  [[nodiscard]] bool explained(const Variances& variances, Workspace& work,
                               linalg::blas::Out<double> out) const;

  Eigen::Index size() const { return size_; }      // common errors and modes
  Eigen::Index common() const { return common_; }  // of these, the first ones
  Eigen::Index rank() const { return rank_; }      // columns of L
  // Error hypotheses, at least one.
  int errors() const { return std::max(1, static_cast<int>(common_variance_.cols())); }

 private:
  void factorise(const linalg::blas::In<double>& gram);
  void factorise_parts();
  // Lower factor of Omega; false as above.
  bool fill_omega(const Variances& variances, linalg::GrowingMatrix& omega) const;
  // From M and b in work.gram and work.projected, which it overwrites.
  static bool profile(double variance, double floor, StrengthProfile& out, Workspace& work);

  PerPart<int> first_{}, count_{};  // modes by part
  int modes_ = 0;
  int max_common_;
  Eigen::Index common_ = 0, size_ = 0, rank_ = 0;
  linalg::GrowingMatrix gram_;  // G and b of the last take()
  linalg::GrowingVector right_;
  Eigen::MatrixXd left_;  // L, size x rank
  VecX left_out_, row_;
  linalg::GrowingVector y_;
  linalg::GrowingMatrix common_variance_, scaled_, rest_;
  std::array<linalg::GrowingMatrix, kOutlineErrors.size()> of_common_;  // L_c^T V_e L_c
  PerPart<linalg::GrowingMatrix> of_part_;                              // L_g^T L_g
  Eigen::MatrixXd roots_;  // W, rank x columns, the parts side by side
  PerPart<Eigen::Index> first_root_{}, root_count_{};
  Eigen::Index roots_in_all_ = 0;
  std::vector<Eigen::Index> pivots_;
};

}  // namespace brainshift::inversion
