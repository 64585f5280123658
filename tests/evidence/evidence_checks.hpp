// SPDX-License-Identifier: GPL-3.0-or-later
// What the study must show, beside the paper's figures: checks of checks.csv
// (tests/support/study_record.hpp). A bound that is missed is recorded as missed.
#pragma once

#include "tests/surgeries/surgery_table.hpp"

namespace brainshift::evidence {

// The rows of one head. Means are over the patients' means, so that every patient counts alike.
void check_evidence(const surgeries::Rows& head);

// Of a column over `rows`: the mean over patients of each patient's mean; NaN without a number.
double patient_mean(const surgeries::Rows& rows, const char* column);

}  // namespace brainshift::evidence
