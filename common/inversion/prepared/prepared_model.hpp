// SPDX-License-Identifier: GPL-3.0-or-later
// PreparedModel: forward model, factorised, and prior of a patient: all that the methods which
// solve with the factor need and that does not depend on what is measured during surgery. Built
// once per boundary condition (contact or fixed); inversions only read it. The condensed method
// prepares more, from it: condense.hpp.
//
// Not thread-safe: solves share the factor's workspace. One PreparedModel serves one thread at a
// time.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/configuration/case_config.hpp"
#include "common/contact/forward_model.hpp"
#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/geometry/tet_locator.hpp"
#include "common/prior/force_prior.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/estimate.hpp"

namespace brainshift::inversion {

struct PrepareTimings {
  double assemble_s = 0.0, analyse_s = 0.0, factor_s = 0.0;
  double prior_s = 0.0;  // beside the factorisation; 0 for a prior that was given
  double total_s = 0.0;
  std::uint64_t factor_nonzeros = 0;  // of L
  std::uint64_t bytes = 0;            // memory of factor, matrix and prior
};

class PreparedModel {
 public:
  // kFloatingBody, kSingularMatrix, kEmptySet or kNotFinite names the cause. prior: of the same
  // model and case, under another boundary (it does not depend on that); else it is made, while
  // the stiffness matrix is factorised. ranks: processes that do the same and share the factor;
  // kInvalidArgument when they are more than the mesh can be cut into.
  static Result<PreparedModel> prepare(std::shared_ptr<const BrainModel> model,
                                       const CaseConfig& config, Boundary boundary,
                                       const Progress& progress = {},
                                       std::shared_ptr<const prior::ForcePrior> prior = nullptr,
                                       Ranks* ranks = nullptr);

  // The same from a forward model and a prior that were made elsewhere.
  static PreparedModel of(std::shared_ptr<const BrainModel> model, const CaseConfig& config,
                          contact::ForwardModel forward,
                          std::shared_ptr<const prior::ForcePrior> prior);

  const BrainModel& model() const { return *model_; }
  const CaseConfig& config() const { return config_; }
  Boundary boundary() const { return forward_.boundary(); }
  const PrepareTimings& timings() const { return timings_; }
  const contact::ForwardModel& forward() const { return forward_; }
  const prior::ForcePrior& prior() const { return *prior_; }
  std::shared_ptr<const prior::ForcePrior> shared_prior() const { return prior_; }
  const geometry::TetLocator& locator() const { return locator_; }
  Ranks* ranks() const { return ranks_; }  // nullptr: this process alone

 private:
  PreparedModel(std::shared_ptr<const BrainModel> model, CaseConfig config,
                contact::ForwardModel forward, std::shared_ptr<const prior::ForcePrior> prior);
  std::shared_ptr<const BrainModel> model_;
  CaseConfig config_;
  contact::ForwardModel forward_;
  std::shared_ptr<const prior::ForcePrior> prior_;
  geometry::TetLocator locator_;
  PrepareTimings timings_;
  Ranks* ranks_ = nullptr;
};

// The case's prior with the standard deviations of its parts multiplied by `scales`.
prior::ForcePrior scaled_prior(const PreparedModel& model, const PriorScaleValues& scales);

// The data region: the nodes near the places where data are measured. Condensed operators are
// prepared for them. (A scene's region of interest is something else: the nodes where an answer is
// wanted.)
inline constexpr double kRegionMargin_mm = 8.0;

// Nodes within the margin of the tumour surface or of a craniotomy node, and the nodes of the
// tetrahedra that the tumour surface passes through (at its vertices and the centres of its
// triangles); sorted.
std::vector<NodeIndex> data_region(const BrainModel& model);

}  // namespace brainshift::inversion
