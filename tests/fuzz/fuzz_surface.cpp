// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces and points: STL, PLY, OBJ, VTP, XYZ.
#include "common/io/geometry/mesh_file.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/fuzz/scratch_file.hpp"

namespace brainshift::fuzz {

void run(std::string_view bytes) {
  for (const char* name : {"s.stl", "s.ply", "s.obj", "s.vtp", "s.xyz", "s.csv"}) {
    const auto surface = io::read_surface_or_points(scratch_file(name, bytes));
    if (!surface) continue;
    require(surface->vertices.allFinite(), "points lie somewhere");
    if (surface->num_triangles() == 0) continue;
    require(surface->triangles.minCoeff() >= 0 &&
                surface->triangles.maxCoeff() < surface->num_vertices(),
            "triangles have points of the surface");
  }
}

}  // namespace brainshift::fuzz
