// SPDX-License-Identifier: GPL-3.0-or-later
// The groups of a model file but /condensed (model_file.hpp lists them). Private to the room.
// Errors are thrown as Hdf5Problem.
#pragma once

#include <vector>

#include "common/configuration/case_config.hpp"
#include "common/io/model/hdf5_access.hpp"
#include "common/io/model/model_inputs.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::io {

void write_brain_model(Hdf5Writer& out, const BrainModel& model);
// Throws also when the content does not hash to its model_id.
BrainModel read_brain_model(const Hdf5Reader& in);

void write_case(Hdf5Writer& out, const CaseConfig& config);
CaseConfig read_case(const Hdf5Reader& in);

void write_inputs(Hdf5Writer& out, const std::vector<InputFile>& inputs);
std::vector<InputFile> read_inputs(const Hdf5Reader& in);

}  // namespace brainshift::io
