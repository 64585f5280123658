// SPDX-License-Identifier: GPL-3.0-or-later
// The bounds that the surgeries of one head are held to, recorded by tests/support/study_record.
//
// Means are over surgeries; unless stated, of the last update, which knows all sources. A refused
// update counts as one that recovers nothing and covers nothing.
#pragma once

#include <optional>
#include <string>

#include "tests/surgeries/surgery_table.hpp"

namespace brainshift::surgeries {

// head: all rows of one head. before: those of an earlier estimate on the same surgeries, by which
// sag is judged and the better of both estimates from the tumour alone is taken; without it these
// checks are recorded as left out.
void check_head(const Rows& head, const std::optional<Rows>& before);

}  // namespace brainshift::surgeries
