// SPDX-License-Identifier: GPL-3.0-or-later
// Pictures of the study: a dot per surgery under each truth, both boundary conditions side by side;
// and how often the truth lies in the published intervals, of every width.
#pragma once

#include <filesystem>

#include "common/core/error.hpp"
#include "tests/surgeries/surgery_table.hpp"

namespace brainshift::evidence {

// evidence-tumour.png, evidence-craniotomy.png, evidence-coverage.png, evidence-reliability.png.
// kWriteFailed.
Status draw_evidence(const surgeries::Rows& rows, const std::filesystem::path& folder);

}  // namespace brainshift::evidence
