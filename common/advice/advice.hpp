// SPDX-License-Identifier: GPL-3.0-or-later
// Advice: which measurement would reduce the error at a target the most, after the present update.
//
// The posterior of the update in modes z (inversion::PosteriorModes) and the linear model of a
// measurement,
//   u(x) = V(x) z + left out,   d = B z + C c + e,   c ~ N(0, I),   e ~ N(0, D)
// with B the rows V of the places and directions that the registration stage would make of the
// measurement if the brain lay as estimated, and C its common errors (SparseData). Of a target t,
// with z ~ N(m, Sigma), R = D + C C^T:
//   Sigma_tt        V_t Sigma V_t^T                                        mm^2
//   after           Sigma_tt - Sigma_tm (Sigma_mm + R)^-1 Sigma_mt         mm^2
//                   (Gaussian conditioning; Rasmussen & Williams 2006, eq. 2.24; design by the
//                   posterior's variance: Chaloner & Verdinelli 1995, Stat. Sci. 10:273)
//   sd              sqrt(mean over the target's points of trace(Sigma + left out) / 3), mm per
//                   component, times the misfit ratio where that is above 1, as Estimate::sd_mm
// computed as V_t F (I + W^T W)^-1 F^T V_t^T, W = D^-1/2 [B F | C], the same by Woodbury's
// identity: rank r + q instead of one row per datum.
//
// Contact, the strengths of the prior's parts, robust weights and the misfit ratio are taken as
// they are; a measurement that is made changes them too (docs/advise.md says by how much that
// matters). The measurement comes from a source of its own, beside what is there. A candidate costs
// some milliseconds.
#pragma once

#include <string>
#include <vector>

#include "common/advice/candidates.hpp"
#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/geometry/tet_locator.hpp"
#include "common/inversion/inverter.hpp"
#include "common/pipeline/pipeline.hpp"
#include "common/values/estimate.hpp"
#include "common/values/sparse_data.hpp"

namespace brainshift::advice {

struct Target {
  std::string name;
  Points
      points;  // 3 x t, undeformed, mm RAS; in the brain, or at most kOutsideTolerance_mm outside
};
// At most 100 points of the tumour's boundary, spread by area: always the same ones.
// Precondition: the model has a tumour.
Target tumour_target(const BrainModel& model);

// At points of the undeformed brain.
struct PlaceRows {
  Eigen::MatrixXd modes;     // V, 3 m x r, mm
  VecX left_out_mm2;         // m: variance that the modes leave out
  std::vector<bool> region;  // m: every node that counts is of the data region
};

class Posterior {
 public:
  // locator: of the operators' mesh; must outlive this object.
  Posterior(inversion::PosteriorModes modes, const geometry::TetLocator& locator);

  // kInvalidArgument: a point farther than kOutsideTolerance_mm outside the brain, named.
  Result<PlaceRows> at(const Points& points) const;

  // With misfit ratio 1, mm: now, and after the data. at_data: at data.positions. kNotFinite: an sd
  // of the data is not above 0.
  double sd_mm(const PlaceRows& target) const;
  Result<double> sd_after_mm(const PlaceRows& target, const SparseData& data,
                             const PlaceRows& at_data) const;

 private:
  inversion::PosteriorModes modes_;
  const geometry::TetLocator& locator_;
};

struct Advice {
  Candidate candidate;
  int data = 0;                            // that the registration stage would make of it
  double before_mm = 0.0, after_mm = 0.0;  // sd at the target
  std::string reason;                      // why it cannot be used; empty when it can
  double reduction_mm() const { return before_mm - after_mm; }
};

// Best first; those that cannot be used last. pipeline: after an update with a usable `estimate`.
// kInvalidArgument: a target outside the brain; kNotConverged: the pipeline's method does not say
// what is left unknown.
Result<std::vector<Advice>> rank(const pipeline::Pipeline& pipeline, const CaseConfig& config,
                                 const geometry::TetLocator& locator, const Estimate& estimate,
                                 const std::vector<Candidate>& candidates, const Target& target);

}  // namespace brainshift::advice
