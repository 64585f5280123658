// SPDX-License-Identifier: GPL-3.0-or-later
// What a mesh or surface file says about the frame of its points: RAS or LPS.
//
// 3D Slicer writes the word into every model: as the string array SPACE of the field data (.vtu,
// .vtp), and as "SPACE=LPS" in the heading or in a comment (.stl, .ply, .obj). Source:
// vtkMRMLModelStorageNode of Slicer. A file of another program says nothing.
// Messages name the value and not the file.
#pragma once

#include <string_view>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift::io {

enum class PointSpace { kUnsaid, kRas, kLps };

// The value of SPACE; blanks around it do not count. kUnreadable unless RAS or LPS.
Result<PointSpace> parse_point_space(std::string_view value);

// The value behind the first word that begins with "SPACE=" in a heading or a comment; kUnsaid
// where there is none. kUnreadable as above.
Result<PointSpace> point_space_in(std::string_view text);

// Points or vectors of a file as RAS: LPS has the first two coordinates reversed. That is half a
// turn, so triangles and tetrahedra keep their orientation.
void turn_to_ras(PointSpace space, Eigen::Ref<Points> columns);

}  // namespace brainshift::io
