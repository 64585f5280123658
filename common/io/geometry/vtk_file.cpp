// SPDX-License-Identifier: GPL-3.0-or-later
// .vtu and .vtp files: VtkXmlFile gives arrays by name, whatever their encoding is; the functions
// behind it say what they mean.
#include <fmt/format.h>

#include <bit>
#include <charconv>
#include <cstdint>
#include <limits>
#include <map>
#include <pugixml.hpp>

#include "common/io/files/binary_codec.hpp"
#include "common/io/files/number_cursor.hpp"
#include "common/io/files/point_space.hpp"
#include "common/io/geometry/element_table.hpp"
#include "common/io/geometry/mesh_formats.hpp"

namespace brainshift::io {
namespace {

// deflate cannot do better than about 1032:1; a header that promises more lies.
constexpr std::size_t kLargestBlockExpansion = 1040;

struct VtkArray {
  std::string name;
  std::string type;  // "Float32", "Int64", ...
  int components = 1;
  std::vector<double> reals;           // for Float32 and Float64
  std::vector<std::int64_t> integers;  // for all others

  bool is_real() const { return type == "Float32" || type == "Float64"; }
};

template <typename T>
void append_all(const std::string& bytes, bool swap, VtkArray& array) {
  const auto append = [&](auto& numbers) {
    numbers.reserve(bytes.size() / sizeof(T));
    for (std::size_t i = 0; i + sizeof(T) <= bytes.size(); i += sizeof(T)) {
      numbers.push_back(static_cast<typename std::decay_t<decltype(numbers)>::value_type>(
          load_number<T>(bytes.data() + i, swap)));
    }
  };
  if constexpr (std::is_floating_point_v<T>) {
    append(array.reals);
  } else {
    append(array.integers);
  }
}

struct VtkType {
  std::size_t bytes;
  void (*append)(const std::string& bytes, bool swap, VtkArray& array);
};

template <typename T>
constexpr VtkType kTypeOf = {sizeof(T), append_all<T>};

// Null for an unknown name.
const VtkType* vtk_type(const std::string& name) {
  static const std::map<std::string, VtkType> kTypes = {
      {"Int8", kTypeOf<std::int8_t>},   {"UInt8", kTypeOf<std::uint8_t>},
      {"Int16", kTypeOf<std::int16_t>}, {"UInt16", kTypeOf<std::uint16_t>},
      {"Int32", kTypeOf<std::int32_t>}, {"UInt32", kTypeOf<std::uint32_t>},
      {"Int64", kTypeOf<std::int64_t>}, {"UInt64", kTypeOf<std::uint64_t>},
      {"Float32", kTypeOf<float>},      {"Float64", kTypeOf<double>}};
  const auto found = kTypes.find(name);
  return found == kTypes.end() ? nullptr : &found->second;
}

// All numbers of white-space separated text; false at anything else.
template <typename T>
bool parse_numbers(std::string_view text, std::vector<T>& out) {
  const char* at = text.data();
  const char* end = at + text.size();
  while (true) {
    while (at != end && (*at == ' ' || *at == '\n' || *at == '\r' || *at == '\t')) ++at;
    if (at == end) return true;
    T value{};
    const auto [stop, error] = std::from_chars(at, end, value);
    if (error != std::errc()) return false;
    out.push_back(value);
    at = stop;
  }
}

struct Encoding {
  bool swap = false;
  bool wide_header = false;  // UInt64 block headers
  bool compressed = false;
};

std::size_t read_header_number(ByteSource& source, const Encoding& encoding) {
  const std::string bytes = value_of(source.read(encoding.wide_header ? 8 : 4));
  return encoding.wide_header
             ? static_cast<std::size_t>(load_number<std::uint64_t>(bytes.data(), encoding.swap))
             : static_cast<std::size_t>(load_number<std::uint32_t>(bytes.data(), encoding.swap));
}

// [blocks][block size][last block size or 0][compressed sizes...] then the blocks.
std::string read_compressed(ByteSource& source, const Encoding& encoding) {
  std::size_t header[3];
  for (std::size_t& number : header) number = read_header_number(source, encoding);
  const auto [blocks, block_size, last_size] = header;
  if (blocks > source.remaining()) refuse_format("more blocks promised than bytes are left");
  std::vector<std::size_t> sizes(blocks);
  for (std::size_t& size : sizes) size = read_header_number(source, encoding);

  std::string out;
  for (std::size_t i = 0; i < blocks; ++i) {
    const std::size_t expanded = i + 1 == blocks && last_size != 0 ? last_size : block_size;
    if (sizes[i] > source.remaining() || expanded / kLargestBlockExpansion > sizes[i]) {
      refuse_format("a block's size is impossible");
    }
    out += value_of(zlib_expand(value_of(source.read(sizes[i])), expanded));
  }
  return out;
}

std::string read_block(ByteSource&& source, const Encoding& encoding) {
  if (encoding.compressed) return read_compressed(source, encoding);
  return value_of(source.read(read_header_number(source, encoding)));
}

class VtkXmlFile {
 public:
  // `content` is the whole file; `grid` the data set type, e.g. "UnstructuredGrid".
  VtkXmlFile(std::string content, const std::string& grid) : content_(std::move(content)) {
    cut_appended();
    std::string xml_text = content_;
    if (appended_.data() != nullptr) {
      xml_text.resize(xml_text.find("<AppendedData"));
      xml_text += "</VTKFile>";
    }
    const pugi::xml_parse_result parsed = xml_.load_buffer(xml_text.data(), xml_text.size());
    if (!parsed) refuse_format(std::string("is not well-formed XML: ") + parsed.description());
    find_piece(grid);
  }

  // What SPACE, a string array of the field data, says. It must be text, and one text.
  PointSpace space() const {
    for (const pugi::xml_node& node : grid_.child("FieldData").children()) {
      if (std::string_view(node.attribute("Name").as_string()) != "SPACE") continue;
      return value_of(
          parse_point_space(placed("FieldData array 'SPACE' ", [&] { return text_of(node); })));
    }
    return PointSpace::kUnsaid;
  }

  // An integer attribute of the piece, e.g. "NumberOfPoints"; 0 when absent.
  std::int64_t count(const std::string& attribute) const {
    const std::string text = piece_.attribute(attribute.c_str()).as_string("0");
    std::vector<std::int64_t> values;
    // Mesh indices are int.
    if (!parse_numbers(text, values) || values.size() != 1 || values[0] < 0 ||
        values[0] > std::numeric_limits<int>::max()) {
      refuse_format(attribute + " = " + text + ": must be a count");
    }
    return values[0];
  }

  // Arrays of a section of the piece ("Points", "Cells", "PointData"), without decoding.
  std::vector<pugi::xml_node> arrays(const std::string& section) const {
    const auto nodes = piece_.child(section.c_str()).children("DataArray");
    return {nodes.begin(), nodes.end()};
  }

  // The index-th array of a section; `tuples` is the expected number, or -1 to take what the file
  // has (connectivity, whose length no attribute tells).
  VtkArray array(const std::string& section, std::size_t index, std::int64_t tuples) const {
    const std::vector<pugi::xml_node> nodes = arrays(section);
    if (index >= nodes.size()) refuse_format(section + " has no array");
    const pugi::xml_node& node = nodes[index];
    VtkArray array;
    array.name = node.attribute("Name").as_string();
    array.type = node.attribute("type").as_string();
    array.components = node.attribute("NumberOfComponents").as_int(1);
    const std::string place = section + " array '" + array.name + "'";
    if (vtk_type(array.type) == nullptr) {
      refuse_format(place + " has unknown type '" + array.type + "'");
    }
    if (array.components < 1) refuse_format(place + " has no components");
    placed(place + ": ", [&] { fill(node, array); });
    const std::size_t size = array.is_real() ? array.reals.size() : array.integers.size();
    if (tuples >= 0 &&
        size != static_cast<std::size_t>(tuples) * static_cast<std::size_t>(array.components)) {
      refuse_format(fmt::format("{} has {} numbers: must have {} x {}", place, size, tuples,
                                array.components));
    }
    return array;
  }

  // By name.
  VtkArray array(const std::string& section, const std::string& name, std::int64_t tuples) const {
    const std::vector<pugi::xml_node> nodes = arrays(section);
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      if (nodes[i].attribute("Name").as_string() == name) return array(section, i, tuples);
    }
    refuse_format(section + " has no array '" + name + "'");
  }

 private:
  // Raw appended data are no XML, so they are cut out before parsing.
  void cut_appended() {
    const std::size_t begin = content_.find("<AppendedData");
    if (begin == std::string::npos) return;
    const std::size_t close = content_.find('>', begin);
    const std::size_t underscore = content_.find('_', close);
    if (close == std::string::npos || underscore == std::string::npos) {
      refuse_format("AppendedData has no data");
    }
    appended_is_raw_ =
        content_.substr(begin, close - begin).find("\"base64\"") == std::string::npos;
    appended_ = std::string_view(content_).substr(underscore + 1);
    if (!appended_is_raw_) appended_ = appended_.substr(0, appended_.find('<'));
  }

  void find_piece(const std::string& grid_name) {
    const pugi::xml_node root = xml_.child("VTKFile");
    if (!root) refuse_format("is not a VTK XML file");
    const std::string type = root.attribute("type").as_string();
    if (type != grid_name) refuse_format("holds '" + type + "': must be '" + grid_name + "'");
    const std::string compressor = root.attribute("compressor").as_string();
    if (!compressor.empty() && compressor != "vtkZLibDataCompressor") {
      refuse_format("compressor '" + compressor + "' is not supported: must be zlib or none");
    }
    const std::string_view order = root.attribute("byte_order").as_string("LittleEndian");
    encoding_.swap = (order == "BigEndian") == (std::endian::native == std::endian::little);
    const std::string_view numbers = root.attribute("header_type").as_string("UInt32");
    encoding_.wide_header = numbers == "UInt64";
    encoding_.compressed = !compressor.empty();
    grid_ = root.child(grid_name.c_str());
    piece_ = grid_.child("Piece");
    if (!piece_) refuse_format("has no Piece");
    if (piece_.next_sibling("Piece")) refuse_format("has several pieces: must have one");
  }

  std::string bytes_of(const pugi::xml_node& node) const {
    const std::string format = node.attribute("format").as_string();
    if (format == "binary") return read_block(Base64Source(node.text().get()), encoding_);
    if (format != "appended") refuse_format("format '" + format + "' is unknown");
    const auto offset =
        node.attribute("offset").as_ullong(std::numeric_limits<std::uint64_t>::max());
    if (offset >= appended_.size()) refuse_format("offset lies behind the appended data");
    const std::string_view from = appended_.substr(offset);
    return appended_is_raw_ ? read_block(RawSource(from), encoding_)
                            : read_block(Base64Source(from), encoding_);
  }

  // VTK writes a text as the codes of its characters and a 0: as numbers (ascii) or as bytes.
  std::string text_of(const pugi::xml_node& node) const {
    const std::string type = node.attribute("type").as_string();
    if (type != "String") refuse_format("has type '" + type + "': must be String");
    std::string text;
    if (std::string(node.attribute("format").as_string("ascii")) == "ascii") {
      std::vector<int> codes;
      if (!parse_numbers(std::string_view(node.text().get()), codes)) {
        refuse_format("holds something that is not the code of a character");
      }
      for (const int code : codes) {
        if (code < 0 || code > 255) refuse_format("holds a code that is no character");
        text.push_back(static_cast<char>(code));
      }
    } else {
      text = bytes_of(node);
    }
    if (!text.empty() && text.back() == '\0') text.pop_back();
    if (text.find('\0') != std::string::npos) refuse_format("holds several texts: must be one");
    return text;
  }

  void fill(const pugi::xml_node& node, VtkArray& array) const {
    const VtkType& type = *vtk_type(array.type);
    if (std::string(node.attribute("format").as_string("ascii")) == "ascii") {
      const std::string_view text = node.text().get();
      const bool ok =
          array.is_real() ? parse_numbers(text, array.reals) : parse_numbers(text, array.integers);
      if (!ok) refuse_format("holds something that is not a number of type " + array.type);
      return;
    }
    const std::string bytes = bytes_of(node);
    if (bytes.size() % type.bytes != 0) refuse_format("ends inside a number");
    type.append(bytes, encoding_.swap, array);
  }

  std::string content_;
  pugi::xml_document xml_;
  pugi::xml_node grid_;
  pugi::xml_node piece_;
  Encoding encoding_;
  std::string_view appended_;  // of content_, after the underscore
  bool appended_is_raw_ = false;
};

Points read_points(const VtkXmlFile& file) {
  const std::int64_t count = file.count("NumberOfPoints");
  const VtkArray array = file.array("Points", 0, count);
  if (array.components != 3 || !array.is_real()) {
    refuse_format("Points must have three real components");
  }
  Points points = as_columns<3>(array.reals);
  turn_to_ras(file.space(), points);
  return points;
}

// Cells as ranges of a connectivity list.
struct CellList {
  std::vector<std::int64_t> connectivity;
  std::vector<std::int64_t> offsets;  // one past the end of each cell

  std::int64_t begin(std::size_t cell) const { return cell == 0 ? 0 : offsets[cell - 1]; }
  std::int64_t size(std::size_t cell) const { return offsets[cell] - begin(cell); }
  // Vertex k of a cell. Out-of-range values become -1, which the caller's index check names.
  int vertex(std::size_t cell, int k) const {
    const std::int64_t value = connectivity[static_cast<std::size_t>(begin(cell) + k)];
    return value < 0 || value > std::numeric_limits<int>::max() ? -1 : static_cast<int>(value);
  }
};

CellList read_cells(const VtkXmlFile& file, const std::string& section, std::int64_t count) {
  CellList cells;
  cells.offsets = file.array(section, "offsets", count).integers;
  cells.connectivity = file.array(section, "connectivity", -1).integers;
  const auto end = static_cast<std::int64_t>(cells.connectivity.size());
  for (std::size_t i = 0; i < cells.offsets.size(); ++i) {
    if (cells.size(i) >= 0 && cells.offsets[i] >= 0 && cells.offsets[i] <= end) continue;
    refuse_format(fmt::format("{} offset {} is {}: must grow and not exceed {}", section, i,
                              cells.offsets[i], end));
  }
  if (static_cast<std::int64_t>(cells.offsets.size()) != count) {
    refuse_format(section + " offsets must be integers");
  }
  return cells;
}

// Empty without an array "label".
std::vector<std::int64_t> read_labels(const VtkXmlFile& file, std::int64_t cells) {
  for (const pugi::xml_node& node : file.arrays("CellData")) {
    if (std::string_view(node.attribute("Name").as_string()) != "label") continue;
    VtkArray array = file.array("CellData", "label", cells);
    if (array.components != 1 || array.is_real()) {
      refuse_format("CellData array 'label' must be one integer per cell");
    }
    for (const std::int64_t label : array.integers) {
      if (label < std::numeric_limits<int>::min() || label > std::numeric_limits<int>::max()) {
        refuse_format(fmt::format("label {} is out of range", label));
      }
    }
    return std::move(array.integers);
  }
  return {};
}

// Triangles count when the file labels its cells; without labels they have no group.
GroupedMesh read_grouped(const VtkXmlFile& file) {
  GroupedMesh result;
  TetMesh& mesh = result.mesh;
  mesh.nodes = read_points(file);
  const std::int64_t count = file.count("NumberOfCells");
  const CellList cells = read_cells(file, "Cells", count);
  const VtkArray types = file.array("Cells", "types", count);
  if (types.is_real()) refuse_format("Cells array 'types' must be integers");
  const std::vector<std::int64_t> labels = read_labels(file, count);

  std::vector<int> tets, triangles;
  OtherElements others;
  for (std::size_t cell = 0; cell < types.integers.size(); ++cell) {
    const std::int64_t type = types.integers[cell];
    const bool tetra = type == kVtkTetrahedron;
    const bool labelled = !labels.empty();
    const ElementKind& kind = vtk_element(type);
    if (!tetra && !(type == kVtkTriangle && labelled)) {
      const bool lost = kind.dimension == 3 || (kind.dimension == 2 && labelled);
      if (lost) others.add(kind, type);
      continue;
    }
    const int vertices = tetra ? 4 : 3;
    if (cells.size(cell) != vertices) {
      refuse_format(fmt::format("cell {} is a {} with {} vertices: must have {}", cell,
                                tetra ? "tetrahedron" : "triangle", cells.size(cell), vertices));
    }
    for (int k = 0; k < vertices; ++k) (tetra ? tets : triangles).push_back(cells.vertex(cell, k));
    if (!labelled) continue;
    (tetra ? mesh.labels : result.triangle_labels).push_back(static_cast<int>(labels[cell]));
  }
  others.check(static_cast<std::int64_t>(tets.size() / 4));
  mesh.tets = as_columns<4>(tets);
  result.triangles = as_columns<3>(triangles);
  return result;
}

}  // namespace

Result<MeshWithFields> parse_vtu(std::string content) {
  return format_problems_as_errors([&] {
    const VtkXmlFile file(std::move(content), "UnstructuredGrid");
    MeshWithFields result{read_grouped(file).mesh, {}};
    const std::size_t arrays = file.arrays("PointData").size();
    for (std::size_t i = 0; i < arrays; ++i) {
      const std::string type = file.arrays("PointData")[i].attribute("type").as_string();
      if (type != "Float32" && type != "Float64") continue;
      const VtkArray array = file.array("PointData", i, result.mesh.num_nodes());
      Eigen::MatrixXd values = Eigen::Map<const Eigen::MatrixXd>(
          array.reals.data(), array.components, result.mesh.num_nodes());
      if (values.rows() == 3) turn_to_ras(file.space(), values);
      result.node_fields.push_back({array.name, std::move(values)});
    }
    return result;
  });
}

Result<GroupedMesh> parse_grouped_vtu(std::string content) {
  return format_problems_as_errors(
      [&] { return read_grouped(VtkXmlFile(std::move(content), "UnstructuredGrid")); });
}

Result<TriangleSurface> parse_vtp(std::string content) {
  return format_problems_as_errors([&] {
    const VtkXmlFile file(std::move(content), "PolyData");
    TriangleSurface surface;
    surface.vertices = read_points(file);
    const std::int64_t strips = file.count("NumberOfStrips");
    const std::int64_t count = file.count("NumberOfPolys");
    if (strips > 0) refuse_format("has triangle strips: must have triangles");
    const CellList cells = read_cells(file, "Polys", count);
    surface.triangles.resize(3, count);
    for (std::size_t cell = 0; cell < cells.offsets.size(); ++cell) {
      if (cells.size(cell) != 3) {
        refuse_format(
            fmt::format("polygon {} has {} vertices: must have 3", cell, cells.size(cell)));
      }
      for (int k = 0; k < 3; ++k) {
        surface.triangles(k, static_cast<Eigen::Index>(cell)) = cells.vertex(cell, k);
      }
    }
    return surface;
  });
}

}  // namespace brainshift::io
