// SPDX-License-Identifier: GPL-3.0-or-later
// The /condensed group of a model file (model_file.hpp lists it). Private to the room. Errors of
// the file are thrown as Hdf5Problem.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/io/model/hdf5_access.hpp"
#include "common/operators/condensed_operators.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::io {

// What makes the operators unusable: another model_id, shapes or indices that do not fit, numbers
// that are not finite, a compliance that is not symmetric. One sentence without a file name;
// nothing if they fit.
std::optional<std::string> incompatibility_of(const CondensedOperators& operators,
                                              const BrainModel& model);

void write_condensed(Hdf5Writer& out, const std::vector<CondensedOperators>& operators);
// Those of the wanted boundary conditions that the file has. Throws also when they do not fit the
// model.
std::vector<CondensedOperators> read_condensed(const Hdf5Reader& in, const BrainModel& model,
                                               const std::vector<Boundary>& wanted);

}  // namespace brainshift::io
