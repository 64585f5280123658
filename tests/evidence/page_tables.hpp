// SPDX-License-Identifier: GPL-3.0-or-later
// The tables of docs/evidence.md, made from the raw files that lie beside it in docs/evidence. The
// study writes them to page.md; a test holds the page against the files.
#pragma once

#include <string>

#include "tests/benchmarks/csv_table.hpp"
#include "tests/surgeries/surgery_table.hpp"

namespace brainshift::evidence {

// What is asked against what was measured: a line per kind of check and bound, over the truths that
// it was held against. checks: the study's checks.csv (study_record.hpp); study: a head of it, or
// "landmarks". Figures without a bound are left out. A line ends with "holds", or with what missed
// its bound and by which value.
std::string claims_table(const bench::CsvTable& checks, const std::string& study);

// A line per truth: recovered at the tumour and CPPD with contact and fixed, from the tumour alone
// and with the cortex, beside a rigid shift of the tumour; coverage of the 90 % interval; updates
// of quality unusable. Means over the patients' means (evidence_checks.hpp). rows: of one head.
std::string truths_table(const surgeries::Rows& rows);

// Root mean square distance and p of a paired t test against the estimate, a line per map.
// landmarks: the study's landmarks.csv.
std::string landmarks_table(const bench::CsvTable& landmarks);

}  // namespace brainshift::evidence
