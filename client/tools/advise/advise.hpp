// SPDX-License-Identifier: GPL-3.0-or-later
// Advise: plays a recorded surgery, or what a running one has recorded, without the daemon, and
// ranks what could be measured next (common/advice/advice.hpp).
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "common/advice/advice.hpp"
#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/estimate.hpp"
#include "common/values/observation.hpp"

namespace brainshift::client {

struct AdviserOptions {
  std::filesystem::path model;
  Boundary boundary = Boundary::kContact;
  std::filesystem::path candidates;  // table (advice/candidates.hpp); empty: those of the model
  // Undeformed, mm RAS; absent: the tumour's boundary.
  std::optional<Vec3> target_mm;
};

struct Advised {
  std::shared_ptr<const BrainModel> model;
  advice::Target target;
  std::vector<advice::Advice> advice;  // best first
  Update update;                       // the last one with a field
  std::vector<std::string> sources;    // that were played, sorted
  int played = 0;                      // observations
  std::vector<std::string> failures;   // a sentence for every observation without an estimate
};

// A model that is ready to give advice about any recording of it. Not thread-safe.
class Adviser {
 public:
  // kNotFound, kUnreadable: a file; kInvalidArgument: a target outside the brain; kEmptySet: the
  // model file lacks the boundary's operators; errors of advice::read_candidates.
  static Result<Adviser> open(const AdviserOptions& options);
  Adviser(Adviser&&) noexcept;
  Adviser& operator=(Adviser&&) noexcept;
  ~Adviser();

  const std::string& model_id() const;

  // After the first `count` observations of a surgery file or journal, as the daemon would answer
  // them; 0: all. kNotFound, kUnreadable: the file; kInvalidArgument: it is of another model, or
  // holds fewer; kEmptySet: it holds none; kNotConverged: the last observation gave no estimate,
  // or the field is unusable (the reason says why).
  Result<Advised> after(const std::filesystem::path& surgery, std::uint64_t count,
                        const Progress& progress = {});

  // After the observations that a field of a running session was computed from (source and
  // sequence, SourceSummary), which are read in the session's journal: that field again. As
  // after(); kUnavailable: the journal is of another session, or does not hold one of them.
  Result<Advised> now(const std::filesystem::path& journal, const SessionKey& session,
                      const std::map<std::string, std::uint64_t>& used, std::stop_token stop);

 private:
  struct Impl;
  explicit Adviser(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

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
