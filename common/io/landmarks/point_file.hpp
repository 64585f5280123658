// SPDX-License-Identifier: GPL-3.0-or-later
// A list of named points from a file, mm.
//
//   .mrk.json, .json  3D Slicer's, taken to RAS:
//                     {"markups": [{"type": "Fiducial", "coordinateSystem": "LPS",
//                                   "controlPoints": [{"label": "F-1", "position": [x, y, z]}]}]}
//                     A point whose positionStatus is not "defined" was not placed and is left out.
//   .fcsv             3D Slicer's, taken to RAS: "# CoordinateSystem = LPS" and
//                     "# columns = id,x,y,z,...,label,..." above rows of cells; without the second
//                     line, Slicer's own order of columns. Slicer 5 writes a 15th, unnamed: a point
//                     whose value there is not 2 was not placed and is left out.
//   .csv              rows x,y,z or name,x,y,z, in whatever frame the user means; or a heading with
//                     the columns x,y,z, or r,a,s, or l,p,s (as Slicer's tables have them; taken to
//                     RAS), and perhaps label or name, and defined: 0 leaves the point out
//                     (files/table.hpp). Another heading is refused.
// The coordinate system of Slicer's lists: RAS or 0, LPS or 1 (numbers in files of Slicer before
// 4.11). A file that does not say is refused: its points could be mirrored twice.
// Source: Slicer's vtkMRMLMarkupsStorageNode and the schema markups-schema-v1.0.3.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::io {

// As many names as points. A name may be empty.
struct NamedPoints {
  std::vector<std::string> names;
  std::vector<Vec3> points;  // mm

  void add(std::string name, const Vec3& point);
  // Every point has a name.
  bool all_named() const;
};

// kNotFound; kUnreadable or kEmptySet naming the file, the line or point and what is wrong there:
// also another type of markup, more than one list, another coordinate system or unit.
Result<NamedPoints> read_points(const std::filesystem::path& path);

}  // namespace brainshift::io
