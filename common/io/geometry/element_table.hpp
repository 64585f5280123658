// SPDX-License-Identifier: GPL-3.0-or-later
// The element types of mesh files, in one table for every format. Only 4-node tetrahedra and
// 3-node triangles are read. A file with volumes of another type, or labelled surfaces, is
// refused: what is left of it would be a part of the brain. Private to the room.
// Source: Gmsh reference manual, "MSH file format"; vtkCellType.h.
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace brainshift::io {

struct ElementKind {
  const char* name;
  int dimension;  // 3: a volume
  int nodes;      // 0: the file says how many
};
inline constexpr std::int64_t kGmshTriangle = 2, kGmshTetrahedron = 4;
inline constexpr std::int64_t kVtkTriangle = 5, kVtkTetrahedron = 10;

// Throw FormatProblem for a type that the table does not have.
const ElementKind& gmsh_element(std::int64_t type);
const ElementKind& vtk_element(std::int64_t type);

// Elements that would get lost.
class OtherElements {
 public:
  void add(const ElementKind& kind, std::int64_t type);
  // Throws FormatProblem, naming types and counts, unless there are none and `tets` > 0.
  void check(std::int64_t tets) const;

 private:
  std::map<std::string, std::int64_t> counts_;  // of "10-node tetrahedra (type 11)"
};

}  // namespace brainshift::io
