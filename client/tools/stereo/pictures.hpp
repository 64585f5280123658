// SPDX-License-Identifier: GPL-3.0-or-later
// Finds and reads pictures, and draws disparities.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/stereo/disparity.hpp"
#include "common/stereo/gray_image.hpp"

namespace brainshift::client {

// Grey levels of a PNG, JPEG, TIFF, BMP or PGM file; colours become their luminance, 16 bits are
// divided by 256. The file may be compressed with gzip. kNotFound or kUnreadable; the sentence
// names the file.
Result<stereo::GrayImage> read_picture(const std::filesystem::path& path);

// The files that names and shell patterns ("left*.jpg") match, in the order of the patterns, the
// files of each in alphabetical order. kNotFound names a pattern that no file matches.
Result<std::vector<std::filesystem::path>> expand_patterns(const std::vector<std::string>& names);

// A picture of what was matched: the rectified left picture beside its disparities in colour, with
// a colour bar in px and the depths that they mean. Pale: no match.
// PNG. kWriteFailed.
Status write_disparity_picture(const std::filesystem::path& path,
                               const stereo::MeasuredDisparity& measured);

}  // namespace brainshift::client
