// SPDX-License-Identifier: GPL-3.0-or-later
// The limit of a case on the memory of a preparation, checked before anything is allocated.
#pragma once

#include <cstdint>

#include "common/core/error.hpp"
#include "common/inversion/prepared/prepared_model.hpp"

namespace brainshift::inversion {

// Ok, or kInvalidArgument when `bytes` exceed condensed.memory_limit_gib of the model's case. The
// sentence names both sizes.
Status check_memory(const PreparedModel& model, std::uint64_t bytes);

}  // namespace brainshift::inversion
