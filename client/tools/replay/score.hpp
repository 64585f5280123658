// SPDX-License-Identifier: GPL-3.0-or-later
// Scores an estimate against the truth of a simulated surgery. No other code reads truth.
//
// With u the estimated and t the true displacement (3 x n, mm) and A_c
// the weights of score points c:
//   initial      |A_cross t|                      cross   |A_cross (u - t)|
//   sparse       |d - A x| of the update itself (against the noisy data); sparse_initial |d|
//   craniotomy   CPPD (paper 2.7, 3.1): |closest-point distance| from the craniotomy nodes moved by
//                u to the boundary surface moved by t; craniotomy_initial: the same with u = 0
//   craniotomy_displacement  |A_craniotomy (u - t)|, which sees sliding too; with _initial
//                |A_craniotomy t|
//   recovery_pct = 100 (1 - mean cross / mean initial); likewise for the craniotomy, from CPPD
//   field_error_pct: percentiles of |u - t| over all nodes, percent of max |t|
//   coverage_90: share of nodal components with |u - t| <= 1.6449 sd, for Gaussian errors 0.90
// Each pair is mean and sample standard deviation over its points.
#pragma once

#include <optional>

#include "client/tools/replay/run_report.hpp"
#include "common/core/error.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/estimate.hpp"

namespace brainshift::client {

// Two-sided 90 % of a standard normal.
inline constexpr double kNormalQuantile90 = 1.6448536269514722;

// kUnreadable when the truth does not fit a mesh of so many nodes:
// another count, a value that is not finite, a score point outside the
// mesh (named by kind and index), weights that do not sum to 1.
Status check_truth(const io::SurgeryTruth& truth, int nodes);

// The truth of one observation, checked; nullopt when the surgery has none (a real recording).
Result<std::optional<io::SurgeryTruth>> read_truth(const io::SurgeryFile& surgery,
                                                   std::uint64_t observation_sequence,
                                                   const BrainModel& model);

// Values at score points: column i is sum_k weight_k * nodal.col(node_k).
Points at_points(const Points& nodal, const std::vector<io::ScorePoint>& points);

// |A_cross (u - t)|; nullopt without cross-validation points.
std::optional<MeanStd> cross_error(const io::SurgeryTruth& truth, const Points& displacement);

// Fills the errors, recoveries, coverage and directions of `run`. kProtocol when the estimate has
// another number of nodes than the truth. Precondition: check_truth accepts the truth.
Status score(const BrainModel& model, const io::SurgeryTruth& truth, const Estimate& estimate,
             RunReport& run);

// Fills what needs no truth: status, sparse misfit, contact, direction of the estimate, strengths
// of the prior.
void describe(const BrainModel& model, const Estimate& estimate, RunReport& run);

// Principal direction of the displacements (paper 3.2.4, principal component
// analysis): the unit vector along which they vary most about their mean, i.e.
// the first eigenvector of their covariance, pointing along the mean. The paper's
// "emanating from the origin" places the vector and does not change it. Zero when
// all displacements are equal, because no direction is distinguished then.
Vec3 principal_direction(const Points& displacements);

// Angle between two non-zero vectors, degrees in [0, 180].
double angle_deg(const Vec3& a, const Vec3& b);

}  // namespace brainshift::client
