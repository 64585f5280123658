// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/element_table.hpp"

#include <fmt/format.h>

#include "common/io/files/number_cursor.hpp"

namespace brainshift::io {
namespace {

using ElementTable = std::map<std::int64_t, ElementKind>;

const ElementKind& element_of(const ElementTable& table, std::int64_t type) {
  const auto found = table.find(type);
  if (found == table.end()) refuse_format(fmt::format("element type {} is unknown", type));
  return found->second;
}

}  // namespace

const ElementKind& gmsh_element(std::int64_t type) {
  static const ElementTable kTable = {{1, {"lines", 1, 2}},
                                      {2, {"triangles", 2, 3}},
                                      {3, {"quadrilaterals", 2, 4}},
                                      {4, {"tetrahedra", 3, 4}},
                                      {5, {"hexahedra", 3, 8}},
                                      {6, {"prisms", 3, 6}},
                                      {7, {"pyramids", 3, 5}},
                                      {8, {"lines", 1, 3}},
                                      {9, {"triangles", 2, 6}},
                                      {10, {"quadrilaterals", 2, 9}},
                                      {11, {"tetrahedra", 3, 10}},
                                      {12, {"hexahedra", 3, 27}},
                                      {13, {"prisms", 3, 18}},
                                      {14, {"pyramids", 3, 14}},
                                      {15, {"points", 0, 1}},
                                      {16, {"quadrilaterals", 2, 8}},
                                      {17, {"hexahedra", 3, 20}},
                                      {18, {"prisms", 3, 15}},
                                      {19, {"pyramids", 3, 13}},
                                      {20, {"triangles", 2, 9}},
                                      {21, {"triangles", 2, 10}},
                                      {22, {"triangles", 2, 12}},
                                      {23, {"triangles", 2, 15}},
                                      {24, {"triangles", 2, 15}},
                                      {25, {"triangles", 2, 21}},
                                      {26, {"lines", 1, 4}},
                                      {27, {"lines", 1, 5}},
                                      {28, {"lines", 1, 6}},
                                      {29, {"tetrahedra", 3, 20}},
                                      {30, {"tetrahedra", 3, 35}},
                                      {31, {"tetrahedra", 3, 56}},
                                      {36, {"quadrilaterals", 2, 16}},
                                      {37, {"quadrilaterals", 2, 25}},
                                      {90, {"prisms", 3, 40}},
                                      {92, {"hexahedra", 3, 64}},
                                      {93, {"hexahedra", 3, 125}},
                                      {118, {"pyramids", 3, 30}}};
  return element_of(kTable, type);
}

const ElementKind& vtk_element(std::int64_t type) {
  static const ElementTable kTable = {{0, {"empty cells", 0, 0}},
                                      {1, {"vertices", 0, 1}},
                                      {2, {"vertex lists", 0, 0}},
                                      {3, {"lines", 1, 2}},
                                      {4, {"polylines", 1, 0}},
                                      {5, {"triangles", 2, 3}},
                                      {6, {"triangle strips", 2, 0}},
                                      {7, {"polygons", 2, 0}},
                                      {8, {"pixels", 2, 4}},
                                      {9, {"quadrilaterals", 2, 4}},
                                      {10, {"tetrahedra", 3, 4}},
                                      {11, {"voxels", 3, 8}},
                                      {12, {"hexahedra", 3, 8}},
                                      {13, {"wedges", 3, 6}},
                                      {14, {"pyramids", 3, 5}},
                                      {15, {"pentagonal prisms", 3, 10}},
                                      {16, {"hexagonal prisms", 3, 12}},
                                      {21, {"lines", 1, 3}},
                                      {22, {"triangles", 2, 6}},
                                      {23, {"quadrilaterals", 2, 8}},
                                      {24, {"tetrahedra", 3, 10}},
                                      {25, {"hexahedra", 3, 20}},
                                      {26, {"wedges", 3, 15}},
                                      {27, {"pyramids", 3, 13}},
                                      {28, {"quadrilaterals", 2, 9}},
                                      {29, {"hexahedra", 3, 27}},
                                      {30, {"quadrilaterals", 2, 6}},
                                      {31, {"wedges", 3, 12}},
                                      {32, {"wedges", 3, 18}},
                                      {33, {"hexahedra", 3, 24}},
                                      {34, {"triangles", 2, 7}},
                                      {35, {"lines", 1, 4}},
                                      {36, {"curved polygons", 2, 0}},
                                      {37, {"pyramids", 3, 19}},
                                      {41, {"convex point sets", 3, 0}},
                                      {42, {"polyhedra", 3, 0}},
                                      {68, {"Lagrange curves", 1, 0}},
                                      {69, {"Lagrange triangles", 2, 0}},
                                      {70, {"Lagrange quadrilaterals", 2, 0}},
                                      {71, {"Lagrange tetrahedra", 3, 0}},
                                      {72, {"Lagrange hexahedra", 3, 0}},
                                      {73, {"Lagrange wedges", 3, 0}},
                                      {74, {"Lagrange pyramids", 3, 0}},
                                      {75, {"Bezier curves", 1, 0}},
                                      {76, {"Bezier triangles", 2, 0}},
                                      {77, {"Bezier quadrilaterals", 2, 0}},
                                      {78, {"Bezier tetrahedra", 3, 0}},
                                      {79, {"Bezier hexahedra", 3, 0}},
                                      {80, {"Bezier wedges", 3, 0}},
                                      {81, {"Bezier pyramids", 3, 0}}};
  return element_of(kTable, type);
}

void OtherElements::add(const ElementKind& kind, std::int64_t type) {
  ++counts_[kind.nodes > 0 ? fmt::format("{}-node {} (type {})", kind.nodes, kind.name, type)
                           : fmt::format("{} (type {})", kind.name, type)];
}

void OtherElements::check(std::int64_t tets) const {
  std::string others;
  for (const auto& [name, count] : counts_) {
    others += fmt::format("{}{} {}", others.empty() ? "" : ", ", count, name);
  }
  if (tets == 0) {
    refuse_format("has no 4-node tetrahedron" + (others.empty() ? "" : ", but " + others));
  }
  if (!others.empty()) {
    refuse_format(fmt::format(
        "has {} beside {} 4-node tetrahedra: only these and 3-node triangles can be read", others,
        tets));
  }
}

}  // namespace brainshift::io
