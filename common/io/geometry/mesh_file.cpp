// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/mesh_file.hpp"

#include <algorithm>
#include <array>
#include <set>

#include "common/io/files/file_access.hpp"
#include "common/io/geometry/mesh_formats.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

bool is_point_format(const std::string& extension) {
  return extension == ".xyz" || extension == ".txt" || extension == ".csv" || extension == ".pts";
}

// Indices inside the node list and finite coordinates: what every later stage takes for granted.
template <typename Cells>
Status check_indices(const Points& points, const Cells& cells, const std::string& cell_name) {
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    if (!points.col(i).allFinite()) {
      return unreadable("node " + std::to_string(i) + " has a coordinate that is not finite");
    }
  }
  for (Eigen::Index c = 0; c < cells.cols(); ++c) {
    for (Eigen::Index k = 0; k < cells.rows(); ++k) {
      if (cells(k, c) >= 0 && cells(k, c) < points.cols()) continue;
      return unreadable(cell_name + " " + std::to_string(c) + " has node index " +
                        std::to_string(cells(k, c)) + ": must be between 0 and " +
                        std::to_string(points.cols() - 1));
    }
  }
  return {};
}

// Drops nodes without a tetrahedron, triangles that need one of them, and those that their group
// has already.
GroupedMesh without_unreferenced_nodes(const GroupedMesh& grouped) {
  const TetMesh& mesh = grouped.mesh;
  std::vector<int> new_index(static_cast<std::size_t>(mesh.num_nodes()), -1);
  for (Eigen::Index i = 0; i < mesh.tets.size(); ++i) {
    new_index[static_cast<std::size_t>(mesh.tets.data()[i])] = 0;
  }
  GroupedMesh kept = grouped;
  int next = 0;
  for (int node = 0; node < mesh.num_nodes(); ++node) {
    int& index = new_index[static_cast<std::size_t>(node)];
    if (index < 0) continue;
    index = next++;
    kept.mesh.nodes.col(index) = mesh.nodes.col(node);
  }
  kept.mesh.nodes.conservativeResize(Eigen::NoChange, next);
  for (Eigen::Index i = 0; i < mesh.tets.size(); ++i) {
    kept.mesh.tets.data()[i] = new_index[static_cast<std::size_t>(mesh.tets.data()[i])];
  }
  kept.triangle_labels.clear();
  std::set<std::array<int, 4>> seen;  // a group that has a triangle twice would load it twice
  Eigen::Index triangles = 0;
  for (Eigen::Index t = 0; t < grouped.triangles.cols(); ++t) {
    Eigen::Vector3i corners;
    for (int k = 0; k < 3; ++k)
      corners[k] = new_index[static_cast<std::size_t>(grouped.triangles(k, t))];
    if (corners.minCoeff() < 0) continue;
    Eigen::Vector4i key(corners[0], corners[1], corners[2],
                        grouped.triangle_labels[static_cast<std::size_t>(t)]);
    std::sort(key.data(), key.data() + 3);
    if (!seen.insert({key[0], key[1], key[2], key[3]}).second) continue;
    kept.triangles.col(triangles++) = corners;
    kept.triangle_labels.push_back(grouped.triangle_labels[static_cast<std::size_t>(t)]);
  }
  kept.triangles.conservativeResize(Eigen::NoChange, triangles);
  return kept;
}

// Drops vertices without a triangle, where there are triangles.
TriangleSurface without_unused_vertices(TriangleSurface surface) {
  if (surface.num_triangles() == 0) return surface;
  std::vector<int> new_index(static_cast<std::size_t>(surface.num_vertices()), -1);
  for (const int v : surface.triangles.reshaped()) new_index[static_cast<std::size_t>(v)] = 0;
  int next = 0;
  for (int v = 0; v < surface.num_vertices(); ++v) {
    int& index = new_index[static_cast<std::size_t>(v)];
    if (index < 0) continue;
    surface.vertices.col(index = next) = surface.vertices.col(v).eval();
    ++next;
  }
  surface.vertices.conservativeResize(Eigen::NoChange, next);
  for (int& v : surface.triangles.reshaped()) v = new_index[static_cast<std::size_t>(v)];
  return surface;
}

// Of the extension's format; possibly without triangles.
Result<TriangleSurface> parse_surface(const std::string& extension, std::string content) {
  if (extension == ".stl") return parse_stl(content);
  if (extension == ".ply") return parse_ply(content);
  if (extension == ".obj") return parse_obj(content);
  if (extension == ".vtp") return parse_vtp(std::move(content));
  return unreadable("unknown surface format '" + extension + "': must be .stl, .ply, .obj or .vtp");
}

Result<TriangleSurface> load_surface(const fs::path& path, bool points) {
  return parse_file(path, [&](std::string content) {
    auto surface =
        points ? parse_xyz(content) : parse_surface(lower_extension(path), std::move(content));
    if (!surface) return surface;
    const Status ok = check_indices(surface->vertices, surface->triangles, "triangle");
    if (!ok) return surface = tl::unexpected(ok.error());
    return surface = without_unused_vertices(std::move(*surface));
  });
}

}  // namespace

Result<GroupedMesh> read_grouped_mesh(const fs::path& path) {
  if (Status regular = check_regular_file(path); !regular) return tl::unexpected(regular.error());
  const std::string extension = lower_extension(path);
  if (extension != ".msh" && extension != ".vtu") {
    return unreadable(path, "unknown mesh format '" + extension + "': must be .msh or .vtu");
  }
  return parse_file(path, [&](std::string content) -> Result<GroupedMesh> {
    auto read = extension == ".msh" ? parse_gmsh(content) : parse_grouped_vtu(std::move(content));
    if (!read) return read;
    const Status ok = check_indices(read->mesh.nodes, read->mesh.tets, "tetrahedron").and_then([&] {
      return check_indices(read->mesh.nodes, read->triangles, "triangle");
    });
    if (!ok) return tl::unexpected(ok.error());
    return without_unreferenced_nodes(*read);
  });
}

Result<TetMesh> read_tet_mesh(const fs::path& path) {
  return read_grouped_mesh(path).map([](GroupedMesh&& read) { return std::move(read.mesh); });
}

Result<MeshWithFields> read_vtu(const fs::path& path) {
  return parse_file(path, [](std::string content) {
    Result<MeshWithFields> read = parse_vtu(std::move(content));
    if (!read) return read;
    const Status ok = check_indices(read->mesh.nodes, read->mesh.tets, "tetrahedron");
    if (!ok) read = tl::unexpected(ok.error());
    return read;
  });
}

Result<TriangleSurface> read_surface_or_points(const fs::path& path) {
  auto surface = load_surface(path, is_point_format(lower_extension(path)));
  if (surface && surface->num_vertices() == 0) return unreadable(path, "has no point");
  return surface;
}

Result<TriangleSurface> read_surface(const fs::path& path) {
  auto surface = load_surface(path, false);
  if (surface && surface->num_triangles() == 0) return unreadable(path, "has no triangle");
  return surface;
}

}  // namespace brainshift::io
