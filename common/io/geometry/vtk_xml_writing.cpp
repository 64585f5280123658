// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/vtk_xml_writing.hpp"

#include <bit>
#include <cstdint>

#include "common/io/files/binary_codec.hpp"

namespace brainshift::io {
namespace {

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

// Header [blocks][block size][size of a partial last block, or 0][compressed sizes], then the
// blocks; header and blocks are base64 streams of their own, as VTK writes them.
}  // namespace

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

std::string vtk_array_of_bytes(const std::string& name, const std::string& type,
                               Eigen::Index components, std::string_view bytes) {
  return "<DataArray type=\"" + type + "\" Name=\"" + escaped(name) + "\" NumberOfComponents=\"" +
         std::to_string(components) + "\" format=\"binary\">" + vtk_encoded(bytes) +
         "</DataArray>\n";
}

std::string vtk_heading(const std::string& grid) {
  return "<?xml version=\"1.0\"?>\n<VTKFile type=\"" + grid + "\" version=\"1.0\" byte_order=\"" +
         (std::endian::native == std::endian::little ? "LittleEndian" : "BigEndian") +
         "\" header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\n<" + grid + ">\n" +
         kSpaceIsRas;
}

Status check_vtk_fields(const std::filesystem::path& path, const std::vector<NodeField>& fields,
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

std::string vtk_fields(const std::vector<NodeField>& fields) {
  std::string xml;
  for (const NodeField& field : fields) {
    xml += vtk_array(field.name, "Float64", field.values.rows(), field.values.data(),
                     static_cast<std::size_t>(field.values.size()));
  }
  return xml;
}

}  // namespace brainshift::io
