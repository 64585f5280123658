// SPDX-License-Identifier: GPL-3.0-or-later
// A rigid transform from a file: poses of cameras and probes, the patient registration.
//
// The file holds the 16 numbers of the 4 x 4 matrix row by row, lengths in mm, as plain text,
// JSON or YAML. The transform's name may stand in front as a key; lines that begin with # are
// skipped:
//   1 0 0 10
//   0 1 0 0 ...
//   {"T_ras_reference": [[1, 0, 0, 10], ...]}
//   T_ras_reference: [1, 0, 0, 10, ...]
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/rigid_motion.hpp"
#include "common/core/types.hpp"

namespace brainshift::io {

// `name`: "T_ras_camera". tolerance: of check_rigid (core/rigid_motion.hpp); by default a rotation
// with three decimals is accepted. The pose is made orthonormal. kNotFound;
// kUnreadable, which names the file and what is wrong: a word that is no number, another number of
// numbers, not a rigid motion.
Result<RigidTransform> read_pose(const std::filesystem::path& path, const std::string& name,
                                 double tolerance = kThreeDecimals);

// Writes the numbers with all digits as text that read_pose reads back, or nothing. comments:
// lines without a line break, put in front. kWriteFailed.
Status write_pose(const std::filesystem::path& path, const std::string& name,
                  const RigidTransform& T, const std::vector<std::string>& comments = {});

}  // namespace brainshift::io
