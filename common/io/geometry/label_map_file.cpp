// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/label_map_file.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <sstream>
#include <vector>

#include "common/io/files/binary_codec.hpp"
#include "common/io/files/csv_numbers.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/files/nrrd_header.hpp"
#include "common/io/geometry/image_file.hpp"
#include "common/io/geometry/mgh_file.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kMaxLabelsAlong = 32767;  // as NIfTI's
constexpr int kMaxSegments = 10000;

struct Segment {
  std::string name;
  int label = 1;
  std::int64_t layer = 0;
};

// Which axes of the file are space, and which one counts layers.
struct Axes {
  std::array<std::size_t, 3> space{};
  std::optional<std::size_t> list;
};

using LabelReader = double (*)(const char*);

template <typename T>
double value_at(const char* bytes) {
  return static_cast<double>(load_number<T>(bytes, false));
}

struct ValueType {
  int bytes;
  LabelReader read;
};

Result<ValueType> value_type(const std::string& name) {
  static const std::map<std::string, ValueType> kTypes = {
      {"int8", {1, value_at<std::int8_t>}},   {"uint8", {1, value_at<std::uint8_t>}},
      {"int16", {2, value_at<std::int16_t>}}, {"uint16", {2, value_at<std::uint16_t>}},
      {"int32", {4, value_at<std::int32_t>}}, {"uint32", {4, value_at<std::uint32_t>}},
      {"int64", {8, value_at<std::int64_t>}}, {"uint64", {8, value_at<std::uint64_t>}},
      {"float", {4, value_at<float>}},        {"double", {8, value_at<double>}}};
  const auto found = kTypes.find(name);
  if (found == kTypes.end()) {
    return unreadable("type = " + name + ": must be an integer or floating-point type");
  }
  return found->second;
}

// Signs that take the file's space to RAS.
Result<Vec3> signs_to_ras(const NrrdHeader& header) {
  const std::string space = header.word("space");
  if (space == "left-posterior-superior" || space == "lps") return Vec3(-1, -1, 1);
  if (space == "right-anterior-superior" || space == "ras") return Vec3(1, 1, 1);
  if (space == "left-anterior-superior" || space == "las") return Vec3(-1, 1, 1);
  if (space.empty()) return unreadable("space is missing, so its place is unknown");
  return unreadable("space = " + header.field("space") +
                    ": must be left-posterior-superior, right-anterior-superior or "
                    "left-anterior-superior");
}

// "(1,2,3)" off the front of `rest`; "none" gives no vector. False: neither.
bool take_vector(std::string_view& rest, std::optional<Vec3>& vector) {
  vector.reset();
  rest = trimmed(rest);
  if (lower_case(rest.substr(0, 4)) == "none") {
    rest.remove_prefix(4);
    return true;
  }
  const std::size_t end = rest.find(')');
  if (!rest.starts_with('(') || end == std::string_view::npos) return false;
  const auto cells = cells_of(rest.substr(1, end - 1));
  Vec3 value;
  if (cells.size() != 3) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!parse_number(cells[i], value[static_cast<Eigen::Index>(i)])) return false;
  }
  vector = value;
  rest.remove_prefix(end + 1);
  return true;
}

Status check_units(const NrrdHeader& header) {
  const std::string units = header.field("space units");
  for (std::size_t at = units.find('"'); at != std::string::npos; at = units.find('"', at + 1)) {
    const std::size_t end = units.find('"', at + 1);
    if (end == std::string::npos || units.substr(at + 1, end - at - 1) != "mm") {
      return unreadable("space units = " + units + ": must be mm");
    }
    at = end;
  }
  return {};
}

// A header has spacings or directions. One that has both must not contradict itself.
Status check_spacings(const NrrdHeader& header, const Axes& axes, const Mat3& directions) {
  std::istringstream spacings(header.field("spacings"));
  std::string word;
  for (std::size_t axis = 0; spacings >> word; ++axis) {
    double spacing = 0.0;
    if (!parse_number(word, spacing)) continue;  // nan: of an axis that is no space
    for (std::size_t i = 0; i < 3; ++i) {
      const double step = directions.col(static_cast<Eigen::Index>(i)).norm();
      if (axes.space[i] != axis || std::abs(spacing - step) <= kLargestStepError * step) continue;
      return unreadable(fmt::format("spacings = {}: axis {} has steps of {:g} by its direction",
                                    header.field("spacings"), axis, step));
    }
  }
  return {};
}

// Fills in where the voxels lie, and which axes they lie along.
Result<Axes> read_space(const NrrdHeader& header, VoxelImage& image) {
  const auto signs = signs_to_ras(header);
  if (!signs) return tl::unexpected(signs.error());
  if (Status ok = check_units(header); !ok) return tl::unexpected(ok.error());
  const std::string text = header.field("space directions"), where = header.field("space origin");
  if (text.empty() || where.empty()) {
    return unreadable(std::string(text.empty() ? "space directions" : "space origin") +
                      " is missing, so its place is unknown");
  }
  std::string_view rest = text;
  Axes axes;
  std::size_t spatial = 0;
  for (std::size_t axis = 0; axis < header.sizes.size(); ++axis) {
    std::optional<Vec3> direction;
    const bool read = take_vector(rest, direction);
    const bool too_many = direction ? spatial == 3 : axes.list.has_value();
    if (!read || too_many) {
      return unreadable("space directions = " + text +
                        ": must be three vectors (x,y,z), and none for an axis of layers");
    }
    if (direction) {
      image.T_ras_voxel.linear().col(static_cast<Eigen::Index>(spatial)) =
          signs->cwiseProduct(*direction);
      axes.space[spatial++] = axis;
    } else {
      axes.list = axis;
    }
  }
  std::optional<Vec3> origin;
  std::string_view origin_text = where;
  if (Status ok = check_spacings(header, axes, image.T_ras_voxel.linear()); !ok) {
    return tl::unexpected(ok.error());
  }
  if (spatial != 3 || !trimmed(rest).empty()) {
    return unreadable(fmt::format("space directions = {}: does not agree with {} sizes", text,
                                  header.sizes.size()));
  }
  if (!take_vector(origin_text, origin) || !origin || !trimmed(origin_text).empty()) {
    return unreadable("space origin = " + where + ": must be a point (x,y,z)");
  }
  image.T_ras_voxel.translation() = signs->cwiseProduct(*origin);
  const Mat3 linear = image.T_ras_voxel.linear();
  // Relative to the voxel's edges, so that the test does not depend on the voxel's size.
  if (!(std::abs(linear.determinant()) > 1e-6 * linear.colwise().norm().prod())) {
    return unreadable("space directions = " + text + ": are linearly dependent");
  }
  return axes;
}

Status read_dims(const NrrdHeader& header, const Axes& axes, VoxelImage& image) {
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int64_t size = header.sizes[axes.space[i]];
    if (size < 1 || size > kMaxLabelsAlong) {
      return unreadable(fmt::format("sizes = {}: must be 1 to {} voxels along each axis",
                                    header.field("sizes"), kMaxLabelsAlong));
    }
    image.dims[i] = static_cast<int>(size);
  }
  return {};
}

Result<int> whole_number(const NrrdHeader& header, const std::string& key, int otherwise) {
  const std::string text = header.field(key);
  if (text.empty()) return otherwise;
  int value = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || stop != end || value < 0) {
    return unreadable(fmt::format("{} = {}: must be a whole number from 0", key, text));
  }
  return value;
}

// Segments are numbered from 0 without gaps; a file without segments is a plain label map.
Result<std::vector<Segment>> read_segments(const NrrdHeader& header, const Axes& axes) {
  std::vector<Segment> segments;
  for (int i = 0; i < kMaxSegments; ++i) {
    const std::string prefix = fmt::format("Segment{}_", i);
    const auto first = header.fields.lower_bound(prefix);
    const bool there = first != header.fields.end() &&
                       !BeforeByLetters{}(first->first.substr(0, prefix.size()), prefix);
    if (!there || BeforeByLetters{}(prefix, first->first.substr(0, prefix.size()))) break;
    const auto label = whole_number(header, prefix + "LabelValue", 1);
    if (!label) return tl::unexpected(label.error());
    const auto layer = whole_number(header, prefix + "Layer", axes.list ? i : 0);
    if (!layer) return tl::unexpected(layer.error());
    std::string name = header.field(prefix + "Name");
    if (name.empty()) name = header.field(prefix + "ID");
    segments.push_back({name.empty() ? fmt::format("Segment{}", i) : name, *label, *layer});
  }
  return segments;
}

// None: the file is a plain label map.
Result<std::optional<Segment>> chosen_segment(const std::vector<Segment>& segments,
                                              const std::string& name) {
  std::string names;
  int found = 0;
  std::optional<Segment> chosen;
  for (const Segment& segment : segments) {
    names += (names.empty() ? "\"" : ", \"") + segment.name + "\"";
    if (segment.name != name && !(name.empty() && segments.size() == 1)) continue;
    chosen = segment;
    ++found;
  }
  if (segments.empty() && !name.empty()) {
    return invalid(fmt::format("names no segments, so there is none called \"{}\"", name));
  }
  if (name.empty() && segments.size() > 1) {
    return invalid(fmt::format("has {} segments: name one of {}", segments.size(), names));
  }
  if (!name.empty() && found != 1) {
    return invalid(fmt::format("has {} called \"{}\": its segments are {}",
                               found == 0 ? "no segment" : fmt::format("{} segments", found), name,
                               names));
  }
  return chosen;
}

void copy_voxels(const std::string& bytes, const ValueType& type, const NrrdHeader& header,
                 const Axes& axes, std::int64_t layer, VoxelImage& image) {
  std::array<std::size_t, 4> stride{};
  std::size_t step = static_cast<std::size_t>(type.bytes);
  for (std::size_t axis = 0; axis < header.sizes.size(); ++axis) {
    stride[axis] = step;
    step *= static_cast<std::size_t>(header.sizes[axis]);
  }
  const std::size_t start =
      axes.list ? static_cast<std::size_t>(layer) * stride[*axes.list] : std::size_t{0};
  image.values.reserve(image.num_voxels());
  const auto along = [&](std::size_t axis, int index) {
    return static_cast<std::size_t>(index) * stride[axes.space[axis]];
  };
  for (int k = 0; k < image.dims[2]; ++k) {
    for (int j = 0; j < image.dims[1]; ++j) {
      const char* row = bytes.data() + start + along(2, k) + along(1, j);
      for (int i = 0; i < image.dims[0]; ++i) {
        image.values.push_back(static_cast<float>(type.read(row + along(0, i))));
      }
    }
  }
}

Result<VoxelImage> parse_nrrd(const std::string& content, const LabelChoice& choice) {
  const auto header = parse_nrrd_header(content);
  if (!header) return tl::unexpected(header.error());
  if (header->sizes.size() != 3 && header->sizes.size() != 4) {
    return unreadable(
        fmt::format("has {} axes: must be a volume, or layers of one", header->sizes.size()));
  }
  const auto type = value_type(header->element_type);
  if (!type) return tl::unexpected(type.error());
  VoxelImage image;
  const auto axes = read_space(*header, image);
  if (!axes) return tl::unexpected(axes.error());
  if (Status ok = read_dims(*header, *axes, image); !ok) return tl::unexpected(ok.error());
  const auto segments = read_segments(*header, *axes);
  if (!segments) return tl::unexpected(segments.error());
  const auto segment = chosen_segment(*segments, choice.segment);
  if (!segment) return tl::unexpected(segment.error());
  const std::int64_t layer = *segment ? (*segment)->layer : 0;
  const std::int64_t layers = axes->list ? header->sizes[*axes->list] : 1;
  if (*segment && layer >= layers) {
    return unreadable(fmt::format("segment \"{}\" is in layer {}: the file has {}",
                                  (*segment)->name, layer, layers));
  }
  if (!*segment && layers != 1) {
    return unreadable(fmt::format("has {} layers and names no segments", layers));
  }
  const auto bytes = unpack(*header, type->bytes);
  if (!bytes) return tl::unexpected(bytes.error());
  copy_voxels(*bytes, *type, *header, *axes, layer, image);
  if (*segment) {
    const auto wanted = static_cast<float>((*segment)->label);
    const auto marked = static_cast<float>(choice.label);
    for (const float value : image.values) {
      if (value == std::round(value)) continue;
      return unreadable(fmt::format(
          "segment \"{}\": a voxel has the value {:.4g}, which is no label: resample by nearest "
          "neighbour",
          (*segment)->name, value));
    }
    for (float& value : image.values) value = value == wanted ? marked : 0.0F;
  }
  return image;
}

}  // namespace

Result<VoxelImage> read_label_map(const fs::path& path, const LabelChoice& choice) {
  const std::string extension = lower_extension(path);
  if (extension != ".nrrd" && extension != ".nhdr") {
    if (choice.segment.empty()) {
      const bool freesurfer = extension == ".mgz" || extension == ".mgh";
      return freesurfer ? read_mgh(path) : read_nifti(path);
    }
    return invalid_file(path, "names no segments: only a .seg.nrrd file does");
  }
  return parse_file(path, [&](const std::string& content) { return parse_nrrd(content, choice); });
}

}  // namespace brainshift::io
