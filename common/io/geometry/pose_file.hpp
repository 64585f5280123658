// SPDX-License-Identifier: GPL-3.0-or-later
// A rigid transform from a file, for poses of cameras and probes.
//
// .yaml or .yml: a mapping with one key, the transform's name, whose value is the 4 x 4 matrix, sixteen numbers row by
// row, flat. Any other name: a text of sixteen numbers between white space or commas, row by row, nothing else; lines
// that begin with # are skipped. Lengths in mm.
#pragma once

#include <filesystem>
#include <string>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift::io {

// `name`: "T_ras_camera". kNotFound, kUnreadable (another number of numbers), kNotFinite, kInvalidArgument: the file
// does not hold a rigid motion (core/stereo_calibration.hpp, check_rigid). Messages begin with the file.
Result<RigidTransform> read_pose(const std::filesystem::path& path, const std::string& name);

}  // namespace brainshift::io
