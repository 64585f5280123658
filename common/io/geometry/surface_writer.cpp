// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/surface_writer.hpp"

#include <bit>
#include <cstdint>

#include "common/io/files/binary_codec.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/geometry/mesh_file.hpp"
#include "common/io/geometry/vtk_xml_writing.hpp"

namespace brainshift::io {
namespace {

static_assert(std::endian::native == std::endian::little, "a PLY file is written little-endian");

Result<std::string> ply_text(const TriangleSurface& surface, const std::vector<NodeField>& fields) {
  std::string text = "ply\nformat binary_little_endian 1.0\ncomment mm RAS\nelement vertex " +
                     std::to_string(surface.num_vertices()) +
                     "\nproperty double x\nproperty double y\nproperty double z\n";
  for (const NodeField& field : fields) {
    if (field.values.rows() != 1 || field.name.find_first_of(" \t\n") != std::string::npos) {
      return fail(ErrorCode::kInvalidArgument,
                  "field '" + field.name +
                      "': a PLY file takes one number per vertex, of a name "
                      "without blanks");
    }
    text += "property double " + field.name + "\n";
  }
  if (surface.num_triangles() > 0) {
    text += "element face " + std::to_string(surface.num_triangles()) +
            "\nproperty list uchar int vertex_indices\n";
  }
  text += "end_header\n";
  for (Eigen::Index i = 0; i < surface.vertices.cols(); ++i) {
    for (const double x : surface.vertices.col(i)) append_number(text, x);
    for (const NodeField& field : fields) append_number(text, field.values(0, i));
  }
  for (Eigen::Index t = 0; t < surface.triangles.cols(); ++t) {
    append_number(text, std::uint8_t{3});
    for (const int v : surface.triangles.col(t)) append_number(text, static_cast<std::int32_t>(v));
  }
  return text;
}

std::string polys_xml(const TriangleSurface& surface) {
  const auto triangles = static_cast<std::size_t>(surface.num_triangles());
  const std::vector<std::int64_t> connectivity(surface.triangles.data(),
                                               surface.triangles.data() + surface.triangles.size());
  std::vector<std::int64_t> offsets(triangles);
  for (std::size_t i = 0; i < triangles; ++i) offsets[i] = 3 * static_cast<std::int64_t>(i + 1);
  return "<Polys>\n" +
         vtk_array("connectivity", "Int64", 1, connectivity.data(), connectivity.size()) +
         vtk_array("offsets", "Int64", 1, offsets.data(), triangles) + "</Polys>\n";
}

// Points without triangles are cells of one vertex each, so that viewers draw them.
std::string verts_xml(const TriangleSurface& surface) {
  std::vector<std::int64_t> connectivity, offsets;
  for (int i = 0; i < surface.num_vertices(); ++i) {
    connectivity.push_back(i);
    offsets.push_back(i + 1);
  }
  return "<Verts>\n" +
         vtk_array("connectivity", "Int64", 1, connectivity.data(), connectivity.size()) +
         vtk_array("offsets", "Int64", 1, offsets.data(), offsets.size()) + "</Verts>\n";
}

std::string vtp_text(const TriangleSurface& surface, const std::vector<NodeField>& fields) {
  const bool points_only = surface.num_triangles() == 0;
  return vtk_heading("PolyData") + "<Piece NumberOfPoints=\"" +
         std::to_string(surface.num_vertices()) + "\" NumberOfVerts=\"" +
         std::to_string(points_only ? surface.num_vertices() : 0) + "\" NumberOfPolys=\"" +
         std::to_string(surface.num_triangles()) + "\">\n<PointData>\n" + vtk_fields(fields) +
         "</PointData>\n<Points>\n" +
         vtk_array("Points", "Float64", 3, surface.vertices.data(),
                   static_cast<std::size_t>(surface.vertices.size())) +
         "</Points>\n" + (points_only ? verts_xml(surface) : "") + polys_xml(surface) +
         "</Piece>\n</PolyData>\n</VTKFile>\n";
}

}  // namespace

Status write_surface(const std::filesystem::path& path, const TriangleSurface& surface,
                     const std::vector<NodeField>& vertex_fields) {
  if (Status ok = check_vtk_fields(path, vertex_fields, surface.vertices.cols(), "vertex"); !ok)
    return ok;
  const std::string extension = lower_extension(path);
  if (extension == ".vtp") return write_file(path, vtp_text(surface, vertex_fields));
  if (extension != ".ply") {
    return file_error(ErrorCode::kUnreadable, path,
                      "unknown surface format '" + extension + "' to write: must be .ply or .vtp");
  }
  const auto text = ply_text(surface, vertex_fields);
  if (!text) return file_error(text.error().code, path, text.error().message);
  return write_file(path, *text);
}

}  // namespace brainshift::io
