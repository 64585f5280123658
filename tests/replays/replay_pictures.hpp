// SPDX-License-Identifier: GPL-3.0-or-later
// Latency and stages of every surgery, a panel for each speed.
#pragma once

#include <filesystem>

#include "common/core/error.hpp"
#include "tests/surgeries/surgery_table.hpp"

namespace brainshift::replays {

// replays-latency.png: share of the updates that take longer, over latency / t_solve;
// replays-stages.png: p50 to p95 of every stage over t_solve. The first update of every session is
// in neither. kWriteFailed.
Status draw_replays(const surgeries::Rows& rows, const std::filesystem::path& folder);

}  // namespace brainshift::replays
