// SPDX-License-Identifier: GPL-3.0-or-later
// CondensedInverter: SparseData -> Estimate in milliseconds; holds what an update can reuse.
//
// For a set A of active slaves, with D = Phi_AA + I / beta (penalty contact, paper eq. 16):
//   contact forces   D f = p_A - N_A^T U z    =>  f = f0 - T z,   [T f0] = D^-1 [N_A^T U  p_A]
//   data             d = A u + e              =>  A u = J z + A G_A f0,   J = A U - A G_A T
//   posterior of z   (I + J^T R^-1 J) z = J^T R^-1 (d - A G_A f0)
// This is the posterior mean of the paper's penalised system K_p exactly when U U^T = C. With a
// common error of the data (SparseData) its amplitudes c ~ N(0, I) are estimated beside z, J =
// [common J].
//
// Next set: active slaves that press (f > 0) and open ones that penetrate, until contact holds
// (contact/set_search.hpp). A set that comes back means a cycle: z is estimated anew for every set,
// and the sets call for one another. From there on the next set is the one that a mean z of the
// sets of the cycle calls for. The set of least violation is kept; the limits on iterations and
// time end with it.
//
// Contact, prior scales, robust weights (robust_weights.hpp) and the places of moving data settle
// in turn.
//
// The standard deviation is that of the model above, times the ratio of the misfit to the one
// expected where that is above 1. The reason names a ratio above 1.5.
//
// Reproducible: the same updates from reset() on give the same bits for one build, type of machine
// and BLAS kernel. Another region of interest moves a node that is rebuilt either way by less than
// 1e-9 mm. Another BLAS kernel rounds z otherwise, and the field is a sum in single precision: some
// 1e-7 of its largest terms, and up to the tolerance of the contact search where a slave at its
// edge flips.
//
// Not thread-safe. update() allocates nothing as long as the data fit the capacity, but for members
// of the estimate whose size changes.
#pragma once

#include <memory>
#include <vector>

#include "common/core/error.hpp"
#include "common/geometry/tet_locator.hpp"
#include "common/inversion/contract/inversion_options.hpp"
#include "common/inversion/contract/omission_errors.hpp"
#include "common/values/case_config.hpp"
#include "common/values/condensed_operators.hpp"
#include "common/values/estimate.hpp"
#include "common/values/sparse_data.hpp"

namespace brainshift::inversion {

struct CondensedOptions {
  // Parts that a scene may leave out (server/pipeline/scene_plan.hpp decides); omission_errors()
  // estimates the price.
  bool contact = true;
  bool uncertainty = true;
  bool gravity_modes = true;
  // Nodes that are rebuilt, sorted; the others are interpolated (far_field.hpp). Empty: every node.
  std::vector<NodeIndex> region_of_interest;
  int rank = 0;  // use only so many modes; 0: all
  bool warm_start = true;
  int capacity = 1000;  // data per update reserved up front
  int threads = 0;      // 0: as many as cores
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
  // but for status kNotRun when the rebuilt field is what is wrong; the next update then starts
  // cold, unless the data themselves were rejected. asked.moving: data that follow the deformation.
  // asked.stop: looked at before every contact set; the deadline of the case is something else: it
  // ends with the best iterate and status kDeadline. Errors: as check_data; kInvalidArgument for
  // data outside the brain (the sentence names the datum); stopped(); kNotFinite when the result is
  // not finite; kNotConverged when the field contradicts its contact forces (estimate_check.hpp).
  Status update(const SparseData& data, Estimate& estimate, const InversionOptions& asked = {});
  // Forgets the last active set and the prior scales.
  void reset();
  // Of the last update(), for the parts that the options leave out.
  const OmissionErrors& omission_errors() const;

 private:
  struct Impl;
  explicit CondensedInverter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace brainshift::inversion
