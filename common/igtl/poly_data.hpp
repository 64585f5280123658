// SPDX-License-Identifier: Apache-2.0
// POLYDATA: points, cells between them, and numbers on either, like VTK's vtkPolyData.
//
// Content (big-endian):
//   10 uint32  number of points; number and bytes of vertices, lines, polygons, triangle strips;
//              number of attributes
//   points     3 float32 each
//   cells      the four arrays; a cell is uint32: number of points, their indices from 0 on
//   headers    of each attribute: kind (1 byte), components (1 byte), number of tuples (uint32)
//   names      of each attribute, ended by NUL; one NUL more where these bytes are odd in number
//   values     of each attribute: float32, tuple by tuple
//
// A reader in 3D Slicer gets VERTICES wrong and polygons right: send polygons (SlicerOpenIGTLink).
// The library's reader takes every attribute of cells for a tensor (igtl_polydata.c, up to 3.1):
// send attributes of points.
// Source: Documents/Protocol/polydata.md of github.com/openigtlink/OpenIGTLink.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/core/types.hpp"

namespace brainshift::igtl {

// Cells as the message has them: number of points, their indices, and so on.
struct Cells {
  std::uint32_t count = 0;
  std::vector<std::uint32_t> numbers;

  void add(std::initializer_list<std::uint32_t> cell);
  friend bool operator==(const Cells&, const Cells&) = default;
};

enum class AttributeKind : std::uint8_t {
  kScalar = 0,  // 1 to 127 components
  kVector = 1,  // 3
  kNormal = 2,  // 3
  kTensor = 3,  // 9
  kRgba = 4,    // 4
};

struct Attribute {
  std::string name;  // up to 255 bytes
  AttributeKind kind = AttributeKind::kScalar;
  bool of_cells = false;
  Eigen::MatrixXf values;  // components x tuples

  friend bool operator==(const Attribute& a, const Attribute& b);
};

struct PolyData {
  static constexpr std::string_view kType = "POLYDATA";

  Eigen::Matrix3Xf points;  // mm
  Cells vertices;
  Cells lines;
  Cells polygons;
  Cells triangle_strips;
  std::vector<Attribute> attributes;

  friend bool operator==(const PolyData& a, const PolyData& b);
};

// An attribute takes ten times the memory of its header; nobody sends more than a few.
inline constexpr std::size_t kMaxAttributes = 256;

// kInvalidArgument: more than kMaxAttributes attributes, cells whose numbers do not add up, an
// index
// beyond the points, an attribute with the wrong number of components, an attribute of points whose
// tuples are not as many as the points (a colour table, RGBA, may have its own number), a name that
// is too long or holds a NUL.
// kNotFinite: a point. The values of an attribute may be anything.
Status validate(const PolyData& data);

// Precondition: validate().
void append_content(const PolyData& data, std::string& out);

// kProtocol: sizes that do not fit the content, or what validate() refuses. Every size is compared
// with what is left of the content before memory is taken for it.
Result<PolyData> decode_poly_data(std::string_view content);

// ---- triangle surfaces as POLYDATA, and back: points in mm RAS, in single precision ----

// One polygon for each triangle, in the same order; no attribute.
PolyData from_surface(const TriangleSurface& surface);

// Polygons as fans round their first point, triangle strips with alternating orientation. Vertices
// and lines are left out, and triangles that name a point twice, which strips use as joints.
// kEmptySet: no triangle. Precondition: validate(data).
Result<TriangleSurface> to_surface(const PolyData& data);

}  // namespace brainshift::igtl
