// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/element_table.hpp"

#include <gmock/gmock.h>

#include "common/io/files/number_cursor.hpp"

namespace brainshift::io {
namespace {

using testing::AllOf;
using testing::HasSubstr;

template <typename Act>
std::string refused(const Act& act) {
  try {
    act();
  } catch (const FormatProblem& problem) {
    return problem.message;
  }
  return {};
}

TEST(ElementTable, KnowsBothFormatsTetrahedraAndTriangles) {
  EXPECT_EQ(gmsh_element(kGmshTetrahedron).nodes, 4);
  EXPECT_EQ(gmsh_element(kGmshTriangle).dimension, 2);
  EXPECT_EQ(vtk_element(kVtkTetrahedron).nodes, 4);
  EXPECT_EQ(vtk_element(kVtkTriangle).dimension, 2);
  EXPECT_EQ(gmsh_element(11).nodes, 10);
  EXPECT_EQ(vtk_element(24).nodes, 10);
}

TEST(ElementTable, AnUnknownTypeIsRefused) {
  EXPECT_THAT(refused([] { (void)gmsh_element(999); }), HasSubstr("type 999 is unknown"));
  EXPECT_THAT(refused([] { (void)vtk_element(-1); }), HasSubstr("type -1 is unknown"));
}

TEST(ElementTable, WhatWouldGetLostIsNamedWithItsCount) {
  OtherElements others;
  EXPECT_EQ(refused([&] { others.check(5); }), "");
  EXPECT_EQ(refused([&] { others.check(0); }), "has no 4-node tetrahedron");
  for (int i = 0; i < 3; ++i) others.add(gmsh_element(11), 11);
  others.add(vtk_element(42), 42);
  EXPECT_THAT(refused([&] { others.check(5); }),
              AllOf(HasSubstr("3 10-node tetrahedra (type 11)"), HasSubstr("1 polyhedra (type 42)"),
                    HasSubstr("beside 5 4-node")));
  EXPECT_THAT(refused([&] { others.check(0); }),
              HasSubstr("no 4-node tetrahedron, but 3 10-node tetrahedra"));
}

}  // namespace
}  // namespace brainshift::io
