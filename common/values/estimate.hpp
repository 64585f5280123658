// SPDX-License-Identifier: Apache-2.0
// Estimate: the result of one inversion; and Update: an Estimate on its way to the clients.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/statistics.hpp"
#include "common/core/types.hpp"
#include "common/values/quality.hpp"

namespace brainshift {

// Boundary condition at the slaves.
enum class Boundary {
  kContact,  // slaves may leave the skull and may not penetrate it
  kFixed,    // slaves are fixed in the normal direction, free tangentially
};
enum class Method {
  // Prepared before surgery, prior reduced to its leading modes: the everyday method.
  kCondensed,
  // Adjoint steepest descent, K_p refactorised for every contact set (paper section 2.4).
  kPaper,
  // The same, with contact as a low-rank correction of the factor of K instead.
  kPaperWoodbury,
  // Conjugate gradients in place of steepest descent, and linear solves by preconditioned conjugate
  // gradients too (the paper's outlook).
  kIterativeSolver,
};
inline constexpr Method kAllMethods[] = {Method::kCondensed, Method::kPaper, Method::kPaperWoodbury,
                                         Method::kIterativeSolver};
std::string_view to_string(Boundary boundary);  // "contact", "fixed"
// "condensed", "paper", "paper-woodbury", "pcg"
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
  int penetrating = 0;              // slaves, counted as in ContactSummary
  double max_penetration_mm = 0.0;  // 0 when nothing penetrates
  double elapsed_ms = 0.0;          // since the start of the inversion, monotonic clock
};

// Parts of the force prior: families of loads, each with a strength of its own (prior/).
enum class PriorPart {
  kAlongGravity,   // buoyancy along gravity: drainage
  kAcrossGravity,  // buoyancy across it: pose
  kGravitySides,   // buoyancy along it that differs between left and right: air on one side
  kGravityEnds,    // the same between front and back
  kTumourVolume,   // swelling or shrinking of tissue about the tumour
  kBrainVolume,    // the same of the whole brain and of its halves
  kResection,      // removed tissue: its weight, and the stress that it carried
  kOpening,        // pull and pressure at the craniotomy
  kVentricles,     // pressure on the wall of the ventricles
  kTract,          // instruments on the way from there to the tumour
  kFine,           // smooth residual field, shortest correlation length
  kMedium,
  kCoarse,  // longest
  kFar,     // what of the medium and coarse fields lies far from where data come from
};
inline constexpr int kPriorParts = static_cast<int>(PriorPart::kFar) + 1;
// "along_gravity", "across_gravity", "gravity_sides", "gravity_ends", "tumour_volume",
// "brain_volume", "resection", "opening", "ventricles", "tract", "fine", "medium", "coarse", "far"
std::string_view to_string(PriorPart part);
// One value for each part, in units of the case's standard deviations.
template <typename T>
using PerPart = std::array<T, kPriorParts>;  // in the order of PriorPart
using PriorScaleValues = PerPart<double>;
// The residual fields, one for each correlation length and the far one: the last parts.
inline constexpr int kRemainders = 4;
inline constexpr int kLoadParts = kPriorParts - kRemainders;
inline constexpr PriorScaleValues kAsInTheCase = [] {
  PriorScaleValues ones{};
  for (double& scale : ones) scale = 1.0;
  return ones;
}();

// One set of strengths, and how probable the data make it.
struct Hypothesis {
  PriorScaleValues scales = kAsInTheCase;  // 0: the part is absent
  double weight = 1.0;                     // of all hypotheses of an estimate: sum 1
  // Of the outline's errors (kOutlineErrors, sparse_data.hpp). Not on the wire.
  int error = 0;
};

struct ContactSummary {
  int active = 0;  // slaves that carry a contact force
  // Slaves with more than 0.01 mm of penetration (inversion::kPenetrationTolerance_mm).
  int penetrating = 0;
  double max_penetration_mm = 0.0;  // 0 when nothing penetrates
  // What was counted depends on the method.
  //   descent methods (paper, paper-woodbury, pcg): how often the active set changed to
  //     another set that is not empty (PenalisedSystem::changes)
  //   condensed: trial loads for which contact was solved, and the answer, i.e. the length of
  //     Estimate::history. At least 1, also without contact.
  int iterations = 0;
  // Certificate of contact; NaN: not computed. decrement: how far the loads are from the most
  // probable ones, in posterior standard deviations. max_violation_mm: the greatest depth of an
  // open slave. Both of method condensed.
  double decrement = std::numeric_limits<double>::quiet_NaN();
  double max_violation_mm = std::numeric_limits<double>::quiet_NaN();
};

// How the data of one instrument fared in an update.
struct SourceSummary {
  std::string source;                      // Observation::source
  std::uint64_t observation_sequence = 0;  // the observation they were taken from
  double age_s = 0.0;                      // behind the newest observation of the update
  int data = 0;
  // Data whose robust weight fell below one half, plus points that their alignment left out.
  int outliers = 0;
  // Consistency with the other sources. chi_square: squared Mahalanobis distance between the data
  // of this source and what the other sources and the prior predict for them. degrees_of_freedom:
  // its expectation. p_value: probability of a larger chi_square by chance; where that is below
  // kInconsistent under the most probable hypothesis, the mean over the hypotheses. All three are
  // NaN for a single source, for methods that do not compute them and where the deadline ended the
  // search: its loads may contradict any source.
  double chi_square = std::numeric_limits<double>::quiet_NaN();
  double degrees_of_freedom = std::numeric_limits<double>::quiet_NaN();
  double p_value = std::numeric_limits<double>::quiet_NaN();
  bool consistent = true;  // p_value is not below kInconsistent
};
// Below this p_value a source is reported to contradict the others. If all sources follow their
// stated errors, chance alone brings a source below it once in a thousand updates.
inline constexpr double kInconsistent = 1e-3;

struct Estimate {
  EstimateStatus status = EstimateStatus::kNotRun;
  std::string reason;   // one sentence: why it stopped
  Points displacement;  // 3 x n, mm; at every node, moves undeformed to deformed
  // n, mm: root mean square over the three components of the standard deviation of a node's
  // displacement. Empty when uncertainty was not computed.
  VecX sd_mm;
  // n, 0 to 1: how much of a node's standard deviation before the data they took away. 0: the
  // displacement there is a guess from the prior alone; 1: the data know it. Empty when uncertainty
  // was not computed, and for methods other than condensed.
  VecX known;
  // Mean of `known` over the region that was prepared for data: about the tumour and under the
  // opening. NaN: not computed.
  double region_known = std::numeric_limits<double>::quiet_NaN();
  ContactSummary contact;
  std::vector<NodeIndex> active_slaves;
  VecX contact_force_n;       // one per active slave, >= 0 pushes the brain inwards
  MeanStd initial_misfit_mm;  // of |d|
  MeanStd misfit_mm;          // of |d - A x|
  std::vector<IterationRecord> history;
  // Estimated strength of the prior's parts, in units of the case's standard deviations.
  // Estimated by method condensed only; 1 otherwise.
  PriorScaleValues prior_scales = kAsInTheCase;
  // Probability that a part is absent. Estimated by method condensed only; 0 otherwise.
  PriorScaleValues prior_absent{};
  // Parts whose most probable strength is the greatest that is allowed.
  PerPart<bool> prior_at_bound{};
  // The most probable one first. Method condensed with estimated strengths only.
  std::vector<Hypothesis> hypotheses;
  // Root mean square of the whitened residuals: 1 when the data lie as far off as their standard
  // deviations say. NaN: not computed.
  double misfit_ratio = std::numeric_limits<double>::quiet_NaN();
  int data_outside_region = 0;  // data outside the region that was prepared
  // Smallest ratio of an element's volume after to before (det F). At 0 and below the element is
  // inverted, and the estimate there is no deformation of tissue. NaN: not measured.
  double min_volume_ratio = std::numeric_limits<double>::quiet_NaN();
  // The same of the volume about a node (fem/deformation.hpp), by which lost volume is judged.
  // NaN: not measured. Not on the wire.
  double min_nodal_volume_ratio = std::numeric_limits<double>::quiet_NaN();
  int inverted_elements = 0;
  // By how much the ventricles have grown, mm^3, by their wall as it has moved. NaN: the model has
  // no ventricles.
  double ventricle_change_mm3 = std::numeric_limits<double>::quiet_NaN();
  // In the order of the data. Empty for data without named sources.
  std::vector<SourceSummary> sources;
  // Time spent on displacement and sd_mm, part of the inversion's time. Condensed methods only.
  double rebuild_ms = 0.0;
  // Whether the field may be used. `status` speaks of the algorithm only. kNotJudged for iterates.
  QualityVerdict quality;
};

// A part of the model that an update left out, the reason, and an estimate of the error it
// causes.
struct Omission {
  std::string part;
  std::string reason;
  std::string estimated_error;
};

struct StageTimings {  // milliseconds, monotonic clock
  double register_ms = 0.0;
  double invert_ms = 0.0;  // without the rebuild
  double rebuild_ms = 0.0;
  double encode_ms = 0.0;   // of this update, but for these timings
  double journal_ms = 0.0;  // queueing the newest observation for the journal; 0 without a journal
};

// How long an answer took: from the arrival of its observation at the daemon until its encoding.
// (SourceSummary::age_s is another age: of the data, behind the newest observation.)
struct AnswerTime {
  double ms = 0.0;        // monotonic clock; 0: not told (iterates)
  double usual_ms = 0.0;  // median over the answers of the session before it; 0: too few yet
  // Since its data were acquired, as SessionState::age_ms, when it was encoded.
  double age_ms = 0.0;

  // Later after its observation than navigation may take for granted: the brain may have moved
  // since. Says nothing about the field itself, which its verdict is for. Twice, so that no field
  // that reaches its viewer later than three times the median of the whole session goes unmarked:
  // delivery adds to the time, and the median moves.
  bool late() const { return usual_ms > 0.0 && ms > kLate * usual_ms; }
  static constexpr double kLate = 2.0;
};
// "answered 812 ms after its observation came, usually 34 ms"
std::string sentence(const AnswerTime& time);

// The nodes that the columns of an update's displacement, and its standard deviations, are of.
struct FieldPart {
  int mesh_nodes = 0;            // of the whole mesh
  std::vector<NodeIndex> nodes;  // ascending; one per column
  // 0: these are all nodes of the choice. Otherwise only those that changed since the update with
  // this sequence, of the same session, which the receiver must hold.
  std::uint64_t base_sequence = 0;

  bool operator==(const FieldPart&) const = default;
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
  AnswerTime answer_time;
  RigidTransform T_undeformed_deformed = RigidTransform::Identity();  // from ICP; identity without
  std::vector<Omission> left_out;
  // Of a viewer that chose a part of every field: the nodes that the columns of the displacement
  // are of. Empty: every node of the mesh, in order.
  std::optional<FieldPart> part = std::nullopt;

  // Whether the field may be shown and kept: final, and judged good or with caution. Every other
  // update is for its reasons only, and the usable one before it stays the valid one.
  bool usable() const { return final && estimate.quality.usable(); }
};

}  // namespace brainshift
