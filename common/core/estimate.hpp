// SPDX-License-Identifier: Apache-2.0
// Estimate: the result of one inversion; and Update: an Estimate on its way to the clients.
#pragma once

#include <cstdint>
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
  kPaper,  // adjoint steepest descent with refactorisation (paper section 2.4)
};
std::string_view to_string(Boundary boundary);  // "contact", "fixed"
std::string_view to_string(Method method);      // "paper"

enum class EstimateStatus {
  kNotRun,
  kIterating,       // an intermediate iterate, published for progress
  kConverged,       // the stop rule held
  kIterationLimit,  // best iterate so far; the stop rule did not hold
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

struct ContactSummary {
  int active = 0;       // slaves carrying a contact force
  int penetrating = 0;  // slaves with penetration above the reporting tolerance
  double max_penetration_mm = 0.0;
  int iterations = 0;  // contact iterations (active-set changes)
};

struct Estimate {
  EstimateStatus status = EstimateStatus::kNotRun;
  std::string reason;   // one sentence: why it stopped
  Points displacement;  // 3 x n, mm; at every node, moves undeformed to deformed
  VecX sd_mm;           // n, or empty when uncertainty was not computed
  ContactSummary contact;
  std::vector<NodeIndex> active_slaves;
  VecX contact_force_n;       // one per active slave, >= 0 pushes the brain inwards
  MeanStd initial_misfit_mm;  // of |d|
  MeanStd misfit_mm;          // of |d - A x|
  std::vector<IterationRecord> history;
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
  Method method = Method::kPaper;
  Boundary boundary = Boundary::kContact;
  bool final = true;  // false: an intermediate iterate
  Estimate estimate;
  StageTimings timings;
  RigidTransform T_undeformed_deformed = RigidTransform::Identity();  // from ICP; identity without
  std::vector<Omission> left_out;
};

}  // namespace brainshift
