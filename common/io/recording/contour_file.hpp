// SPDX-License-Identifier: GPL-3.0-or-later
// Traced contours and seeds from files.
//
//   .csv   rows frame,u_px,v_px, or columns in the order that a heading names (also image, x, y,
//          without _px); the rows of one frame, in order, are a contour
//   .json  {"contours": [{"frame": 12, "closed": true, "points_px": [[u, v], ...]}, ...]}
// Frames count from 0; pixels as tracking::Recording has them (orientation MF). '#' begins a
// comment in a .csv.
#pragma once

#include <filesystem>
#include <vector>

#include "common/core/error.hpp"
#include "common/ultrasound/boundary.hpp"
#include "common/ultrasound/lesion_tracer.hpp"

namespace brainshift::io {

// `closed` is for .csv files, which cannot say. kNotFound; kUnreadable naming file and line
// (JSON: contour) and what is wrong there: text for a number, a frame below 0, an unknown key,
// rows of a frame that are not together; kEmptySet.
Result<std::vector<ultrasound::Contour>> read_contours(const std::filesystem::path& path,
                                                       bool closed);

// One seed per row of a .csv. As read_contours.
Result<std::vector<ultrasound::Seed>> read_seeds(const std::filesystem::path& path);

}  // namespace brainshift::io
