// SPDX-License-Identifier: GPL-3.0-or-later
// write_vtu of mesh_file.hpp.
#include <bit>
#include <cassert>
#include <cstdint>

#include "common/io/binary_codec.hpp"
#include "common/io/file_access.hpp"
#include "common/io/mesh_file.hpp"

namespace brainshift::io {
namespace {

// Readers expand one block at a time; 1 MiB compresses as well as larger ones.
constexpr std::size_t kBlockSize = std::size_t{1} << 20;
constexpr std::uint8_t kVtkTetra = 10;
constexpr std::uint8_t kVtkQuadraticTetra = 24;

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

// Header [blocks][block size][size of a partial last block, or 0][compressed sizes], then the blocks;
// header and blocks are base64 streams of their own, as VTK writes them.
std::string encoded(std::string_view bytes) {
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

template <typename T>
std::string data_array(const std::string& name, const std::string& type, Eigen::Index components,
                       const T* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size * sizeof(T));
  return "<DataArray type=\"" + type + "\" Name=\"" + escaped(name) + "\" NumberOfComponents=\"" +
         std::to_string(components) + "\" format=\"binary\">" + encoded(bytes) + "</DataArray>\n";
}

std::string cells_xml(const Eigen::MatrixXi& elements) {
  const auto cells = static_cast<std::size_t>(elements.cols());
  std::vector<std::int64_t> offsets(cells);
  for (std::size_t i = 0; i < cells; ++i) {
    offsets[i] = static_cast<std::int64_t>(i + 1) * elements.rows();
  }
  const std::vector<std::int64_t> connectivity(elements.data(), elements.data() + elements.size());
  const std::vector<std::uint8_t> types(cells,
                                        elements.rows() == 4 ? kVtkTetra : kVtkQuadraticTetra);
  return "<Cells>\n" +
         data_array("connectivity", "Int64", 1, connectivity.data(), connectivity.size()) +
         data_array("offsets", "Int64", 1, offsets.data(), cells) +
         data_array("types", "UInt8", 1, types.data(), cells) + "</Cells>\n";
}

Status check_columns(const std::filesystem::path& path, const std::vector<NodeField>& fields,
                     Eigen::Index columns, const std::string& what) {
  for (const NodeField& field : fields) {
    if (field.values.cols() == columns && field.values.rows() > 0) continue;
    return fail(ErrorCode::kInvalidArgument, path.string() + ": field '" + field.name + "' has " +
                                                 std::to_string(field.values.cols()) +
                                                 " columns: must have one per " + what + ", " +
                                                 std::to_string(columns));
  }
  return {};
}

std::string fields_xml(const std::vector<NodeField>& fields) {
  std::string xml;
  for (const NodeField& field : fields) {
    xml += data_array(field.name, "Float64", field.values.rows(), field.values.data(),
                      static_cast<std::size_t>(field.values.size()));
  }
  return xml;
}

}  // namespace

Status write_vtu(const std::filesystem::path& path, const TetMesh& mesh,
                 const std::vector<NodeField>& node_fields) {
  return write_vtu(path, ElementGrid{mesh.nodes, mesh.tets, mesh.labels}, node_fields, {});
}

Status write_vtu(const std::filesystem::path& path, const ElementGrid& grid,
                 const std::vector<NodeField>& node_fields,
                 const std::vector<NodeField>& cell_fields) {
  if (Status ok = check_columns(path, node_fields, grid.nodes.cols(), "node"); !ok) return ok;
  if (Status ok = check_columns(path, cell_fields, grid.elements.cols(), "element"); !ok) return ok;
  assert(grid.elements.rows() == 4 || grid.elements.rows() == 10);
  assert(grid.labels.empty() ||
         static_cast<Eigen::Index>(grid.labels.size()) == grid.elements.cols());

  std::string xml = "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" ";
  xml += std::string("byte_order=\"") +
         (std::endian::native == std::endian::little ? "LittleEndian" : "BigEndian") +
         "\" header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\n<UnstructuredGrid>\n";
  xml += "<Piece NumberOfPoints=\"" + std::to_string(grid.nodes.cols()) + "\" NumberOfCells=\"" +
         std::to_string(grid.elements.cols()) + "\">\n<PointData>\n" + fields_xml(node_fields) +
         "</PointData>\n<CellData>\n";
  if (!grid.labels.empty()) {
    const std::vector<std::int32_t> labels(grid.labels.begin(), grid.labels.end());
    xml += data_array("label", "Int32", 1, labels.data(), labels.size());
  }
  xml += fields_xml(cell_fields) + "</CellData>\n<Points>\n" +
         data_array("Points", "Float64", 3, grid.nodes.data(),
                    static_cast<std::size_t>(grid.nodes.size())) +
         "</Points>\n" + cells_xml(grid.elements) + "</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";
  return write_file(path, xml);
}

}  // namespace brainshift::io
