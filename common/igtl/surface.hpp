// SPDX-License-Identifier: Apache-2.0
// Triangle surfaces as POLYDATA, and back. Points in mm RAS, rounded to single precision.
#pragma once

#include "common/core/mesh.hpp"
#include "common/igtl/poly_data.hpp"

namespace brainshift::igtl {

// One polygon for each triangle, in the same order; no attribute.
PolyData from_surface(const TriangleSurface& surface);

// Polygons as fans round their first point, triangle strips with alternating orientation. Vertices
// and lines are left out, and triangles that name a point twice, which strips use as joints.
// kEmptySet: no triangle. Precondition: validate(data).
Result<TriangleSurface> to_surface(const PolyData& data);

}  // namespace brainshift::igtl
