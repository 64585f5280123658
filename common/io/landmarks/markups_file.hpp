// SPDX-License-Identifier: GPL-3.0-or-later
// Point lists of 3D Slicer, taken to RAS.
//
//   .mrk.json  {"markups": [{"type": "Fiducial", "coordinateSystem": "LPS",
//                            "controlPoints": [{"label": "F-1", "position": [x, y, z]}, ...]}]}
//              A point whose positionStatus is not "defined" was not placed and is left out.
//   .fcsv      "# CoordinateSystem = LPS" and "# columns = id,x,y,z,...,label,..." above rows of
//              cells; without the second line, Slicer's own order of columns.
// coordinateSystem: RAS or 0, LPS or 1 (numbers in files of Slicer before 4.11). A file that does
// not say is refused: its points could be mirrored twice.
// Source: Slicer's vtkMRMLMarkupsStorageNode and the schema markups-schema-v1.0.3.
#pragma once

#include <string>

#include "common/core/error.hpp"
#include "common/io/landmarks/named_points.hpp"

namespace brainshift::io {

// Both: mm RAS, in the file's order. kUnreadable with a sentence that names line or point and what
// is wrong, without the file: another type of markup, more than one list, another coordinate
// system or unit, a coordinate that is no finite number. kEmptySet: no point.
Result<NamedPoints> parse_markups_json(const std::string& content);
Result<NamedPoints> parse_fcsv(const std::string& content);

}  // namespace brainshift::io
