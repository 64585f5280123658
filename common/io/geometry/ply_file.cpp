// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/ply_file.hpp"

#include <cstdint>
#include <limits>
#include <map>
#include <sstream>
#include <vector>

#include "common/io/files/number_cursor.hpp"
#include "common/io/files/point_space.hpp"

namespace brainshift::io {
namespace {

struct Property {
  std::string name;
  std::string type;
  std::string count_type;  // not empty: a list
};

struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  std::string format;
  PointSpace space = PointSpace::kUnsaid;
  std::vector<Element> elements;
};

Header read_header(std::string_view& rest) {
  constexpr std::string_view kEnd = "end_header";
  const std::size_t end = rest.find(kEnd);
  if (rest.rfind("ply", 0) != 0 || end == std::string_view::npos)
    refuse_format("is not a PLY file");
  std::istringstream lines{std::string(rest.substr(0, end))};
  rest.remove_prefix(std::min(rest.size(), rest.find('\n', end) + 1));

  Header header;
  std::string line;
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    std::string first;
    words >> first;
    if (first == "format") words >> header.format;
    if (first == "comment" && header.space == PointSpace::kUnsaid) {
      const Result<PointSpace> said = point_space_in(line);
      if (!said) refuse_format(said.error().message);
      header.space = *said;
    }
    if (first == "element") {
      Element element;
      if (!(words >> element.name >> element.count))
        refuse_format("element without a count: " + line);
      header.elements.push_back(element);
    }
    if (first == "property") {
      if (header.elements.empty()) refuse_format("property before the first element");
      Property property;
      words >> property.type;
      if (property.type == "list") words >> property.count_type >> property.type;
      if (!(words >> property.name)) refuse_format("property without a name");
      header.elements.back().properties.push_back(property);
    }
  }
  if (header.format != "ascii" && header.format != "binary_little_endian") {
    refuse_format("PLY format '" + header.format +
                  "' is not supported: must be ascii or binary_little_endian");
  }
  return header;
}

double read_value(NumberCursor& cursor, bool ascii, const std::string& type) {
  if (ascii) return cursor.text_number<double>();
  if (type == "char" || type == "int8") return cursor.binary_number<std::int8_t>(false);
  if (type == "uchar" || type == "uint8") return cursor.binary_number<std::uint8_t>(false);
  if (type == "short" || type == "int16") return cursor.binary_number<std::int16_t>(false);
  if (type == "ushort" || type == "uint16") return cursor.binary_number<std::uint16_t>(false);
  if (type == "int" || type == "int32") return cursor.binary_number<std::int32_t>(false);
  if (type == "uint" || type == "uint32") return cursor.binary_number<std::uint32_t>(false);
  if (type == "float" || type == "float32") {
    return static_cast<double>(cursor.binary_number<float>(false));
  }
  if (type == "double" || type == "float64") return cursor.binary_number<double>(false);
  refuse_format("property type '" + type + "' is unknown");
}

int ply_index(double value) {
  const bool fits = value >= 0.0 && value <= std::numeric_limits<int>::max();
  return fits ? static_cast<int>(value) : -1;  // the caller's index check names it
}

// One entry of an element: scalars by name; a list of vertex indices goes to `indices`.
void read_entry(NumberCursor& cursor, bool ascii, const Element& element,
                std::map<std::string, double>& scalars, std::vector<int>& indices) {
  indices.clear();
  for (const Property& property : element.properties) {
    if (property.count_type.empty()) {
      scalars[property.name] = read_value(cursor, ascii, property.type);
      continue;
    }
    const double count = read_value(cursor, ascii, property.count_type);
    if (!(count >= 0.0) || count > static_cast<double>(cursor.rest().size())) {
      refuse_format("a list promises an impossible number of entries");
    }
    const bool is_face = property.name == "vertex_indices" || property.name == "vertex_index";
    for (int k = 0; k < static_cast<int>(count); ++k) {
      const double value = read_value(cursor, ascii, property.type);
      if (is_face) indices.push_back(ply_index(value));
    }
  }
}

TriangleSurface read_ply(std::string_view rest) {
  const Header header = read_header(rest);
  NumberCursor cursor(rest);
  const bool ascii = header.format == "ascii";
  TriangleSurface surface;
  for (const Element& element : header.elements) {
    if (element.properties.empty()) continue;
    // Every entry takes at least a byte.
    if (element.count > cursor.rest().size())
      refuse_format("element '" + element.name + "' ends too early");
    const auto count = static_cast<Eigen::Index>(element.count);
    if (element.name == "vertex") surface.vertices.resize(3, count);
    if (element.name == "face") surface.triangles.resize(3, count);
    std::map<std::string, double> scalars;
    std::vector<int> indices;
    for (Eigen::Index i = 0; i < count; ++i) {
      read_entry(cursor, ascii, element, scalars, indices);
      if (element.name == "vertex") {
        if (scalars.count("x") + scalars.count("y") + scalars.count("z") != 3) {
          refuse_format("element 'vertex' lacks x, y or z");
        }
        surface.vertices.col(i) << scalars["x"], scalars["y"], scalars["z"];
      }
      if (element.name == "face") {
        if (indices.size() != 3) {
          refuse_format("face " + std::to_string(i) + " has " + std::to_string(indices.size()) +
                        " vertices: must have 3");
        }
        surface.triangles.col(i) << indices[0], indices[1], indices[2];
      }
    }
  }
  turn_to_ras(header.space, surface.vertices);
  return surface;
}

}  // namespace

Result<TriangleSurface> parse_ply(const std::string& content) {
  try {
    return read_ply(content);
  } catch (const FormatProblem& problem) {
    return fail(ErrorCode::kUnreadable, problem.message);
  }
}

}  // namespace brainshift::io
