// SPDX-License-Identifier: Apache-2.0
#include "common/igtl/surface.hpp"

#include <cstdint>
#include <vector>

namespace brainshift::igtl {
namespace {

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
