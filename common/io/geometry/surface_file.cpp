// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces and point clouds out of .stl, .ply, .obj and plain text; mesh_formats.hpp says what of
// each format is read.
#include <fmt/format.h>

#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <sstream>
#include <utility>

#include "common/io/files/binary_codec.hpp"
#include "common/io/files/csv_numbers.hpp"
#include "common/io/files/nrrd_header.hpp"
#include "common/io/files/number_cursor.hpp"
#include "common/io/files/point_space.hpp"
#include "common/io/files/table.hpp"
#include "common/io/geometry/mesh_formats.hpp"

namespace brainshift::io {
namespace {

// ---- .stl ----

constexpr std::size_t kStlHeader = 84;  // 80 bytes of text, 4 of count
constexpr std::size_t kStlFacet = 50;   // normal, three corners (floats), 2 bytes of attributes

// Merges corners whose coordinates are equal bit for bit (after making -0 into 0): programs write
// a shared vertex with the same digits each time.
class CornerMerger {
 public:
  void add_corner(double x, double y, double z) {
    const std::array<double, 3> key = {x + 0.0, y + 0.0, z + 0.0};
    const auto [entry, is_new] = index_.emplace(key, static_cast<int>(index_.size()));
    if (is_new) coordinates_.insert(coordinates_.end(), key.begin(), key.end());
    corners_.push_back(entry->second);
  }
  std::size_t corners() const { return corners_.size(); }
  TriangleSurface surface() const { return {as_columns<3>(coordinates_), as_columns<3>(corners_)}; }

 private:
  std::map<std::array<double, 3>, int> index_;
  std::vector<double> coordinates_;
  std::vector<int> corners_;
};

TriangleSurface read_stl_binary(const std::string& content, std::size_t triangles) {
  CornerMerger builder;
  for (std::size_t t = 0; t < triangles; ++t) {
    const char* at = content.data() + kStlHeader + t * kStlFacet + 12;
    for (int corner = 0; corner < 3; ++corner, at += 12) {
      const float x = load_number<float>(at, false);
      const float y = load_number<float>(at + 4, false);
      const float z = load_number<float>(at + 8, false);
      // NaN would break the order of the merging map.
      if (!(std::isfinite(x) && std::isfinite(y) && std::isfinite(z))) {
        refuse_format(fmt::format("triangle {} has a coordinate that is not finite", t));
      }
      builder.add_corner(x, y, z);
    }
  }
  return builder.surface();
}

std::string_view next_word(std::string_view& text) {
  constexpr std::string_view kSpace = " \t\r\n";
  const std::size_t begin = text.find_first_not_of(kSpace);
  if (begin == std::string_view::npos) {
    text = {};
    return {};
  }
  const std::size_t end = std::min(text.find_first_of(kSpace, begin), text.size());
  const std::string_view word = text.substr(begin, end - begin);
  text.remove_prefix(end);
  return word;
}

bool parse_real(std::string_view word, double& value) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc() && stop == word.data() + word.size() && std::isfinite(value);
}

TriangleSurface read_stl_ascii(std::string_view text) {
  CornerMerger builder;
  std::size_t loops = 0;
  bool ended = false;
  // Keywords in any case: some programs write them in capitals.
  for (std::string word = lower_case(next_word(text)); !word.empty();
       word = lower_case(next_word(text))) {
    if (word == "endsolid") ended = true;
    if (word == "endloop" && builder.corners() != 3 * ++loops) {
      refuse_format(fmt::format("facet {} does not have three vertices", loops - 1));
    }
    if (word != "vertex") continue;
    double p[3];
    for (double& coordinate : p) {
      const std::string_view number = next_word(text);
      if (!parse_real(number, coordinate)) {
        refuse_format(fmt::format("vertex coordinate '{}' of facet {} is not a finite number",
                                  number, loops));
      }
    }
    builder.add_corner(p[0], p[1], p[2]);
  }
  if (!ended || builder.corners() != 3 * loops) refuse_format("ends before endsolid");
  return builder.surface();
}

TriangleSurface as_ras(TriangleSurface surface, std::string_view heading) {
  turn_to_ras(value_of(point_space_in(heading.substr(0, heading.find('\0')))), surface.vertices);
  return surface;
}

TriangleSurface read_stl(const std::string& content) {
  const std::string_view text(content);
  // A binary file may begin with "solid" too, so the size decides.
  if (content.size() >= kStlHeader) {
    const std::size_t triangles = load_number<std::uint32_t>(content.data() + 80, false);
    if (content.size() == kStlHeader + triangles * kStlFacet) {
      return as_ras(read_stl_binary(content, triangles), text.substr(0, 80));
    }
  }
  if (lower_case(text.substr(0, 5)) == "solid") {
    return as_ras(read_stl_ascii(content), text.substr(0, text.find('\n')));
  }
  refuse_format("is neither an ASCII STL nor a binary one of the promised size");
}

// ---- .ply ----

struct PlyProperty {
  std::string name;
  std::string type;
  std::string count_type;  // not empty: a list
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  std::string format;
  PointSpace space = PointSpace::kUnsaid;
  std::vector<PlyElement> elements;
};

PlyHeader read_ply_header(std::string_view& rest) {
  constexpr std::string_view kEnd = "end_header";
  const std::size_t end = rest.find(kEnd);
  if (rest.rfind("ply", 0) != 0 || end == std::string_view::npos)
    refuse_format("is not a PLY file");
  std::istringstream lines{std::string(rest.substr(0, end))};
  rest.remove_prefix(std::min(rest.size(), rest.find('\n', end) + 1));

  PlyHeader header;
  std::string line;
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    std::string first;
    words >> first;
    if (first == "format") words >> header.format;
    if (first == "comment" && header.space == PointSpace::kUnsaid) {
      header.space = value_of(point_space_in(line));
    }
    if (first == "element") {
      PlyElement element;
      if (!(words >> element.name >> element.count))
        refuse_format("element without a count: " + line);
      header.elements.push_back(element);
    }
    if (first == "property") {
      if (header.elements.empty()) refuse_format("property before the first element");
      PlyProperty property;
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

double read_ply_value(NumberCursor& cursor, bool ascii, const std::string& type) {
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
void read_ply_entry(NumberCursor& cursor, bool ascii, const PlyElement& element,
                    std::map<std::string, double>& scalars, std::vector<int>& indices) {
  indices.clear();
  for (const PlyProperty& property : element.properties) {
    if (property.count_type.empty()) {
      scalars[property.name] = read_ply_value(cursor, ascii, property.type);
      continue;
    }
    const double count = read_ply_value(cursor, ascii, property.count_type);
    if (!(count >= 0.0) || count > static_cast<double>(cursor.rest().size())) {
      refuse_format("a list promises an impossible number of entries");
    }
    const bool is_face = property.name == "vertex_indices" || property.name == "vertex_index";
    for (int k = 0; k < static_cast<int>(count); ++k) {
      const double value = read_ply_value(cursor, ascii, property.type);
      if (is_face) indices.push_back(ply_index(value));
    }
  }
}

TriangleSurface read_ply(std::string_view rest) {
  const PlyHeader header = read_ply_header(rest);
  NumberCursor cursor(rest);
  const bool ascii = header.format == "ascii";
  TriangleSurface surface;
  for (const PlyElement& element : header.elements) {
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
      read_ply_entry(cursor, ascii, element, scalars, indices);
      if (element.name == "vertex") {
        if (scalars.count("x") + scalars.count("y") + scalars.count("z") != 3) {
          refuse_format("element 'vertex' lacks x, y or z");
        }
        surface.vertices.col(i) << scalars["x"], scalars["y"], scalars["z"];
      }
      if (element.name == "face") {
        if (indices.size() != 3) {
          refuse_format(fmt::format("face {} has {} vertices: must have 3", i, indices.size()));
        }
        surface.triangles.col(i) << indices[0], indices[1], indices[2];
      }
    }
  }
  turn_to_ras(header.space, surface.vertices);
  return surface;
}

// ---- .obj ----

// "7/1/3" -> 7
bool parse_vertex_number(const std::string& word, long long& number) {
  std::istringstream in(word.substr(0, word.find('/')));
  return static_cast<bool>(in >> number) && in.peek() == std::istringstream::traits_type::eof();
}

TriangleSurface read_obj(const std::string& content) {
  std::istringstream lines(content);
  std::vector<double> coordinates;
  std::vector<int> corners;
  PointSpace space = PointSpace::kUnsaid;
  std::string text;
  for (int line = 1; std::getline(lines, text); ++line) {
    const std::string place = "line " + std::to_string(line) + ": ";
    std::istringstream words(text);
    std::string first;
    words >> first;
    if (!first.empty() && first.front() == '#' && space == PointSpace::kUnsaid) {
      space = placed(place, [&] { return value_of(point_space_in(text)); });
    } else if (first == "v") {
      double x = 0.0, y = 0.0, z = 0.0;
      if (!(words >> x >> y >> z)) refuse_format(place + "vertex without three coordinates");
      coordinates.insert(coordinates.end(), {x, y, z});
    } else if (first == "f") {
      const auto known = static_cast<long long>(coordinates.size() / 3);
      std::string word;
      int count = 0;
      while (words >> word) {
        long long number = 0;
        if (!parse_vertex_number(word, number)) {
          refuse_format(fmt::format("{}'{}' is no vertex", place, word));
        }
        const long long index = number < 0 ? known + number : number - 1;
        const bool fits = number != 0 && index >= 0 && index <= std::numeric_limits<int>::max();
        if (!fits) refuse_format(fmt::format("{}vertex {} does not exist", place, word));
        corners.push_back(static_cast<int>(index));
        ++count;
      }
      if (count != 3) {
        refuse_format(fmt::format("{}face has {} vertices: must have 3", place, count));
      }
    }
  }

  TriangleSurface surface{as_columns<3>(coordinates), as_columns<3>(corners)};
  turn_to_ras(space, surface.vertices);
  return surface;
}

// ---- points ----

constexpr std::string_view kBetween = " \t\r,;";

// Takes one line's numbers; the first word that is none, or "".
std::string_view take_numbers(std::string_view line, std::vector<double>& row) {
  for (std::size_t at = line.find_first_not_of(kBetween); at != std::string_view::npos;
       at = line.find_first_not_of(kBetween)) {
    line.remove_prefix(at);
    std::string_view word = line.substr(0, line.find_first_of(kBetween));
    line.remove_prefix(word.size());
    const std::string_view whole = word;
    if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
    double value = 0.0;
    const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || stop != word.data() + word.size()) return whole.substr(0, 32);
    row.push_back(value);
  }
  return {};
}

// A heading's cells and those of the rows below it: between commas where it has any, else between
// blanks, tabs or semicolons.
Cells cells_below(std::string_view line, bool commas) {
  if (commas) return quoted_cells_of(line);
  Cells cells;
  for (std::size_t at = line.find_first_not_of(kBetween); at != std::string_view::npos;
       at = line.find_first_not_of(kBetween)) {
    line.remove_prefix(at);
    cells.emplace_back(line.substr(0, line.find_first_of(kBetween)));
    line.remove_prefix(cells.back().size());
  }
  return cells;
}

// What the columns of a file are. A heading must name the coordinates; without one they are the
// first three. The comment in front of the points counts where it has as many words as they have
// numbers and names the coordinates (CloudCompare writes "//X Y Z").
class XyzColumns {
 public:
  // Takes one line that is not empty: a heading, a comment or a point.
  void take(std::string_view whole, std::vector<double>& coordinates) {
    std::string_view line = whole;
    line.remove_prefix(line.find_first_not_of(kBetween));
    const std::size_t words = line.find_first_not_of("#/ \t");
    if (line.front() == '#' || line.substr(0, 2) == "//") {
      if (const PointSpace said = value_of(point_space_in(line)); said != PointSpace::kUnsaid) {
        space_ = said;
      }
      if (first_ && words != std::string_view::npos) comment_ = line.substr(words);
      return;
    }
    const bool letter = std::isalpha(static_cast<unsigned char>(line.front())) != 0 &&
                        line.substr(0, 3) != "nan" && line.substr(0, 3) != "inf";
    const bool first = std::exchange(first_, false);
    if (first && letter && !has_number(quoted_cells_of(line))) {
      if (obey(whole)) return;
      refuse_format(fmt::format("the heading \"{}\" must name columns x,y,z or r,a,s or l,p,s",
                                trimmed(line).substr(0, 60)));
    }
    if (const bool commas = comment_.find(',') != std::string_view::npos;
        first && cells_below(comment_, commas).size() == cells_below(whole, commas).size()) {
      obey(comment_);
    }
    const std::size_t number = coordinates.size() / 3;
    if (heading_) {
      const Cells cells = cells_below(whole, commas_);  // the first cell may be empty
      if (!value_of(heading_->placed(cells))) return;
      const auto point = columns_.of(cells);
      if (!point) {
        refuse_format(
            fmt::format("point {}: \"{}\" must have three finite numbers below the heading", number,
                        trimmed(line).substr(0, 60)));
      }
      coordinates.insert(coordinates.end(), point->begin(), point->end());
      return;
    }
    row_.clear();
    if (const auto wrong = take_numbers(line, row_); !wrong.empty()) {
      refuse_format(fmt::format("\"{}\" is no number", wrong));
    }
    if (row_.size() < 3) {
      refuse_format(fmt::format("point {} has {} coordinates: must have 3", number, row_.size()));
    }
    coordinates.insert(coordinates.end(), row_.begin(), row_.begin() + 3);
  }
  PointSpace space() const { return space_; }

 private:
  bool obey(std::string_view line) {
    const bool commas = line.find(',') != std::string_view::npos;
    Heading heading(cells_below(line, commas));
    const auto named = heading.place();
    if (!named) return false;
    heading_ = std::move(heading), columns_ = *named, commas_ = commas;
    return true;
  }

  bool first_ = true, commas_ = false;
  std::optional<Heading> heading_;
  PlaceColumns columns_;
  PointSpace space_ = PointSpace::kUnsaid;
  std::string_view comment_;  // the last one in front of the points
  std::vector<double> row_;
};

// "nan" and "inf" are numbers here: the caller's check of the points names them.
TriangleSurface read_xyz(const std::string& content) {
  XyzColumns columns;
  std::vector<double> coordinates;
  std::string_view rest = content;
  int number = 0;
  try {
    while (!rest.empty()) {
      ++number;
      const std::string_view line = take_line(rest);
      if (line.find_first_not_of(kBetween) != std::string_view::npos) {
        columns.take(line, coordinates);
      }
    }
  } catch (const FormatProblem& problem) {
    refuse_format(fmt::format("line {}: {}", number, problem.message));
  }
  TriangleSurface surface;
  surface.vertices = as_columns<3>(coordinates);
  turn_to_ras(columns.space(), surface.vertices);
  return surface;
}

}  // namespace

Result<TriangleSurface> parse_stl(const std::string& content) {
  return format_problems_as_errors([&] { return read_stl(content); });
}

Result<TriangleSurface> parse_ply(const std::string& content) {
  return format_problems_as_errors([&] { return read_ply(content); });
}

Result<TriangleSurface> parse_obj(const std::string& content) {
  return format_problems_as_errors([&] { return read_obj(content); });
}

Result<TriangleSurface> parse_xyz(const std::string& content) {
  return format_problems_as_errors([&] { return read_xyz(content); });
}

}  // namespace brainshift::io
