// SPDX-License-Identifier: GPL-3.0-or-later
// A patient's model from the case file: read the case, read the files that it names, build.
#pragma once

#include <filesystem>

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::patient {

struct Patient {
  CaseConfig config;
  BrainModel model;
};

// Errors of io::read_case_config, io::load_case_inputs and anatomy::build_brain_model. progress:
// stages of the last.
Result<Patient> read_patient(const std::filesystem::path& case_file, const Progress& progress = {});

// The same for a case that has been read, and perhaps changed, already.
Result<BrainModel> build_patient(const CaseConfig& config, const Progress& progress = {});

}  // namespace brainshift::patient
