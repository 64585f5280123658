// SPDX-License-Identifier: GPL-3.0-or-later
// The patient registration: a rigid T_ras_reference, x_ras = T_ras_reference x_reference, mm.
//
// 16 numbers row by row, as plain text, JSON or YAML; brackets, commas and a leading key T_ras_reference are allowed:
//   1 0 0 10              {"T_ras_reference": [[1, 0, 0, 10], ...]}         T_ras_reference: [1, 0, 0, 10, ...]
#pragma once

#include <filesystem>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift::io {

// kNotFound; kUnreadable naming the file and what is wrong (not 16 numbers, no rigid motion).
Result<RigidTransform> read_registration(const std::filesystem::path& path);

}  // namespace brainshift::io
