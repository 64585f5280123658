// SPDX-License-Identifier: Apache-2.0
#include "common/igtl/poly_data.hpp"

#include <array>
#include <utility>

#include "common/igtl/bytes.hpp"

namespace brainshift::igtl {
namespace {

constexpr std::size_t kPolyHeaderBytes = 40;
constexpr std::size_t kAttributeHeaderBytes = 6;
constexpr std::size_t kPolyPointBytes = 12;
constexpr std::size_t kMaxNameBytes = 255;
constexpr int kMaxScalarComponents = 127;  // igtlPolyDataMessage.h
constexpr std::uint8_t kOfCells = 0x10;
constexpr std::uint8_t kKindMask = 0x0f;

std::string too_many_attributes(std::size_t count) {
  return std::to_string(count) + " attributes, must be at most " + std::to_string(kMaxAttributes);
}

// 0: any number that a scalar may have.
int components_of(AttributeKind kind) {
  switch (kind) {
    case AttributeKind::kScalar: return 0;
    case AttributeKind::kVector:
    case AttributeKind::kNormal: return 3;
    case AttributeKind::kTensor: return 9;
    case AttributeKind::kRgba: return 4;
  }
  return 0;
}

Status validate(const Cells& cells, std::string_view name, std::uint64_t points) {
  std::uint64_t count = 0;
  for (std::size_t at = 0; at < cells.numbers.size(); ++count) {
    const std::size_t size = cells.numbers[at++];
    if (size > cells.numbers.size() - at) {
      return invalid(std::string(name) + ": a cell of " + std::to_string(size) + " points, " +
                     std::to_string(cells.numbers.size() - at) + " numbers are left");
    }
    for (const std::size_t end = at + size; at < end; ++at) {
      if (cells.numbers[at] >= points) {
        return invalid(std::string(name) + ": point " + std::to_string(cells.numbers[at]) + ", " +
                       std::to_string(points) + " are there");
      }
    }
  }
  if (count != cells.count) {
    return invalid(std::string(name) + ": " + std::to_string(cells.count) + " cells stated, " +
                   std::to_string(count) + " are there");
  }
  return {};
}

Status validate(const Attribute& attribute, std::uint64_t points) {
  if (Status status = check_padded("attribute name", attribute.name, kMaxNameBytes); !status) {
    return status;
  }
  const auto components = attribute.values.rows();
  const int expected = components_of(attribute.kind);
  const bool right = expected == 0 ? components >= 1 && components <= kMaxScalarComponents
                                   : components == expected;
  if (!right) {
    return invalid("attribute \"" + attribute.name + "\" has " + std::to_string(components) +
                   " components, must have " +
                   (expected == 0 ? "1 to 127" : std::to_string(expected)));
  }
  const bool colour_table = attribute.kind == AttributeKind::kRgba;
  const auto tuples = static_cast<std::uint64_t>(attribute.values.cols());
  if (!attribute.of_cells && !colour_table && tuples != points) {
    return invalid("attribute \"" + attribute.name + "\" has " + std::to_string(tuples) +
                   " tuples for " + std::to_string(points) + " points");
  }
  return {};
}

void append_cells(const Cells& cells, std::string& out) {
  for (const std::uint32_t number : cells.numbers) append_number(out, number);
}

void append_attributes(const std::vector<Attribute>& attributes, std::string& out) {
  for (const Attribute& attribute : attributes) {
    const auto kind = static_cast<std::uint8_t>(attribute.kind);
    append_number(out, static_cast<std::uint8_t>(attribute.of_cells ? kind | kOfCells : kind));
    append_number(out, static_cast<std::uint8_t>(attribute.values.rows()));
    append_number(out, static_cast<std::uint32_t>(attribute.values.cols()));
  }
  std::size_t name_bytes = 0;
  for (const Attribute& attribute : attributes) {
    out.append(attribute.name).push_back('\0');
    name_bytes += attribute.name.size() + 1;
  }
  if (name_bytes % 2 != 0) out.push_back('\0');
  for (const Attribute& attribute : attributes) {
    for (Eigen::Index i = 0; i < attribute.values.size(); ++i) {
      append_number(out, attribute.values.data()[i]);
    }
  }
}

// What the header says of one array of cells.
struct CellSizes {
  std::uint32_t count = 0;
  std::uint32_t bytes = 0;
};

Result<Cells> take_cells(ByteReader& reader, const CellSizes& sizes, std::string_view name) {
  if (sizes.bytes > reader.left()) return does_not_fit(name, sizes.bytes, reader.left());
  if (sizes.bytes % sizeof(std::uint32_t) != 0) {
    return malformed(std::string(name) + " of " + std::to_string(sizes.bytes) +
                     " bytes, must be a multiple of 4");
  }
  Cells cells;
  cells.count = sizes.count;
  cells.numbers.resize(sizes.bytes / sizeof(std::uint32_t));
  for (std::uint32_t& number : cells.numbers) number = reader.number<std::uint32_t>();
  return cells;
}

// Precondition: numbers * 4 bytes are left.
void take_reals(ByteReader& reader, float* to, std::size_t numbers) {
  for (std::size_t i = 0; i < numbers; ++i) to[i] = reader.real();
}

struct AttributeSizes {
  int components = 0;
  std::uint32_t tuples = 0;
};

// Everything of an attribute but its name and values.
Result<AttributeSizes> take_attribute_header(ByteReader& reader, Attribute& attribute) {
  const auto kind = reader.number<std::uint8_t>();
  if ((kind & kKindMask) > static_cast<std::uint8_t>(AttributeKind::kRgba) ||
      (kind & ~(kKindMask | kOfCells)) != 0) {
    return malformed("attribute kind " + std::to_string(kind) + " is unknown");
  }
  attribute.kind = static_cast<AttributeKind>(kind & kKindMask);
  attribute.of_cells = (kind & kOfCells) != 0;
  AttributeSizes sizes;
  sizes.components = reader.number<std::uint8_t>();
  sizes.tuples = reader.number<std::uint32_t>();
  return sizes;
}

Result<std::string> take_name(ByteReader& reader) {
  const std::size_t end = reader.rest().substr(0, kMaxNameBytes + 1).find('\0');
  if (end == std::string_view::npos) {
    return malformed("attribute name does not end within 256 bytes");
  }
  std::string name(reader.take(end));
  reader.take(1);
  return name;
}

Result<std::vector<Attribute>> take_attributes(ByteReader& reader, std::uint32_t count) {
  if (count > kMaxAttributes) return malformed(too_many_attributes(count));
  if (std::uint64_t{count} * kAttributeHeaderBytes > reader.left()) {
    return does_not_fit("attribute headers", std::uint64_t{count} * kAttributeHeaderBytes,
                        reader.left());
  }
  std::vector<Attribute> attributes(count);
  std::vector<AttributeSizes> sizes;
  for (Attribute& attribute : attributes) {
    auto header = take_attribute_header(reader, attribute);
    if (!header) return tl::unexpected<Error>(std::move(header.error()));
    sizes.push_back(*header);
  }
  std::size_t name_bytes = 0;
  for (Attribute& attribute : attributes) {
    auto name = take_name(reader);
    if (!name) return tl::unexpected<Error>(std::move(name.error()));
    attribute.name = std::move(*name);
    name_bytes += attribute.name.size() + 1;
  }
  if (name_bytes % 2 != 0) {
    if (reader.left() == 0) return does_not_fit("padding of the names", 1, 0);
    reader.take(1);
  }
  for (std::size_t i = 0; i < attributes.size(); ++i) {
    const std::uint64_t numbers = std::uint64_t{sizes[i].tuples} * sizes[i].components;
    if (numbers * sizeof(float) > reader.left()) {
      return does_not_fit("attribute \"" + attributes[i].name + "\"", numbers * sizeof(float),
                          reader.left());
    }
    // No components: no number either, whatever the tuples are; validate() refuses it.
    if (sizes[i].components == 0) continue;
    attributes[i].values.resize(sizes[i].components, sizes[i].tuples);
    take_reals(reader, attributes[i].values.data(), numbers);
  }
  return attributes;
}

// ---- surfaces ----

class TriangleList {
 public:
  void add(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    if (a == b || b == c || c == a) return;
    indices_.insert(indices_.end(),
                    {static_cast<int>(a), static_cast<int>(b), static_cast<int>(c)});
  }
  Eigen::Matrix<int, 3, Eigen::Dynamic> matrix() const {
    return Eigen::Map<const Eigen::Matrix<int, 3, Eigen::Dynamic>>(
        indices_.data(), 3, static_cast<Eigen::Index>(indices_.size() / 3));
  }

 private:
  std::vector<int> indices_;
};

// Calls use(indices of the cell, their number) for each cell.
template <typename Use>
void for_each_cell(const Cells& cells, const Use& use) {
  for (std::size_t at = 0; at < cells.numbers.size();) {
    const std::size_t size = cells.numbers[at++];
    use(cells.numbers.data() + at, size);
    at += size;
  }
}

}  // namespace

void Cells::add(std::initializer_list<std::uint32_t> cell) {
  numbers.push_back(static_cast<std::uint32_t>(cell.size()));
  numbers.insert(numbers.end(), cell);
  ++count;
}

bool operator==(const Attribute& a, const Attribute& b) {
  return a.name == b.name && a.kind == b.kind && a.of_cells == b.of_cells &&
         a.values.rows() == b.values.rows() && a.values.cols() == b.values.cols() &&
         a.values == b.values;
}

bool operator==(const PolyData& a, const PolyData& b) {
  return a.points.cols() == b.points.cols() && a.points == b.points && a.vertices == b.vertices &&
         a.lines == b.lines && a.polygons == b.polygons && a.triangle_strips == b.triangle_strips &&
         a.attributes == b.attributes;
}

Status validate(const PolyData& data) {
  if (!data.points.allFinite()) return fail(ErrorCode::kNotFinite, "a point is not finite");
  const auto points = static_cast<std::uint64_t>(data.points.cols());
  const std::pair<const Cells*, std::string_view> arrays[] = {
      {&data.vertices, "vertices"},
      {&data.lines, "lines"},
      {&data.polygons, "polygons"},
      {&data.triangle_strips, "triangle strips"}};
  for (const auto& [cells, name] : arrays) {
    if (Status status = validate(*cells, name, points); !status) return status;
  }
  if (data.attributes.size() > kMaxAttributes) {
    return invalid(too_many_attributes(data.attributes.size()));
  }
  for (const Attribute& attribute : data.attributes) {
    if (Status status = validate(attribute, points); !status) return status;
  }
  return {};
}

void append_content(const PolyData& data, std::string& out) {
  append_number(out, static_cast<std::uint32_t>(data.points.cols()));
  const Cells* arrays[] = {&data.vertices, &data.lines, &data.polygons, &data.triangle_strips};
  for (const Cells* cells : arrays) {
    append_number(out, cells->count);
    append_number(out, static_cast<std::uint32_t>(cells->numbers.size() * sizeof(std::uint32_t)));
  }
  append_number(out, static_cast<std::uint32_t>(data.attributes.size()));
  for (Eigen::Index i = 0; i < data.points.size(); ++i) append_number(out, data.points.data()[i]);
  for (const Cells* cells : arrays) append_cells(*cells, out);
  append_attributes(data.attributes, out);
}

Result<PolyData> decode_poly_data(std::string_view content) {
  if (content.size() < kPolyHeaderBytes) return wrong_size(content, "at least ", kPolyHeaderBytes);
  ByteReader reader(content);
  const auto points = reader.number<std::uint32_t>();
  std::array<CellSizes, 4> sizes;
  for (CellSizes& size : sizes) {
    size.count = reader.number<std::uint32_t>();
    size.bytes = reader.number<std::uint32_t>();
  }
  const auto attributes = reader.number<std::uint32_t>();

  if (std::uint64_t{points} * kPolyPointBytes > reader.left()) {
    return does_not_fit("points", std::uint64_t{points} * kPolyPointBytes, reader.left());
  }
  PolyData data;
  data.points.resize(3, points);
  take_reals(reader, data.points.data(), std::size_t{points} * 3);
  const std::pair<Cells*, std::string_view> arrays[] = {{&data.vertices, "vertices"},
                                                        {&data.lines, "lines"},
                                                        {&data.polygons, "polygons"},
                                                        {&data.triangle_strips, "triangle strips"}};
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    auto cells = take_cells(reader, sizes[i], arrays[i].second);
    if (!cells) return tl::unexpected<Error>(std::move(cells.error()));
    *arrays[i].first = std::move(*cells);
  }
  auto decoded = take_attributes(reader, attributes);
  if (!decoded) return tl::unexpected<Error>(std::move(decoded.error()));
  data.attributes = std::move(*decoded);
  if (reader.left() != 0) {
    return malformed(std::to_string(reader.left()) + " bytes after the last attribute");
  }
  if (const Status status = validate(data); !status) return malformed(status.error().message);
  return data;
}

PolyData from_surface(const TriangleSurface& surface) {
  PolyData data;
  data.points = surface.vertices.cast<float>();
  data.polygons.numbers.reserve(4 * static_cast<std::size_t>(surface.num_triangles()));
  for (int t = 0; t < surface.num_triangles(); ++t) {
    const auto corner = [&](int i) { return static_cast<std::uint32_t>(surface.triangles(i, t)); };
    data.polygons.add({corner(0), corner(1), corner(2)});
  }
  return data;
}

Result<TriangleSurface> to_surface(const PolyData& data) {
  TriangleList triangles;
  for_each_cell(data.polygons, [&](const std::uint32_t* cell, std::size_t size) {
    for (std::size_t i = 2; i < size; ++i) triangles.add(cell[0], cell[i - 1], cell[i]);
  });
  for_each_cell(data.triangle_strips, [&](const std::uint32_t* cell, std::size_t size) {
    for (std::size_t i = 2; i < size; ++i) {
      const bool swapped = i % 2 != 0;
      triangles.add(cell[swapped ? i - 1 : i - 2], cell[swapped ? i - 2 : i - 1], cell[i]);
    }
  });
  TriangleSurface surface;
  surface.triangles = triangles.matrix();
  if (surface.num_triangles() == 0) {
    return fail(ErrorCode::kEmptySet, "POLYDATA has no triangle: neither polygons nor strips");
  }
  surface.vertices = data.points.cast<double>();
  return surface;
}

}  // namespace brainshift::igtl
