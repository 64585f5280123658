// SPDX-License-Identifier: GPL-3.0-or-later
// The paper's Tables 3 to 6 with the twins' figures beside them.
#pragma once

#include <filesystem>

#include "common/core/error.hpp"
#include "tests/surgeries/surgery_table.hpp"

namespace brainshift::evidence {

// Markdown: a line for each quantity of the paper and one for the same of the twins, patients as
// columns, the mean last. Twins: the consistency truth, updates from the tumour alone, mean over
// the seeds. The paired t test of contact against fixed (section 3.2.1) is over all truths and
// seeds of a patient. rows: of one head. kWriteFailed names the file.
Status write_patient_tables(const surgeries::Rows& rows, const std::filesystem::path& file);

}  // namespace brainshift::evidence
