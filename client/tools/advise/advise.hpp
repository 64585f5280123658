// SPDX-License-Identifier: GPL-3.0-or-later
// Advise: plays a recorded surgery without a daemon, observation after observation as the daemon
// would, and ranks what could be measured next (common/advice/advice.hpp).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/advice/advice.hpp"
#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/estimate.hpp"

namespace brainshift::client {

struct AdviseOptions {
  std::filesystem::path surgery;
  std::filesystem::path model;
  Boundary boundary = Boundary::kContact;
  std::uint64_t observations = 0;    // the first so many of the file are played; 0: all
  std::filesystem::path candidates;  // table (advice/candidates.hpp); empty: those of the model
  // Undeformed, mm RAS; absent: the tumour's boundary.
  std::optional<Vec3> target_mm;
};

struct Advised {
  BrainModel model;
  advice::Target target;
  std::vector<advice::Advice> advice;  // best first
  Update update;                       // the last one with a field
  std::vector<std::string> sources;    // that were played, sorted
  int played = 0;                      // observations
  std::vector<std::string> failures;   // a sentence for every observation without an estimate
};

// kNotFound, kUnreadable: a file; kInvalidArgument: the surgery is of another model, a target
// outside the brain, more observations than there are; kEmptySet: nothing was played, or the model
// file lacks the boundary's operators; kNotConverged: no observation gave an estimate, or the last
// field is unusable (the reason says why); errors of advice::read_candidates.
Result<Advised> advise(const AdviseOptions& options, const Progress& progress = {});

// For people: what was played, a row per candidate, failures. At most 100 columns.
std::vector<std::string> advise_lines(const Advised& advised);
// One object: case, model_id, observations, target, quality, candidates [{rank, name, kind,
// sd_before_mm, sd_after_mm, reduction_mm, where_mm [R, A, S], data}]; those that cannot be used
// have null in place of the three numbers, and a reason. Ends with a line break.
std::string advise_json(const Advised& advised);

// The tumour from the opening and from two sides: every part of its boundary in the colour of the
// sweep nearest to it, the other candidates as discs, the five best with their rank. kWriteFailed.
Status draw_advice(const Advised& advised, const std::filesystem::path& out);

}  // namespace brainshift::client
