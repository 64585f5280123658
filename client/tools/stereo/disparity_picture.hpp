// SPDX-License-Identifier: GPL-3.0-or-later
// A picture of what was matched: the rectified left picture beside its disparities in colour, with
// a colour bar in px and the depths that they mean. Pale: no match.
#pragma once

#include <filesystem>

#include "common/core/error.hpp"
#include "common/stereo/disparity.hpp"

namespace brainshift::client {

// PNG. kWriteFailed.
Status write_disparity_picture(const std::filesystem::path& path,
                               const stereo::MeasuredDisparity& measured);

}  // namespace brainshift::client
