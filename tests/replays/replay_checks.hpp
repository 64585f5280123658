// SPDX-License-Identifier: GPL-3.0-or-later
// The checks of `make replays` (tests/support/study_record.hpp):
//   corpus        every observation is that of the committed table
//   all speeds    what was sent is accounted for: fields + superseded + errors. No field came later
//                 than 3 x the median of its session without the mark (only the first kFew answers
//                 of a session cannot be marked: nothing is usual yet). Fields of the same evidence
//                 agree within 0.01 mm.
//   1x            no missed deadline
//   per surgery   no stage slower than 1.5 x the committed run, p50 and p95 over t_solve
#pragma once

#include <optional>
#include <vector>

#include "tests/replays/manifest.hpp"
#include "tests/surgeries/surgery_table.hpp"

namespace brainshift::replays {

inline constexpr double kLateFactor = 3.0;  // of the session's median (AnswerTime::late)
inline constexpr double kMostDifference_mm = 0.01;
inline constexpr double kMostRatio = 1.5;

// committed: of the case; empty optional: none is kept for it.
void check_corpus(const std::optional<std::vector<ManifestEntry>>& committed,
                  const std::vector<ManifestEntry>& made);

// rows: of one head, not empty.
void check_replays(const surgeries::Rows& rows);

// committed: rows of an earlier run; empty: none are kept, which is a part left out.
void check_regression(const surgeries::Rows& rows, const surgeries::Rows& committed);

}  // namespace brainshift::replays
