// SPDX-License-Identifier: GPL-3.0-or-later
// Device set files of the PLUS Toolkit (XML): the constant transforms.
//
//   PlusConfiguration / CoordinateDefinitions / Transform
//       From, To, Matrix (16 numbers, row by row)
//
// ImageToProbe turns pixels into mm: it scales, and its third column is a direction without
// meaning for flat images. Links between frames of bodies must be rigid. The rest of the file is
// not looked at.
#pragma once

#include <filesystem>
#include <vector>

#include "common/core/error.hpp"
#include "common/tracking/chain.hpp"

namespace brainshift::io {

// kNotFound; kUnreadable naming the transform and what is wrong with it.
Result<std::vector<tracking::ConstantLink>> read_plus_config(const std::filesystem::path& path);

}  // namespace brainshift::io
