// SPDX-License-Identifier: GPL-3.0-or-later
// One way to estimate the surgeries of a patient: the case with a change, a boundary condition, and
// which observations it has. `make evidence` plays two (contact, fixed), `make ablations` many
// (tests/ablations/parts.hpp).
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/pipeline/pipeline.hpp"
#include "common/values/estimate.hpp"
#include "common/values/observation.hpp"
#include "tests/benchmarks/bench_head.hpp"
#include "tests/evidence/evidence_rows.hpp"
#include "tests/evidence/patient_twin.hpp"

namespace brainshift::evidence {

// What must be made anew for it, besides the inverter.
enum class Anew {
  kNothing,    // the change is of what an update reads: sensing, prior.scales
  kOperators,  // factor, prior and condensed operators
  kMesh,       // these and the mesh, so that the surgeries are played anew, on it
};

struct Variant {
  std::string name;
  Anew anew = Anew::kNothing;
  Boundary boundary = Boundary::kContact;
  std::function<void(CaseConfig&)> change = {};           // none: the case as it is
  std::function<bool(const Observation&)> has_seen = {};  // none: every observation
};

// The daemon's pipeline (method condensed) for one variant of a patient's case, and the rows of
// what it makes of a surgery. An estimate sees the observations alone; the truth is read for its
// score.
//
// What an update finds must not depend on what else the machine does; how long it took is a column.
inline constexpr double kNoDeadline_ms = 1e6;

struct EstimateSession {
  Variant variant;
  std::shared_ptr<const inversion::PreparedModel> prepared;
  std::shared_ptr<const CondensedOperators> operators;
  std::unique_ptr<pipeline::Pipeline> pipeline;
};

// head: with the mesh that the variant asks for, and with the operators of the contact boundary
// where the variant asks for no others. Errors of validate (the change made no valid case),
// PreparedModel::prepare, condense, condensed_inverter and Pipeline::build.
Result<EstimateSession> begin_session(const bench::Head& head, const Variant& variant);

// A row per observation that the variant has seen. `figures`: key and nodes; the other members are
// filled here. A surgery that is absent is one row with its reason, a refused update a row with the
// refusal. Errors: of scoring.
Result<std::vector<surgeries::Row>> estimate_rows(const bench::Head& head, EstimateSession& session,
                                                  const PlayedSurgery& played,
                                                  EvidenceFigures figures);

}  // namespace brainshift::evidence
