// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/vtu_writer.hpp"

#include <cassert>
#include <cstdint>

#include "common/io/files/file_access.hpp"
#include "common/io/geometry/vtk_xml_writing.hpp"

namespace brainshift::io {
namespace {

constexpr std::uint8_t kWrittenTetra = 10;
constexpr std::uint8_t kVtkQuadraticTetra = 24;

std::string cells_xml(const Eigen::MatrixXi& elements) {
  const auto cells = static_cast<std::size_t>(elements.cols());
  std::vector<std::int64_t> offsets(cells);
  for (std::size_t i = 0; i < cells; ++i) {
    offsets[i] = static_cast<std::int64_t>(i + 1) * elements.rows();
  }
  const std::vector<std::int64_t> connectivity(elements.data(), elements.data() + elements.size());
  const std::vector<std::uint8_t> types(cells,
                                        elements.rows() == 4 ? kWrittenTetra : kVtkQuadraticTetra);
  return "<Cells>\n" +
         vtk_array("connectivity", "Int64", 1, connectivity.data(), connectivity.size()) +
         vtk_array("offsets", "Int64", 1, offsets.data(), cells) +
         vtk_array("types", "UInt8", 1, types.data(), cells) + "</Cells>\n";
}

}  // namespace

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
    xml += vtk_array("label", "Int32", 1, labels.data(), labels.size());
  }
  xml += vtk_fields(cell_fields) + "</CellData>\n<Points>\n" +
         vtk_array("Points", "Float64", 3, grid.nodes.data(),
                   static_cast<std::size_t>(grid.nodes.size())) +
         "</Points>\n" + cells_xml(grid.elements) + "</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";
  return write_file(path, xml);
}

}  // namespace brainshift::io
