// SPDX-License-Identifier: GPL-3.0-or-later
// ModePosterior: prior modes z and amplitudes c of the common errors, given the data and a set of
// active slaves.
//
//   whitened data   [common | J | d - A G f0]                               rows x (q + r + 1)
//                   = R^-1/2 [common error | A U - A G_A T | d - A G_A f0]
//   posterior mean  (S^-2 + J^T J) (c, z) = J^T d,    S = diag(1 for c, prior scale for z)
// with T and f0 of ContactReduction and everything whitened by SampledOperators. Contact does not
// touch the common error. Nothing is allocated as long as the data fit what was reserved.
#pragma once

#include "common/core/error.hpp"
#include "common/core/thread_team.hpp"
#include "common/inversion/condensed/contact_reduction.hpp"
#include "common/inversion/condensed/prior_scales.hpp"
#include "common/inversion/condensed/sampled_operators.hpp"
#include "common/inversion/condensed/source_check.hpp"
#include "common/values/sparse_data.hpp"

namespace brainshift::inversion {

class ModePosterior {
 public:
  explicit ModePosterior(ModeWindow window);
  void reserve(int data);

  // kNotFinite when the normal equations are not positive definite.
  Status solve(SampledOperators& sampled, const ContactReduction& reduction,
               const PriorScales& scales, ThreadTeam& team);

  const VecX& z() const { return z_; }
  auto common_amplitudes() const { return solution_.head(common_); }
  // J^T J of (c, z), lower triangle, without the prior; and J^T d.
  Eigen::Map<const Eigen::MatrixXd> gram() const {
    return {gram_storage_.data(), unknowns(), unknowns()};
  }
  auto right_hand_side() const { return right_.head(unknowns()); }
  // Lower Cholesky factor of the normal equations. The common error comes first, so that the last r
  // x r block is the factor of the Schur complement of z.
  Eigen::Map<const Eigen::MatrixXd> factor() const {
    return {factor_storage_.data(), unknowns(), unknowns()};
  }
  auto jacobian() const { return jacobian_.topLeftCorner(rows_, unknowns()); }
  // d - A u - common error, whitened, rows.
  auto residual() const { return residual_.head(rows_); }
  // Its root mean square: 1 when the data lie as far off as their standard deviations say.
  double misfit_ratio() const { return misfit_ratio_; }
  // |d - A u| of one datum, whitened: with what is put down to the common error.
  double misfit(const SampledOperators& sampled, int datum) const;
  // |d - A u - common error| of one datum, whitened.
  double residual_norm(const SampledOperators& sampled, int datum) const;

  // Consistency of the rows of one source with the others (source_check.hpp); false when it cannot
  // be computed.
  [[nodiscard]] bool check_source(const SampledOperators& sampled, const PriorScales& scales,
                                  const DataSource& source, Consistency& out);

 private:
  int unknowns() const { return common_ + window_.count; }
  void fill_prior(const PriorScales& scales);

  ModeWindow window_;
  int common_ = 0;
  Eigen::Index rows_ = 0;
  Eigen::MatrixXd jacobian_;
  VecX residual_, gram_storage_, factor_storage_, right_, solution_, z_, prior_;
  double misfit_ratio_ = 0.0;
  SourceCheck check_;
  Eigen::MatrixXd own_gram_;
  VecX own_right_;
};

}  // namespace brainshift::inversion
