// SPDX-License-Identifier: GPL-3.0-or-later
// A list of named points from a file, mm.
//
//   .mrk.json, .json, .fcsv   3D Slicer's, taken to RAS (markups_file.hpp)
//   .csv                      rows x,y,z or name,x,y,z, in whatever frame the user means; or a
//                             heading with the columns x,y,z, or r,a,s, or l,p,s (as Slicer's
//                             tables have them; taken to RAS), and perhaps label or name
// Lines of a .csv that begin with # are skipped.
#pragma once

#include <filesystem>

#include "common/core/error.hpp"
#include "common/io/landmarks/named_points.hpp"

namespace brainshift::io {

// kNotFound; kUnreadable or kEmptySet naming the file, the line or point and what is wrong there.
Result<NamedPoints> read_points(const std::filesystem::path& path);

}  // namespace brainshift::io
