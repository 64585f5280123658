// SPDX-License-Identifier: GPL-3.0-or-later
// The groups of a model file (common/io/model_file.hpp lists them). For the .cpp files of this folder only.
// Errors are thrown as Hdf5Problem.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/values/brain_model.hpp"
#include "common/values/case_config.hpp"
#include "common/values/condensed_operators.hpp"
#include "common/core/error.hpp"
#include "common/io/files/hdf5_access.hpp"
#include "common/io/model/model_inputs.hpp"

namespace brainshift::io {

void write_brain_model(Hdf5Writer& out, const BrainModel& model);
// Throws also when the content does not hash to its model_id.
BrainModel read_brain_model(const Hdf5Reader& in);

void write_case(Hdf5Writer& out, const CaseConfig& config);
CaseConfig read_case(const Hdf5Reader& in);

void write_inputs(Hdf5Writer& out, const std::vector<InputFile>& inputs);
std::vector<InputFile> read_inputs(const Hdf5Reader& in);

void write_condensed(Hdf5Writer& out, const std::vector<CondensedOperators>& operators);
// Throws also when the operators do not fit the model.
std::vector<CondensedOperators> read_condensed(const Hdf5Reader& in, const BrainModel& model);

// What makes operators unusable with a model: another model_id, shapes or indices that do not fit, numbers
// that are not finite, a compliance that is not symmetric. One sentence without a file name; nothing if they fit.
std::optional<std::string> misfit_of(const CondensedOperators& operators, const BrainModel& model);

}  // namespace brainshift::io
