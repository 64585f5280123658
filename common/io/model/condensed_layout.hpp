// SPDX-License-Identifier: GPL-3.0-or-later
// The /condensed group of a model file (model_file.hpp lists it). Private to the room. Errors are
// thrown as Hdf5Problem.
#pragma once

#include <vector>

#include "common/io/model/hdf5_access.hpp"
#include "common/operators/condensed_operators.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::io {

void write_condensed(Hdf5Writer& out, const std::vector<CondensedOperators>& operators);
// Those of the wanted boundary conditions that the file has. Throws also when they do not fit the
// model.
std::vector<CondensedOperators> read_condensed(const Hdf5Reader& in, const BrainModel& model,
                                               const std::vector<Boundary>& wanted);

}  // namespace brainshift::io
