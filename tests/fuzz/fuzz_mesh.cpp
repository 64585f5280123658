// SPDX-License-Identifier: GPL-3.0-or-later
// Volume meshes: Gmsh and VTK.
#include "common/io/geometry/mesh_file.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/fuzz/scratch_file.hpp"

namespace brainshift::fuzz {
namespace {

void check(const TetMesh& mesh) {
  require(mesh.nodes.allFinite(), "nodes lie somewhere");
  if (mesh.tets.size() == 0) return;
  require(mesh.tets.minCoeff() >= 0 && mesh.tets.maxCoeff() < mesh.num_nodes(),
          "tetrahedra have nodes of the mesh");
}

}  // namespace

void run(std::string_view bytes) {
  for (const char* name : {"mesh.msh", "mesh.vtu"}) {
    const auto path = scratch_file(name, bytes);
    if (const auto mesh = io::read_grouped_mesh(path)) check(mesh->mesh);
  }
  if (const auto mesh = io::read_vtu(scratch_file("fields.vtu", bytes))) check(mesh->mesh);
}

}  // namespace brainshift::fuzz
