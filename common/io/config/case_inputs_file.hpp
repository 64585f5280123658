// SPDX-License-Identifier: GPL-3.0-or-later
// The files that a case names, read.
#pragma once

#include "common/configuration/case_config.hpp"
#include "common/configuration/case_inputs.hpp"
#include "common/core/error.hpp"

namespace brainshift::io {

// Reads the files that a case names. The MRI, which only pictures need, is just looked up.
// kNotFound, kUnreadable: the message names key and file.
Result<CaseInputs> load_case_inputs(const CaseConfig& config);

}  // namespace brainshift::io
