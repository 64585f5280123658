// SPDX-License-Identifier: GPL-3.0-or-later
// CondensedInverter: SparseData -> Estimate in some tens of milliseconds.
//
// The data d = A u(z) + e, with u(z) the displacement under loads z ~ N(0, S^2) and contact, and S
// the strengths of the prior's parts. Four things settle in turn:
//
//   loads       the most probable z with contact (load_descent.hpp)
//   strengths   hypotheses about S, from the data (prior_strengths.hpp)
//   weights     of single data that chance does not explain (robust_weights.hpp)
//   places      of data that follow the deformation (InversionOptions::moving)
//
// roughly at first, the loads to the end when the others are settled (settled_loads.hpp). Where no
// slave changes, the estimate is the posterior mean of the paper's penalised system K_p exactly
// when U U^T = C. With a common error of the data (SparseData) its amplitudes c ~ N(0, I) are
// estimated beside z.
//
// The model's own error: the patient's tissue is stiffer here and softer there than the case says,
// so that its displacement differs from the model's by a part of itself (kModelError; decision
// 0018). The medium residual field has that much variance besides its strength.
//
// An estimate depends on its data alone, not on earlier updates.
//
// The standard deviation is that of the model above, times the ratio of the misfit to the one
// expected where that is above what chance explains. The reason names a ratio above 1.5.
//
// Reproducible: the same data give the same bits for one build, type of machine and BLAS kernel.
// Another region of interest moves a node that is rebuilt either way by less than 1e-9 mm. Another
// BLAS kernel rounds z otherwise, and the field is a sum in single precision: some 1e-7 of its
// largest terms, and up to kDecrement where a slave at its edge flips.
//
// Not thread-safe. update() allocates nothing for up to 1,000 data, but for members of the estimate
// whose size changes.
#pragma once

#include <memory>
#include <vector>

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/geometry/tet_locator.hpp"
#include "common/inversion/condensed/update_profile.hpp"
#include "common/inversion/contract/inversion_options.hpp"
#include "common/operators/condensed_operators.hpp"
#include "common/values/estimate.hpp"
#include "common/values/sparse_data.hpp"

namespace brainshift::inversion {

struct CondensedOptions {
  // Parts that a scene may leave out (common/pipeline/scene.hpp decides); omission_errors()
  // estimates the price.
  bool contact = true, uncertainty = true, gravity_modes = true;
  // Nodes that are rebuilt, sorted; the others are interpolated (FarField). Empty: every node.
  std::vector<NodeIndex> region_of_interest;
  int rank = 0;     // use only so many modes; 0: all
  int threads = 0;  // 0: as many as cores
};

// What is left unknown of the loads after an update: modes z with covariance F F^T, and with them
//   Cov(u) = V F F^T V^T + left out,   V = U - G_A T
// given the active set A. A copy: it stays as it is when the inverter goes on.
struct PosteriorModes {
  std::shared_ptr<const CondensedOperators> operators;
  int first_mode = 0;        // column of U that z[0] belongs to
  Eigen::MatrixXd factor;    // F, r x r, lower
  std::vector<int> active;   // A, slaves
  Eigen::MatrixXd contact;   // T, k x r, N
  Eigen::VectorXd left_out;  // kRemainders factors of truncated_variance_mm2
};

class CondensedInverter {
 public:
  // Keeps references to nothing but what it shares. kInvalidArgument when operators and locator
  // disagree.
  static Result<CondensedInverter> build(std::shared_ptr<const CondensedOperators> operators,
                                         std::shared_ptr<const geometry::TetLocator> locator,
                                         const CaseConfig& config,
                                         const CondensedOptions& options = {});
  CondensedInverter(CondensedInverter&&) noexcept;
  CondensedInverter& operator=(CondensedInverter&&) noexcept;
  ~CondensedInverter();

  // Writes every member of `estimate` in place, reusing its memory. An error leaves it as it was,
  // but for status kNotRun when the rebuilt field is what is wrong. asked.moving: data that follow
  // the deformation. asked.stop: looked at before every step and every set of contact; the deadline
  // of the case is something else: it ends with the best iterate and status kDeadline. Errors: as
  // check_data; kInvalidArgument for data outside the brain (the sentence names the datum);
  // stopped(); kNotFinite when the result is not finite; kNotConverged when the field contradicts
  // its contact forces (estimate_check.hpp).
  Status update(const SparseData& data, Estimate& estimate, const InversionOptions& asked = {});
  // Of the last update(), for the parts that the options leave out.
  const OmissionErrors& omission_errors() const;
  // Of the last update(): of every datum, in (0, 1], by which its variance was divided
  // (robust_weights.hpp).
  VecX weights() const;
  // Of the last update().
  const UpdateProfile& profile() const;
  PosteriorModes posterior() const;

 private:
  struct Impl;
  explicit CondensedInverter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace brainshift::inversion
