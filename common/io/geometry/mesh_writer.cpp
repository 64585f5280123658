// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/mesh_writer.hpp"

#include <bit>
#include <cassert>
#include <cstdint>
#include <numeric>
#include <string>
#include <string_view>

#include "common/io/files/binary_codec.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/geometry/mesh_file.hpp"

namespace brainshift::io {
namespace {

static_assert(std::endian::native == std::endian::little, "a PLY file is written little-endian");

// ---- VTK's XML container: base64 of zlib blocks, in this machine's byte order ----

// Readers expand one block at a time; 1 MiB compresses as well as larger ones.
constexpr std::size_t kBlockSize = std::size_t{1} << 20;

// The string "RAS", as VTK writes strings: character codes, each string ended by a 0.
constexpr const char* kSpaceIsRas =
    "<FieldData>\n<Array type=\"String\" Name=\"SPACE\" NumberOfTuples=\"1\" format=\"ascii\">"
    "82 65 83 0</Array>\n</FieldData>\n";

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '"': out += "&quot;"; break;
      default: out += c;
    }
  }
  return out;
}

// Bytes as the content of a DataArray: a header [blocks][block size][size of a partial last block,
// or 0][compressed sizes], then the blocks; both are base64 streams of their own, as VTK writes
// them.
std::string vtk_encoded(std::string_view bytes) {
  std::string blocks;
  std::string sizes;
  std::uint64_t count = 0;
  for (std::size_t at = 0; at < bytes.size(); at += kBlockSize, ++count) {
    const std::string block = zlib_compress(bytes.substr(at, kBlockSize));
    append_number<std::uint64_t>(sizes, block.size());
    blocks += block;
  }
  std::string header;
  append_number<std::uint64_t>(header, count);
  append_number<std::uint64_t>(header, kBlockSize);
  append_number<std::uint64_t>(header, bytes.size() % kBlockSize);
  return base64_encode(header + sizes) + base64_encode(blocks);
}

// type: VTK's name of T, e.g. "Float64".
template <typename T>
std::string vtk_array(const std::string& name, const std::string& type, Eigen::Index components,
                      const T* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size * sizeof(T));
  return "<DataArray type=\"" + type + "\" Name=\"" + escaped(name) + "\" NumberOfComponents=\"" +
         std::to_string(components) + "\" format=\"binary\">" + vtk_encoded(bytes) +
         "</DataArray>\n";
}

template <typename T>
std::string vtk_array(const std::string& name, const std::string& type,
                      const std::vector<T>& values) {
  return vtk_array(name, type, 1, values.data(), values.size());
}

std::string vtk_points(const Points& points) {
  return "<Points>\n" +
         vtk_array("Points", "Float64", 3, points.data(), static_cast<std::size_t>(points.size())) +
         "</Points>\n";
}

std::string vtk_fields(const std::vector<NodeField>& fields) {
  std::string xml;
  for (const NodeField& field : fields) {
    xml += vtk_array(field.name, "Float64", field.values.rows(), field.values.data(),
                     static_cast<std::size_t>(field.values.size()));
  }
  return xml;
}

// Up to and with the opening tag of the data set, e.g. "UnstructuredGrid", and its field data: the
// string array SPACE = "RAS". 3D Slicer takes points for LPS, which mirrors them, unless a file
// says this (Slicer, vtkMRMLModelStorageNode.cxx).
std::string vtk_heading(const std::string& grid) {
  return "<?xml version=\"1.0\"?>\n<VTKFile type=\"" + grid + "\" version=\"1.0\" byte_order=\"" +
         (std::endian::native == std::endian::little ? "LittleEndian" : "BigEndian") +
         "\" header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\n<" + grid + ">\n" +
         kSpaceIsRas;
}

// kInvalidArgument names file and field unless every field has `columns` columns, one per `what`.
Status check_vtk_fields(const std::filesystem::path& path, const std::vector<NodeField>& fields,
                        Eigen::Index columns, const std::string& what) {
  for (const NodeField& field : fields) {
    if (field.values.cols() == columns && field.values.rows() > 0) continue;
    return invalid(path.string() + ": field '" + field.name + "' has " +
                   std::to_string(field.values.cols()) + " columns: must have one per " + what +
                   ", " + std::to_string(columns));
  }
  return {};
}

// Cells, one per column, of as many nodes as there are rows.
template <typename Cells>
std::string vtk_cells(const Cells& cells) {
  std::vector<std::int64_t> offsets(static_cast<std::size_t>(cells.cols()));
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    offsets[i] = static_cast<std::int64_t>(i + 1) * cells.rows();
  }
  const std::vector<std::int64_t> connectivity(cells.data(), cells.data() + cells.size());
  return vtk_array("connectivity", "Int64", connectivity) + vtk_array("offsets", "Int64", offsets);
}

// ---- surfaces ----

Result<std::string> ply_text(const TriangleSurface& surface, const std::vector<NodeField>& fields) {
  std::string text = "ply\nformat binary_little_endian 1.0\ncomment mm RAS\nelement vertex " +
                     std::to_string(surface.num_vertices()) +
                     "\nproperty double x\nproperty double y\nproperty double z\n";
  for (const NodeField& field : fields) {
    if (field.values.rows() != 1 || field.name.find_first_of(" \t\n") != std::string::npos) {
      return invalid("field '" + field.name +
                     "': a PLY file takes one number per vertex, of a name without blanks");
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

// Points without triangles are cells of one vertex each, so that viewers draw them.
std::string verts_xml(const TriangleSurface& surface) {
  Eigen::RowVectorXi each(surface.num_vertices());
  std::iota(each.begin(), each.end(), 0);
  return "<Verts>\n" + vtk_cells(each) + "</Verts>\n";
}

std::string vtp_text(const TriangleSurface& surface, const std::vector<NodeField>& fields) {
  const bool points_only = surface.num_triangles() == 0;
  return vtk_heading("PolyData") + "<Piece NumberOfPoints=\"" +
         std::to_string(surface.num_vertices()) + "\" NumberOfVerts=\"" +
         std::to_string(points_only ? surface.num_vertices() : 0) + "\" NumberOfPolys=\"" +
         std::to_string(surface.num_triangles()) + "\">\n<PointData>\n" + vtk_fields(fields) +
         "</PointData>\n" + vtk_points(surface.vertices) + (points_only ? verts_xml(surface) : "") +
         "<Polys>\n" + vtk_cells(surface.triangles) +
         "</Polys>\n</Piece>\n</PolyData>\n</VTKFile>\n";
}

}  // namespace

Status write_surface(const std::filesystem::path& path, const TriangleSurface& surface,
                     const std::vector<NodeField>& vertex_fields) {
  if (Status ok = check_vtk_fields(path, vertex_fields, surface.vertices.cols(), "vertex"); !ok)
    return ok;
  const std::string extension = lower_extension(path);
  if (extension == ".vtp") return write_file(path, vtp_text(surface, vertex_fields));
  if (extension != ".ply") {
    return unreadable(path,
                      "unknown surface format '" + extension + "' to write: must be .ply or .vtp");
  }
  const auto text = ply_text(surface, vertex_fields);
  if (!text) return file_error(path, text.error());
  return write_file(path, *text);
}

// ---- tetrahedra ----

Status write_vtu(const std::filesystem::path& path, const TetMesh& mesh,
                 const std::vector<NodeField>& node_fields) {
  return write_vtu(path, ElementGrid{mesh.nodes, mesh.tets, mesh.labels}, node_fields, {});
}

Status write_vtu(const std::filesystem::path& path, const ElementGrid& grid,
                 const std::vector<NodeField>& node_fields,
                 const std::vector<NodeField>& cell_fields) {
  if (Status ok = check_vtk_fields(path, node_fields, grid.nodes.cols(), "node"); !ok) return ok;
  if (Status ok = check_vtk_fields(path, cell_fields, grid.elements.cols(), "element"); !ok)
    return ok;
  assert(grid.elements.rows() == 4 || grid.elements.rows() == 10);
  assert(grid.labels.empty() ||
         static_cast<Eigen::Index>(grid.labels.size()) == grid.elements.cols());

  std::string xml = vtk_heading("UnstructuredGrid");
  xml += "<Piece NumberOfPoints=\"" + std::to_string(grid.nodes.cols()) + "\" NumberOfCells=\"" +
         std::to_string(grid.elements.cols()) + "\">\n<PointData>\n" + vtk_fields(node_fields) +
         "</PointData>\n<CellData>\n";
  if (!grid.labels.empty()) {
    const std::vector<std::int32_t> labels(grid.labels.begin(), grid.labels.end());
    xml += vtk_array("label", "Int32", labels);
  }
  constexpr std::uint8_t kLinearTetra = 10, kQuadraticTetra = 24;
  const std::vector<std::uint8_t> types(static_cast<std::size_t>(grid.elements.cols()),
                                        grid.elements.rows() == 4 ? kLinearTetra : kQuadraticTetra);
  xml += vtk_fields(cell_fields) + "</CellData>\n" + vtk_points(grid.nodes) + "<Cells>\n" +
         vtk_cells(grid.elements) + vtk_array("types", "UInt8", types) +
         "</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";
  return write_file(path, xml);
}

}  // namespace brainshift::io
