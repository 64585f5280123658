// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/dicom/filled_contours.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace brainshift::io {
namespace {

constexpr double kLeastArea_mm2 = 1e-3;
constexpr double kSameOutline_mm = 0.3, kSameArea = 0.03;
constexpr double kTurned_deg = 1.0;  // below, planes and slices count as parallel
constexpr double kShifted = 0.05;    // of a slice's thickness

struct Flat {
  int number = 0;             // of the contour, from 1
  Eigen::Matrix2Xd points;    // in the plane
  Eigen::Vector2d low, high;  // their box
  double depth = 0.0;         // along the normal
  double area = 0.0;          // > 0
};

struct ContourPlane {
  double depth = 0.0, below = 0.0, above = 0.0;  // it reaches over [below, above)
  std::vector<Flat> contours;
};

struct Stack {
  Vec3 normal = Vec3::UnitZ(), along = Vec3::UnitX(), across = Vec3::UnitY();
  double spacing_mm = 0.0;
  std::vector<ContourPlane> planes;  // ascending
  std::vector<std::string> notes;

  Eigen::Vector2d flat(const Vec3& x) const { return {x.dot(along), x.dot(across)}; }
};

// Its length is the area.
Vec3 area_vector(const Points& contour) {
  Vec3 sum = Vec3::Zero();
  for (Eigen::Index i = 0; i < contour.cols(); ++i) {
    const Vec3 a = contour.col(i) - contour.col(0);
    const Vec3 b = contour.col((i + 1) % contour.cols()) - contour.col(0);
    sum += 0.5 * a.cross(b);
  }
  return sum;
}

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

// Calls take(a, b) for every edge.
template <typename Take>
void for_each_edge(const Flat& contour, const Take& take) {
  const Eigen::Index count = contour.points.cols();
  for (Eigen::Index i = 0; i < count; ++i) {
    take(Eigen::Vector2d(contour.points.col(i)),
         Eigen::Vector2d(contour.points.col((i + 1) % count)));
  }
}

bool edges_cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
                 const Eigen::Vector2d& d) {
  const auto side = [](const Eigen::Vector2d& p, const Eigen::Vector2d& q,
                       const Eigen::Vector2d& r) {
    const double reach = (q - p).norm();
    const double off = reach > 0.0 ? cross(q - p, r - p) / reach : 0.0;
    return off > kOnContour_mm ? 1 : off < -kOnContour_mm ? -1 : 0;
  };
  return side(a, b, c) * side(a, b, d) < 0 && side(c, d, a) * side(c, d, b) < 0;
}

bool boxes_meet(const Flat& a, const Flat& b) {
  return (a.low.array() <= b.high.array()).all() && (b.low.array() <= a.high.array()).all();
}

bool contours_cross(const Flat& a, const Flat& b) {
  if (!boxes_meet(a, b)) return false;
  bool crossing = false;
  for_each_edge(a, [&](const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
    if (crossing) return;
    const Eigen::Vector2d low = p.cwiseMin(q), high = p.cwiseMax(q);
    if ((low.array() > b.high.array()).any() || (high.array() < b.low.array()).any()) return;
    for_each_edge(b, [&](const Eigen::Vector2d& r, const Eigen::Vector2d& s) {
      crossing = crossing || edges_cross(p, q, r, s);
    });
  });
  return crossing;
}

// Drawn twice, with other points on the outline perhaps: a wall this thin is no ring.
bool same_contour(const Flat& a, const Flat& b) {
  return (a.low - b.low).norm() < kSameOutline_mm && (a.high - b.high).norm() < kSameOutline_mm &&
         std::abs(a.area - b.area) < kSameArea * std::max(a.area, b.area);
}

// Odd number of edges to the right of x; `on`: an edge passes through x.
bool is_inside(const Flat& contour, const Eigen::Vector2d& x, bool& on) {
  const double margin = kOnContour_mm;
  if ((x.array() < contour.low.array() - margin).any() ||
      (x.array() > contour.high.array() + margin).any()) {
    return false;
  }
  bool odd = false;
  for_each_edge(contour, [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    if ((a.y() > x.y()) != (b.y() > x.y()) &&
        x.x() < a.x() + (x.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x())) {
      odd = !odd;
    }
    const Eigen::Vector2d edge = b - a;
    const double length2 = edge.squaredNorm();
    const double t = length2 > 0.0 ? std::clamp((x - a).dot(edge) / length2, 0.0, 1.0) : 0.0;
    on = on || (x - a - t * edge).squaredNorm() < kOnContour_mm * kOnContour_mm;
  });
  return odd;
}

Result<std::vector<Flat>> flattened(const std::vector<Points>& contours, Stack& stack) {
  Vec3 largest = Vec3::Zero();
  for (const Points& contour : contours) {
    const Vec3 area = contour.cols() > 2 ? area_vector(contour) : Vec3(Vec3::Zero());
    if (area.norm() > largest.norm()) largest = area;
  }
  if (largest.norm() < kLeastArea_mm2) return invalid("has no contour that encloses an area");
  stack.normal = largest.normalized();
  stack.along = stack.normal.unitOrthogonal();
  stack.across = stack.normal.cross(stack.along);
  std::vector<Flat> flat;
  for (std::size_t c = 0; c < contours.size(); ++c) {
    const Points& contour = contours[c];
    if (contour.cols() < 3) continue;
    Flat one;
    one.number = static_cast<int>(c) + 1;
    const VecX depths = contour.transpose() * stack.normal;
    one.depth = depths.mean();
    const double out = (depths.array() - one.depth).abs().maxCoeff();
    if (out > kOutOfPlane_mm) {
      return invalid(
          fmt::format("contour {} does not lie in a plane parallel to the others: its points are "
                      "up to {:.2f} mm out of it, {:g} mm are allowed",
                      one.number, out, kOutOfPlane_mm));
    }
    one.area = area_vector(contour).norm();
    if (one.area < kLeastArea_mm2) continue;
    one.points.resize(2, contour.cols());
    for (Eigen::Index i = 0; i < contour.cols(); ++i)
      one.points.col(i) = stack.flat(contour.col(i));
    one.low = one.points.rowwise().minCoeff(), one.high = one.points.rowwise().maxCoeff();
    flat.push_back(std::move(one));
  }
  return flat;
}

Status check_plane(const ContourPlane& plane) {
  for (std::size_t i = 0; i < plane.contours.size(); ++i) {
    for (std::size_t j = i + 1; j < plane.contours.size(); ++j) {
      const Flat &a = plane.contours[i], &b = plane.contours[j];
      if (same_contour(a, b)) {
        return invalid(
            fmt::format("contours {} and {} are the same: one within the other would be "
                        "a hole",
                        a.number, b.number));
      }
      if (contours_cross(a, b)) {
        return invalid(
            fmt::format("contours {} and {} lie in one plane and cross: where they "
                        "overlap could be inside or a hole",
                        a.number, b.number));
      }
    }
  }
  return {};
}

// How far each plane reaches; notes of gaps.
void spread_planes(Stack& stack, double single_mm) {
  std::vector<double> apart;
  for (std::size_t p = 1; p < stack.planes.size(); ++p) {
    apart.push_back(stack.planes[p].depth - stack.planes[p - 1].depth);
  }
  std::vector<double> sorted = apart;
  std::sort(sorted.begin(), sorted.end());
  stack.spacing_mm = sorted.empty() ? single_mm : sorted[(sorted.size() - 1) / 2];
  double widest = 0.0;
  int gaps = 0;
  for (std::size_t p = 0; p < stack.planes.size(); ++p) {
    const auto reach = [&](bool there, std::size_t between) {
      return there && apart[between] <= kGap * stack.spacing_mm ? 0.5 * apart[between]
                                                                : 0.5 * stack.spacing_mm;
    };
    stack.planes[p].below = stack.planes[p].depth - reach(p > 0, p - 1);
    stack.planes[p].above = stack.planes[p].depth + reach(p + 1 < stack.planes.size(), p);
    if (p > 0 && apart[p - 1] > kGap * stack.spacing_mm) {
      ++gaps;
      widest = std::max(widest, apart[p - 1]);
    }
  }
  if (gaps > 0) {
    stack.notes.push_back(
        fmt::format("{} between its planes, up to {:.1f} mm wide where {:.1f} mm are usual; "
                    "nothing is filled in there",
                    gaps == 1 ? "a gap" : fmt::format("{} gaps", gaps), widest, stack.spacing_mm));
  }
}

Result<Stack> make_stack(const std::vector<Points>& contours, const VoxelImage& grid) {
  Stack stack;
  auto flat = flattened(contours, stack);
  if (!flat) return tl::unexpected(flat.error());
  std::sort(flat->begin(), flat->end(), [](const Flat& a, const Flat& b) {
    return std::pair(a.depth, a.number) < std::pair(b.depth, b.number);
  });
  for (Flat& one : *flat) {
    if (stack.planes.empty() || one.depth - stack.planes.back().depth > kOutOfPlane_mm) {
      stack.planes.push_back({one.depth, 0.0, 0.0, {}});
    }
    stack.planes.back().contours.push_back(std::move(one));
  }
  for (const ContourPlane& plane : stack.planes) {
    if (Status ok = check_plane(plane); !ok) return tl::unexpected(ok.error());
  }
  const Vec3 steps = grid.T_ras_voxel.linear().transpose() * stack.normal;
  spread_planes(stack, steps.cwiseAbs().maxCoeff());
  return stack;
}

const ContourPlane* plane_at(const Stack& stack, double depth) {
  auto next = std::upper_bound(stack.planes.begin(), stack.planes.end(), depth,
                               [](double d, const ContourPlane& plane) { return d < plane.below; });
  if (next == stack.planes.begin()) return nullptr;
  const ContourPlane& plane = *std::prev(next);
  return depth < plane.above ? &plane : nullptr;
}

bool contains(const ContourPlane& plane, const Eigen::Vector2d& x) {
  bool odd = false, on = false;
  for (const Flat& contour : plane.contours) odd = is_inside(contour, x, on) != odd;
  return odd || on;
}

// The voxels that the contours may reach, and whether all of their points lie in the grid.
struct VoxelBox {
  std::array<int, 3> low{}, high{};  // both of them inside
};
Result<VoxelBox> voxel_box(const std::vector<Points>& contours, const Stack& stack,
                           const VoxelImage& grid) {
  const AffineTransform T_voxel_ras = grid.T_ras_voxel.inverse();
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
  Eigen::Index outside = 0, all = 0;
  const Vec3 last = Vec3(grid.dims[0], grid.dims[1], grid.dims[2]).array() - 1.0;
  for (const Points& contour : contours) {
    for (const auto& point : contour.colwise()) {
      const Vec3 voxel = T_voxel_ras * Vec3(point);
      ++all;
      if ((voxel.array() < -1.0).any() || (voxel.array() > last.array() + 1.0).any()) ++outside;
      for (const double reach : {-stack.spacing_mm, stack.spacing_mm}) {
        const Vec3 x = T_voxel_ras * Vec3(point + reach * stack.normal);
        low = low.cwiseMin(x), high = high.cwiseMax(x);
      }
    }
  }
  if (outside > 0) {
    return invalid(
        fmt::format("{:.0f} % of its points lie outside of the image: was it drawn on "
                    "another series?",
                    100.0 * static_cast<double>(outside) / static_cast<double>(all)));
  }
  VoxelBox box;
  for (Eigen::Index a = 0; a < 3; ++a) {
    const auto at = static_cast<std::size_t>(a);
    box.low[at] = static_cast<int>(std::floor(std::clamp(low[a], 0.0, last[a])));
    box.high[at] = static_cast<int>(std::ceil(std::clamp(high[a], 0.0, last[a])));
  }
  return box;
}

// How the planes lie to the grid's slices, where they do not lie on them.
void note_slices(const VoxelImage& grid, Stack& stack) {
  Eigen::Index axis = 0;
  double cosine = 0.0;
  for (Eigen::Index a = 0; a < 3; ++a) {
    const Vec3 others = grid.T_ras_voxel.linear()
                            .col((a + 1) % 3)
                            .cross(grid.T_ras_voxel.linear().col((a + 2) % 3))
                            .normalized();
    if (std::abs(others.dot(stack.normal)) > cosine) {
      cosine = std::abs(others.dot(stack.normal)), axis = a;
    }
  }
  const double turned = std::acos(std::min(1.0, cosine)) * 180.0 / std::numbers::pi;
  if (turned > kTurned_deg) {
    stack.notes.push_back(fmt::format(
        "its planes are turned by {:.0f} degrees against the image's slices; each voxel has the "
        "plane nearest to it",
        turned));
    return;
  }
  const double step = std::abs(grid.T_ras_voxel.linear().col(axis).dot(stack.normal));
  const double first = grid.T_ras_voxel.translation().dot(stack.normal);
  double off = 0.0;
  for (const ContourPlane& plane : stack.planes) {
    const double slices = (plane.depth - first) / step;
    off = std::max(off, step * std::abs(slices - std::round(slices)));
  }
  if (off > kShifted * step) {
    stack.notes.push_back(fmt::format(
        "its planes lie up to {:.2f} mm beside the image's slices, which are {:.2f} mm apart", off,
        step));
  }
}

}  // namespace

Result<FilledContours> fill_contours(const std::vector<Points>& contours, const VoxelImage& grid) {
  auto stack = make_stack(contours, grid);
  if (!stack) return tl::unexpected(stack.error());
  const auto box = voxel_box(contours, *stack, grid);
  if (!box) return tl::unexpected(box.error());
  FilledContours filled;
  filled.mask.dims = grid.dims;
  filled.mask.T_ras_voxel = grid.T_ras_voxel;
  filled.mask.values.assign(grid.num_voxels(), 0.0F);
  bool any = false;
  for (int k = box->low[2]; k <= box->high[2]; ++k) {
    for (int j = box->low[1]; j <= box->high[1]; ++j) {
      for (int i = box->low[0]; i <= box->high[0]; ++i) {
        const Vec3 x = grid.T_ras_voxel * Vec3(i, j, k);
        const ContourPlane* const plane = plane_at(*stack, x.dot(stack->normal));
        if (plane == nullptr || !contains(*plane, stack->flat(x))) continue;
        filled.mask.values[grid_index(grid.dims, i, j, k)] = 1.0F;
        any = true;
      }
    }
  }
  if (!any) return invalid("holds the centre of no voxel of the image");
  note_slices(grid, *stack);
  filled.planes = static_cast<int>(stack->planes.size());
  filled.spacing_mm = stack->spacing_mm;
  filled.notes = std::move(stack->notes);
  return filled;
}

Result<double> contours_volume_mm3(const std::vector<Points>& contours, const VoxelImage& grid) {
  const auto stack = make_stack(contours, grid);
  if (!stack) return tl::unexpected(stack.error());
  double volume = 0.0;
  for (const ContourPlane& plane : stack->planes) {
    for (const Flat& contour : plane.contours) {
      // Contours of a plane do not cross: a point of one tells how many others it lies in.
      int within = 0;
      bool on = false;
      for (const Flat& other : plane.contours) {
        if (&other != &contour && is_inside(other, contour.points.col(0), on)) ++within;
      }
      volume += (within % 2 == 0 ? 1.0 : -1.0) * contour.area * (plane.above - plane.below);
    }
  }
  return volume;
}

}  // namespace brainshift::io
