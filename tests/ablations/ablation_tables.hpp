// SPDX-License-Identifier: GPL-3.0-or-later
// The table of docs/ablations.md, its checks and its picture, from the rows of `ablations`.
#pragma once

#include <filesystem>
#include <string>

#include "tests/surgeries/surgery_table.hpp"

namespace brainshift::ablations {

// A line per part of which there are rows: errors over all surgeries, the variant's over the
// default's (geometric means); the same of the time of an update (median); in how many combinations
// of measure, group and data the part buys something and in how many it costs something
// (comparison.hpp), and the largest of each.
std::string parts_table(const surgeries::Rows& rows);

// The same rows with the columns that the table and its reader want: what docs/ablations keeps.
std::string short_rows(const surgeries::Rows& rows);

// Why parts are not among them, a line each.
std::string left_out_list();

// checks.csv (tests/support/study_record.hpp): every part that is on by default buys something
// somewhere. Figures: the same of parts that are off; updates that were refused.
void check_ablations(const surgeries::Rows& rows);

// ablations-MEASURE-prior.png, -data.png and -off.png, MEASURE tumour and craniotomy: error
// without each part over the default's, a dot per group of truths. kWriteFailed.
Status draw_ablations(const surgeries::Rows& rows, const std::filesystem::path& folder);

}  // namespace brainshift::ablations
