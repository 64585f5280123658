// SPDX-License-Identifier: Apache-2.0
// Estimate: the result of one inversion; and Update: an Estimate on its way to the clients.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/statistics.hpp"
#include "common/core/types.hpp"

namespace brainshift {

enum class Boundary {
  kContact,  // slaves may leave the skull and may not penetrate it
  kFixed,    // slaves are fixed in the normal direction, free tangentially
};
enum class Method {
  kCondensed,  // prepared before surgery, prior reduced to its leading modes: the everyday method
  kCondensedExact,  // the same with the whole prior; for comparison
  kPaper,           // adjoint steepest descent with refactorisation (paper section 2.4)
  kPaperWoodbury,  // the same, contact as a low-rank correction of the factor instead of refactorisation
  kConjugateGradients,  // the same minimiser by conjugate gradients in place of steepest descent
  kIterativeSolver,  // conjugate gradients whose solves are preconditioned CG too (the paper's outlook)
};
inline constexpr Method kAllMethods[] = {
    Method::kCondensed,     Method::kCondensedExact,     Method::kPaper,
    Method::kPaperWoodbury, Method::kConjugateGradients, Method::kIterativeSolver};
std::string_view to_string(Boundary boundary);  // "contact", "fixed"
// "condensed", "condensed-exact", "paper", "paper-woodbury", "cg", "pcg"
std::string_view to_string(Method method);

enum class EstimateStatus {
  kNotRun,
  kIterating,       // an intermediate iterate, published for progress
  kConverged,       // the stop rule held
  kIterationLimit,  // best iterate so far; the stop rule did not hold
  kDeadline,        // best iterate when the time ran out
};
std::string_view to_string(EstimateStatus status);  // "not_run", "iterating", ...

// One line of the convergence history (the paper's Fig. 3).
struct IterationRecord {
  int iteration = 0;                // from 1
  MeanStd misfit_mm;                // of |d - A x| over the sparse data (eps_sprs)
  int penetrating = 0;              // slaves with positive penetration
  double max_penetration_mm = 0.0;  // 0 when nothing penetrates
  double elapsed_ms = 0.0;          // since the start of the inversion, monotonic clock
};

// Parts of the force prior: buoyancy along gravity, buoyancy across it, swelling, all other forces.
enum class PriorPart { kAlongGravity, kAcrossGravity, kSwelling, kOther };
inline constexpr int kPriorParts = 4;
using PriorScaleValues = std::array<double, kPriorParts>;

struct ContactSummary {
  int active = 0;       // slaves carrying a contact force
  int penetrating = 0;  // slaves with penetration above the reporting tolerance
  double max_penetration_mm = 0.0;
  int iterations = 0;  // contact iterations (active-set changes)
};

// How the data of one instrument fared in an update.
struct SourceSummary {
  std::string source;                      // Observation::source
  std::uint64_t observation_sequence = 0;  // the observation they were taken from
  double age_s = 0.0;                      // behind the newest observation of the update
  int data = 0;
  int outliers =
      0;  // data whose robust weight fell below one half, and points that their alignment left aside
  // Consistency with the other sources: Mahalanobis distance between what this source says and what the others predict
  // with the prior, squared; its expectation (degrees of freedom) and the probability of a larger one by chance. NaN
  // for a single source and for methods that do not compute it.
  double chi_square = std::numeric_limits<double>::quiet_NaN();
  double degrees_of_freedom = std::numeric_limits<double>::quiet_NaN();
  double p_value = std::numeric_limits<double>::quiet_NaN();
  bool consistent = true;  // p_value is not below kInconsistent
};
// A source that disagrees more than once in a thousand surgeries by chance is said to contradict the others.
inline constexpr double kInconsistent = 1e-3;

struct Estimate {
  EstimateStatus status = EstimateStatus::kNotRun;
  std::string reason;   // one sentence: why it stopped
  Points displacement;  // 3 x n, mm; at every node, moves undeformed to deformed
  // n, mm, or empty when uncertainty was not computed: root mean square over the three components of the
  // standard deviation of a node's displacement.
  VecX sd_mm;
  ContactSummary contact;
  std::vector<NodeIndex> active_slaves;
  VecX contact_force_n;       // one per active slave, >= 0 pushes the brain inwards
  MeanStd initial_misfit_mm;  // of |d|
  MeanStd misfit_mm;          // of |d - A x|
  std::vector<IterationRecord> history;
  // Estimated strength of the prior's parts in units of the case's; condensed method only.
  PriorScaleValues prior_scales{1.0, 1.0, 1.0, 1.0};
  // Volume of an element after over before (det F), the smallest; at 0 and below it is inverted and the estimate there
  // is no deformation of tissue. NaN before it was looked at.
  double min_volume_ratio = std::numeric_limits<double>::quiet_NaN();
  int inverted_elements = 0;
  std::vector<SourceSummary>
      sources;  // in the order of the data; empty for data without named sources
  double rebuild_ms =
      0.0;  // part of the inversion's time spent on field and sd; condensed methods only
};

// Something that the scene did not need, with the reason and an estimate of the error it causes.
struct Omission {
  std::string part;
  std::string reason;
  std::string estimated_error;
};

struct StageTimings {  // milliseconds, monotonic clock
  double register_ms = 0.0;
  double invert_ms = 0.0;
  double rebuild_ms = 0.0;
  double encode_ms = 0.0;
  double journal_ms = 0.0;
};

struct Update {
  std::string case_id;
  std::string model_id;
  std::uint64_t sequence = 0;              // counts up per session, from 1
  std::uint64_t observation_sequence = 0;  // the observation it answers
  Method method = Method::kCondensed;
  Boundary boundary = Boundary::kContact;
  bool final = true;  // false: an intermediate iterate
  Estimate estimate;
  StageTimings timings;
  RigidTransform T_undeformed_deformed = RigidTransform::Identity();  // from ICP; identity without
  std::vector<Omission> left_out;
};

}  // namespace brainshift
