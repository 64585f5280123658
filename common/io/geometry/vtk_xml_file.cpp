// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/vtk_xml_file.hpp"

#include <limits>

#include "common/io/files/point_space.hpp"
#include "common/io/geometry/vtk_xml.hpp"

namespace brainshift::io {
namespace {

constexpr std::int64_t kVtkTetra = 10;
constexpr std::int64_t kVtkTriangle = 5;

tl::unexpected<Error> unreadable_file(const std::string& message) {
  return fail(ErrorCode::kUnreadable, message);
}

Result<PointSpace> file_space(const VtkXmlFile& file) {
  const Result<std::optional<std::string>> text = file.field_text("SPACE");
  if (!text) return tl::unexpected(text.error());
  return *text ? parse_point_space(**text) : PointSpace::kUnsaid;
}

Result<Points> read_points(const VtkXmlFile& file) {
  const Result<std::int64_t> count = file.count("NumberOfPoints");
  if (!count) return tl::unexpected(count.error());
  const Result<VtkArray> array = file.array("Points", 0, *count);
  if (!array) return tl::unexpected(array.error());
  if (array->components != 3 || !array->is_real()) {
    return unreadable_file("Points must have three real components");
  }
  const Result<PointSpace> space = file_space(file);
  if (!space) return tl::unexpected(space.error());
  Points points = Eigen::Map<const Points>(array->reals.data(), 3, *count);
  turn_to_ras(*space, points);
  return points;
}

// Cells as ranges of a connectivity list.
struct CellList {
  std::vector<std::int64_t> connectivity;
  std::vector<std::int64_t> offsets;  // one past the end of each cell

  std::int64_t begin(std::size_t cell) const { return cell == 0 ? 0 : offsets[cell - 1]; }
  std::int64_t size(std::size_t cell) const { return offsets[cell] - begin(cell); }
};

Result<CellList> read_cells(const VtkXmlFile& file, const std::string& section,
                            std::int64_t count) {
  const Result<VtkArray> offsets = file.array(section, "offsets", count);
  if (!offsets) return tl::unexpected(offsets.error());
  const Result<VtkArray> connectivity = file.array(section, "connectivity", -1);
  if (!connectivity) return tl::unexpected(connectivity.error());
  CellList cells{connectivity->integers, offsets->integers};
  for (std::size_t i = 0; i < cells.offsets.size(); ++i) {
    const auto end = static_cast<std::int64_t>(cells.connectivity.size());
    if (cells.size(i) < 0 || cells.offsets[i] < 0 || cells.offsets[i] > end) {
      return unreadable_file(section + " offset " + std::to_string(i) + " is " +
                             std::to_string(cells.offsets[i]) + ": must grow and not exceed " +
                             std::to_string(end));
    }
  }
  if (static_cast<std::int64_t>(cells.offsets.size()) != count) {
    return unreadable_file(section + " offsets must be integers");
  }
  return cells;
}

// Out-of-range values become -1, which the caller's index check names.
int to_index(std::int64_t value) {
  return value < 0 || value > std::numeric_limits<int>::max() ? -1 : static_cast<int>(value);
}

Result<std::vector<std::int64_t>> read_labels(const VtkXmlFile& file, std::int64_t cells) {
  for (const std::string& name : file.array_names("CellData")) {
    if (name != "label") continue;
    Result<VtkArray> array = file.array("CellData", name, cells);
    if (!array) return tl::unexpected(array.error());
    if (array->components != 1 || array->is_real()) {
      return unreadable_file("CellData array 'label' must be one integer per cell");
    }
    for (const std::int64_t label : array->integers) {
      if (label < std::numeric_limits<int>::min() || label > std::numeric_limits<int>::max()) {
        return unreadable_file("label " + std::to_string(label) + " is out of range");
      }
    }
    return array->integers;
  }
  return std::vector<std::int64_t>{};
}

// Triangles count when the file labels its cells; without labels they have no group.
Result<GroupedMesh> read_grouped(const VtkXmlFile& file) {
  Result<Points> points = read_points(file);
  if (!points) return tl::unexpected(points.error());
  const Result<std::int64_t> count = file.count("NumberOfCells");
  if (!count) return tl::unexpected(count.error());
  const Result<CellList> cells = read_cells(file, "Cells", *count);
  if (!cells) return tl::unexpected(cells.error());
  const Result<VtkArray> types = file.array("Cells", "types", *count);
  if (!types) return tl::unexpected(types.error());
  if (types->is_real()) return unreadable_file("Cells array 'types' must be integers");
  const Result<std::vector<std::int64_t>> labels = read_labels(file, *count);
  if (!labels) return tl::unexpected(labels.error());

  GroupedMesh result;
  TetMesh& mesh = result.mesh;
  mesh.nodes = std::move(*points);
  std::vector<int> tets, triangles;
  for (std::size_t cell = 0; cell < types->integers.size(); ++cell) {
    const bool tetra = types->integers[cell] == kVtkTetra;
    if (!tetra && (types->integers[cell] != kVtkTriangle || labels->empty())) continue;
    const int vertices = tetra ? 4 : 3;
    if (cells->size(cell) != vertices) {
      return unreadable_file("cell " + std::to_string(cell) + " is a " +
                             (tetra ? "tetrahedron" : "triangle") + " with " +
                             std::to_string(cells->size(cell)) + " vertices: must have " +
                             std::to_string(vertices));
    }
    for (int k = 0; k < vertices; ++k) {
      (tetra ? tets : triangles)
          .push_back(
              to_index(cells->connectivity[static_cast<std::size_t>(cells->begin(cell) + k)]));
    }
    if (labels->empty()) continue;
    (tetra ? mesh.labels : result.triangle_labels).push_back(static_cast<int>((*labels)[cell]));
  }
  if (tets.empty()) return unreadable_file("has no tetrahedron");
  mesh.tets = Eigen::Map<const Eigen::Matrix<int, 4, Eigen::Dynamic>>(
      tets.data(), 4, static_cast<Eigen::Index>(tets.size() / 4));
  result.triangles = Eigen::Map<const Eigen::Matrix<int, 3, Eigen::Dynamic>>(
      triangles.data(), 3, static_cast<Eigen::Index>(triangles.size() / 3));
  return result;
}

}  // namespace

Result<MeshWithFields> parse_vtu(std::string content, bool with_fields) {
  const Result<VtkXmlFile> file = VtkXmlFile::parse(std::move(content), "UnstructuredGrid");
  if (!file) return tl::unexpected(file.error());
  Result<GroupedMesh> grouped = read_grouped(*file);
  if (!grouped) return tl::unexpected(grouped.error());
  MeshWithFields result{std::move(grouped->mesh), {}};
  if (!with_fields) return result;
  const Result<PointSpace> space = file_space(*file);
  if (!space) return tl::unexpected(space.error());
  const std::size_t arrays = file->array_names("PointData").size();
  for (std::size_t i = 0; i < arrays; ++i) {
    if (!file->is_real_array("PointData", i)) continue;
    const Result<VtkArray> array = file->array("PointData", i, result.mesh.num_nodes());
    if (!array) return tl::unexpected(array.error());
    Eigen::MatrixXd values = Eigen::Map<const Eigen::MatrixXd>(
        array->reals.data(), array->components, result.mesh.num_nodes());
    if (values.rows() == 3) turn_to_ras(*space, values);
    result.node_fields.push_back({array->name, std::move(values)});
  }
  return result;
}

Result<GroupedMesh> parse_grouped_vtu(std::string content) {
  const Result<VtkXmlFile> file = VtkXmlFile::parse(std::move(content), "UnstructuredGrid");
  if (!file) return tl::unexpected(file.error());
  return read_grouped(*file);
}

Result<TriangleSurface> parse_vtp(std::string content) {
  const Result<VtkXmlFile> file = VtkXmlFile::parse(std::move(content), "PolyData");
  if (!file) return tl::unexpected(file.error());
  Result<Points> points = read_points(*file);
  if (!points) return tl::unexpected(points.error());
  const Result<std::int64_t> strips = file->count("NumberOfStrips");
  const Result<std::int64_t> count = file->count("NumberOfPolys");
  if (!strips) return tl::unexpected(strips.error());
  if (!count) return tl::unexpected(count.error());
  if (*strips > 0) return unreadable_file("has triangle strips: must have triangles");
  const Result<CellList> cells = read_cells(*file, "Polys", *count);
  if (!cells) return tl::unexpected(cells.error());

  TriangleSurface surface;
  surface.vertices = std::move(*points);
  surface.triangles.resize(3, *count);
  for (std::size_t cell = 0; cell < cells->offsets.size(); ++cell) {
    if (cells->size(cell) != 3) {
      return unreadable_file("polygon " + std::to_string(cell) + " has " +
                             std::to_string(cells->size(cell)) + " vertices: must have 3");
    }
    for (int k = 0; k < 3; ++k) {
      surface.triangles(k, static_cast<Eigen::Index>(cell)) =
          to_index(cells->connectivity[static_cast<std::size_t>(cells->begin(cell) + k)]);
    }
  }
  return surface;
}

}  // namespace brainshift::io
