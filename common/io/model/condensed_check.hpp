// SPDX-License-Identifier: GPL-3.0-or-later
// Whether condensed operators can be used with a model. Private to the room.
#pragma once

#include <optional>
#include <string>

#include "common/operators/condensed_operators.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::io {

// What makes the operators unusable: another model_id, shapes or indices that do not fit, numbers
// that are not finite, a compliance that is not symmetric. One sentence without a file name;
// nothing if they fit.
std::optional<std::string> incompatibility_of(const CondensedOperators& operators,
                                              const BrainModel& model);

}  // namespace brainshift::io
