// SPDX-License-Identifier: GPL-3.0-or-later
// CondensedInverter: SparseData -> Estimate in milliseconds; holds what an update can reuse.
//
// For a set A of active slaves, with D = Phi_AA + I / beta (penalty contact, paper eq. 16):
//   contact forces    D f = p_A - N_A^T U z         =>  f = f0 - T z,   [T f0] = D^-1 [N_A^T U  p_A]
//   data              d = A u + e                   =>  A u = J z + A G_A f0,   J = A U - A G_A T
//   posterior of z    (I + J^T R^-1 J) z = J^T R^-1 (d - A G_A f0)
// With a common error of the data (SparseData), its amplitudes c ~ N(0, I) are estimated beside z, J = [common J].
// which is the posterior mean of the paper's penalised system K_p exactly when U U^T = C. Next set: active
// slaves that press (f > 0) and open ones that penetrate, until contact holds (set_search.hpp). A set visited
// before means a cycle: from there on one slave at a time changes, the one of least index (Murty 1974). The best
// iterate, the one with the least violation, is kept; limits on iterations and time end with it.
//
// Contact, prior scales, robust weights (robust_weights.hpp) and the places of moving data settle in turn.
//
// The standard deviation is that of the model above, times the ratio of the misfit to the one expected where that
// is above 1; a ratio above 1.5 is said in the reason.
//
// Not thread-safe. update() allocates nothing as long as the data fit the capacity, but for members of the
// estimate whose size changes.
#pragma once

#include <memory>
#include <stop_token>
#include <vector>

#include "common/values/case_config.hpp"
#include "common/values/condensed_operators.hpp"
#include "common/core/error.hpp"
#include "common/values/estimate.hpp"
#include "common/values/sparse_data.hpp"
#include "common/geometry/tet_locator.hpp"
#include "common/inversion/contract/moving_data.hpp"
#include "common/inversion/condensed/omission_errors.hpp"

namespace brainshift::inversion {

struct CondensedOptions {
  // Parts a scene leaves out (scene::plan_scene decides); what that may cost: omission_errors().
  bool contact = true;
  bool uncertainty = true;
  bool gravity_modes = true;
  // Nodes that are rebuilt, sorted; the others are interpolated (far_field.hpp). Empty: every node.
  std::vector<NodeIndex> region_of_interest;
  int rank = 0;  // use only so many modes; 0: all
  bool warm_start = true;
  int capacity = 1000;  // data per update reserved up front
  int threads = 0;      // 0: as many as cores
  std::stop_token stop;
};

class CondensedInverter {
 public:
  // Keeps references to nothing but what it shares. kInvalidArgument when operators and locator disagree.
  static Result<CondensedInverter> build(std::shared_ptr<const CondensedOperators> operators,
                                         std::shared_ptr<const geometry::TetLocator> locator,
                                         const CaseConfig& config,
                                         const CondensedOptions& options = {});
  CondensedInverter(CondensedInverter&&) noexcept;
  CondensedInverter& operator=(CondensedInverter&&) noexcept;
  ~CondensedInverter();

  // Writes `estimate` in place, reusing its memory; on an error it is left as it was, or, when its rebuilt
  // field is what was wrong, it has the status kNotRun.
  // Errors as check_data; kInvalidArgument for data outside the brain (the sentence names the datum);
  // kNotFinite when the result is not finite; kNotConverged when the field contradicts its contact forces
  // (estimate_check.hpp).
  // moving: data that follow the deformation, measured anew for every estimate; null: they stay.
  Status update(const SparseData& data, Estimate& estimate, const MovingData* moving = nullptr);
  // Forgets the last active set.
  void reset();
  // Of the last update(), for the parts that the options leave out.
  const OmissionErrors& omission_errors() const;

 private:
  struct Impl;
  explicit CondensedInverter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace brainshift::inversion
