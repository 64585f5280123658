// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/mask.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace brainshift::geometry {
namespace {

using Binary = std::vector<std::uint8_t>;

// Voxels begin <= i < end of one row, all of them in the labelled set.
struct Run {
  int begin = 0, end = 0;
};

// 6-connected components of the voxels that equal `value`, as runs in row order with one root
// each.
class RunComponents {
 public:
  RunComponents(const Binary& voxels, const std::array<int, 3>& dims, std::uint8_t value)
      : dims_(dims) {
    const std::size_t rows = static_cast<std::size_t>(dims[1]) * static_cast<std::size_t>(dims[2]);
    row_begin_.reserve(rows + 1);
    for (std::size_t row = 0; row < rows; ++row) {
      row_begin_.push_back(runs_.size());
      append_row(voxels.data() + row * static_cast<std::size_t>(dims[0]), value);
    }
    row_begin_.push_back(runs_.size());
    parent_.resize(runs_.size());
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
    for (std::size_t row = 0; row < rows; ++row) {
      const auto width = static_cast<std::size_t>(dims[1]);
      if (row % width != 0) join_rows(row - 1, row);
      if (row >= width) join_rows(row - width, row);
    }
  }

  std::size_t num_runs() const { return runs_.size(); }
  const Run& run(std::size_t index) const { return runs_[index]; }

  // The lowest run of the component: order of discovery, so independent of how unions happened.
  std::size_t root(std::size_t index) {
    while (parent_[index] != index) {
      parent_[index] = parent_[parent_[index]];
      index = parent_[index];
    }
    return index;
  }

  // Calls visit(row, run index) for every run.
  template <typename Visit>
  void for_each(Visit visit) const {
    for (std::size_t row = 0; row + 1 < row_begin_.size(); ++row)
      for (std::size_t r = row_begin_[row]; r < row_begin_[row + 1]; ++r) visit(row, r);
  }

 private:
  void append_row(const std::uint8_t* row, std::uint8_t value) {
    for (int i = 0; i < dims_[0];) {
      if (row[i] != value) {
        ++i;
        continue;
      }
      const int begin = i;
      while (i < dims_[0] && row[i] == value) ++i;
      runs_.push_back({begin, i});
    }
  }

  void join_rows(std::size_t row_a, std::size_t row_b) {
    std::size_t a = row_begin_[row_a], b = row_begin_[row_b];
    while (a < row_begin_[row_a + 1] && b < row_begin_[row_b + 1]) {
      if (std::max(runs_[a].begin, runs_[b].begin) < std::min(runs_[a].end, runs_[b].end))
        join(a, b);
      if (runs_[a].end < runs_[b].end) {
        ++a;
      } else {
        ++b;
      }
    }
  }

  void join(std::size_t a, std::size_t b) {
    a = root(a);
    b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

  std::array<int, 3> dims_;
  std::vector<Run> runs_;
  std::vector<std::size_t> row_begin_, parent_;
};

void paint(Binary& voxels, const std::array<int, 3>& dims, std::size_t row, const Run& run,
           std::uint8_t value) {
  std::uint8_t* first = voxels.data() + row * static_cast<std::size_t>(dims[0]);
  std::fill(first + run.begin, first + run.end, value);
}

// Keeps only the largest component of ones; false when there is no component.
bool keep_largest(Binary& voxels, const std::array<int, 3>& dims) {
  RunComponents components(voxels, dims, 1);
  if (components.num_runs() == 0) return false;
  std::vector<std::size_t> size(components.num_runs(), 0);
  components.for_each([&](std::size_t, std::size_t r) {
    size[components.root(r)] +=
        static_cast<std::size_t>(components.run(r).end - components.run(r).begin);
  });
  const auto largest =
      static_cast<std::size_t>(std::max_element(size.begin(), size.end()) - size.begin());
  components.for_each([&](std::size_t row, std::size_t r) {
    if (components.root(r) != largest) paint(voxels, dims, row, components.run(r), 0);
  });
  return true;
}

// Sets zeros that do not reach the border of the image to one.
void fill_cavities(Binary& voxels, const std::array<int, 3>& dims) {
  RunComponents components(voxels, dims, 0);
  std::vector<char> outside(components.num_runs(), 0);
  const auto width = static_cast<std::size_t>(dims[1]);
  const auto depth = static_cast<std::size_t>(dims[2]);
  components.for_each([&](std::size_t row, std::size_t r) {
    const std::size_t j = row % width, k = row / width;
    const Run& run = components.run(r);
    if (j == 0 || j + 1 == width || k == 0 || k + 1 == depth || run.begin == 0 ||
        run.end == dims[0])
      outside[components.root(r)] = 1;
  });
  components.for_each([&](std::size_t row, std::size_t r) {
    if (!outside[components.root(r)]) paint(voxels, dims, row, components.run(r), 1);
  });
}

// An image of zeros and ones with room for the ball around it.
struct Padded {
  std::array<int, 3> dims{};
  std::array<std::ptrdiff_t, 3> step{};  // to the next voxel of each axis
  Binary voxels;
};

// Steps to the voxels of the ball, itself left out.
std::vector<std::ptrdiff_t> ball(const Eigen::Matrix3d& mm_per_voxel,
                                 const std::array<int, 3>& reach, const Padded& image,
                                 double radius_mm) {
  std::vector<std::ptrdiff_t> steps;
  for (int k = -reach[2]; k <= reach[2]; ++k)
    for (int j = -reach[1]; j <= reach[1]; ++j)
      for (int i = -reach[0]; i <= reach[0]; ++i) {
        const double distance = (mm_per_voxel * Vec3(i, j, k)).norm();
        if (distance > 0.0 && distance <= radius_mm)
          steps.push_back(i * image.step[0] + j * image.step[1] + k * image.step[2]);
      }
  return steps;
}

// Sets what lies within the ball of a voxel that equals `value` to it; at least `margin` voxels
// from the border. It is enough to look from the voxels beside others.
void grow(Padded& image, const std::vector<std::ptrdiff_t>& ball, const std::array<int, 3>& margin,
          std::uint8_t value) {
  const Binary before = image.voxels;
  for (int k = margin[2]; k < image.dims[2] - margin[2]; ++k)
    for (int j = margin[1]; j < image.dims[1] - margin[1]; ++j)
      for (int i = margin[0]; i < image.dims[0] - margin[0]; ++i) {
        const std::ptrdiff_t at = i * image.step[0] + j * image.step[1] + k * image.step[2];
        const auto is = [&](std::ptrdiff_t step) {
          return before[static_cast<std::size_t>(at + step)] == value;
        };
        if (!is(0)) continue;
        bool inner = true;
        for (const std::ptrdiff_t step : image.step) inner = inner && is(step) && is(-step);
        if (inner) continue;
        for (const std::ptrdiff_t step : ball)
          image.voxels[static_cast<std::size_t>(at + step)] = value;
      }
}

// Weights of offsets 0..radius of a normalised symmetric Gaussian.
std::vector<float> half_kernel(double sigma_voxels) {
  const int radius = std::max(1, static_cast<int>(std::ceil(3.5 * sigma_voxels)));
  std::vector<double> weights(static_cast<std::size_t>(radius) + 1);
  double sum = 0.0;
  for (int r = 0; r <= radius; ++r) {
    const double t = r / sigma_voxels;
    weights[static_cast<std::size_t>(r)] = std::exp(-0.5 * t * t);
    sum += (r == 0 ? 1.0 : 2.0) * weights[static_cast<std::size_t>(r)];
  }
  std::vector<float> kernel(weights.size());
  std::transform(weights.begin(), weights.end(), kernel.begin(),
                 [sum](double w) { return static_cast<float>(w / sum); });
  return kernel;
}

// out += weight * in, over `count` contiguous voxels.
void add_scaled(float* out, const float* in, float weight, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) out[i] += weight * in[i];
}

// Convolves along one axis, seeing the image as [outer][length][inner] with `inner` contiguous
// voxels.
std::vector<float> convolve(const std::vector<float>& in, std::size_t inner, std::size_t length,
                            const std::vector<float>& kernel) {
  std::vector<float> out(in.size(), 0.0f);
  const std::size_t slab = inner * length;
  const auto reach = std::min(kernel.size(), length);
  for (std::size_t base = 0; base < in.size(); base += slab) {
    for (std::size_t r = 0; r < reach; ++r) {
      // Contiguous in memory, so that every axis runs at the speed of the memory.
      const std::size_t count = slab - r * inner;
      if (inner > 1) {
        for (std::size_t l = 0; l + r < length; ++l) {
          add_scaled(&out[base + l * inner], &in[base + (l + r) * inner], kernel[r], inner);
          if (r > 0)
            add_scaled(&out[base + (l + r) * inner], &in[base + l * inner], kernel[r], inner);
        }
      } else {
        add_scaled(&out[base], &in[base + r], kernel[r], count);
        if (r > 0) add_scaled(&out[base + r], &in[base], kernel[r], count);
      }
    }
  }
  return out;
}

}  // namespace

Result<VoxelImage> largest_component(const VoxelImage& image) {
  assert(image.values.size() == image.num_voxels());
  Binary voxels(image.values.size());
  std::transform(image.values.begin(), image.values.end(), voxels.begin(),
                 [](float v) { return static_cast<std::uint8_t>(v > 0.0f); });
  if (voxels.empty() || !keep_largest(voxels, image.dims))
    return fail(ErrorCode::kEmptySet, "mask: no voxel is > 0");
  fill_cavities(voxels, image.dims);
  VoxelImage result{image.dims, image.T_ras_voxel, std::vector<float>(voxels.size())};
  std::copy(voxels.begin(), voxels.end(), result.values.begin());
  return result;
}

MaskCentre mask_centre(const VoxelImage& mask) {
  MaskCentre found;
  double count = 0.0;
  const auto is_in = [](float value) { return value > 0.0F; };
  for_each_voxel(mask, is_in, [&](std::size_t, const Vec3& x) {
    found.centre += x, count += 1.0;
    found.low = found.low.cwiseMin(x), found.high = found.high.cwiseMax(x);
  });
  if (count > 0.0) found.centre /= count;
  found.volume_mm3 = count * std::abs(mask.T_ras_voxel.linear().determinant());
  return found;
}

bool mask_has(const VoxelImage& mask, const AffineTransform& T_voxel_ras, const Vec3& x) {
  const Eigen::Vector3i at = (T_voxel_ras * x).array().round().cast<int>();
  const bool there = (at.array() >= 0).all() && at[0] < mask.dims[0] && at[1] < mask.dims[1] &&
                     at[2] < mask.dims[2];
  return there && mask.at(at[0], at[1], at[2]) > 0.0F;
}

MaskParts mask_parts(const VoxelImage& image) {
  assert(image.values.size() == image.num_voxels());
  Binary voxels(image.values.size());
  std::transform(image.values.begin(), image.values.end(), voxels.begin(),
                 [](float v) { return static_cast<std::uint8_t>(v > 0.0f); });
  MaskParts parts;
  parts.part_of_voxel.assign(voxels.size(), -1);
  if (voxels.empty()) return parts;
  RunComponents components(voxels, image.dims, 1);
  std::vector<std::size_t> size(components.num_runs(), 0), roots;
  components.for_each([&](std::size_t, std::size_t r) {
    const Run& run = components.run(r);
    if (components.root(r) == r) roots.push_back(r);
    size[components.root(r)] += static_cast<std::size_t>(run.end - run.begin);
  });
  std::stable_sort(roots.begin(), roots.end(),
                   [&](std::size_t a, std::size_t b) { return size[a] > size[b]; });
  std::vector<std::int32_t> number(components.num_runs(), -1);
  for (std::size_t i = 0; i < roots.size(); ++i) {
    number[roots[i]] = static_cast<std::int32_t>(i);
    parts.voxels.push_back(size[roots[i]]);
  }
  const auto width = static_cast<std::size_t>(image.dims[0]);
  components.for_each([&](std::size_t row, std::size_t r) {
    const Run& run = components.run(r);
    std::fill(parts.part_of_voxel.begin() + static_cast<std::ptrdiff_t>(row * width) + run.begin,
              parts.part_of_voxel.begin() + static_cast<std::ptrdiff_t>(row * width) + run.end,
              number[components.root(r)]);
  });
  return parts;
}

VoxelImage close_gaps(const VoxelImage& image, double radius_mm) {
  assert(image.values.size() == image.num_voxels());
  assert(radius_mm >= 0.0);
  const Eigen::Matrix3d mm_per_voxel = image.T_ras_voxel.linear();
  std::array<int, 3> reach{}, room{};
  Padded padded;
  for (int a = 0; a < 3; ++a) {
    // Of a skewed grid: as far as the ball reaches across the planes of the other two axes.
    const double height = 1.0 / mm_per_voxel.inverse().row(a).norm();
    const auto axis = static_cast<std::size_t>(a);
    reach[axis] = static_cast<int>(std::floor(radius_mm / height + 1e-9));
    room[axis] = 2 * reach[axis] + 1;
    padded.dims[axis] = image.dims[axis] + 2 * room[axis];
  }
  padded.step = {1, padded.dims[0], std::ptrdiff_t{padded.dims[0]} * padded.dims[1]};
  padded.voxels.assign(static_cast<std::size_t>(padded.step[2] * padded.dims[2]), 0);
  const auto each = [&](auto visit) {
    std::size_t v = 0;
    for (int k = 0; k < image.dims[2]; ++k)
      for (int j = 0; j < image.dims[1]; ++j)
        for (int i = 0; i < image.dims[0]; ++i, ++v)
          visit(v, static_cast<std::size_t>((i + room[0]) * padded.step[0] +
                                            (j + room[1]) * padded.step[1] +
                                            (k + room[2]) * padded.step[2]));
  };
  each([&](std::size_t v, std::size_t p) { padded.voxels[p] = image.values[v] > 0.0f ? 1 : 0; });
  const auto steps = ball(mm_per_voxel, reach, padded, radius_mm);
  const std::array<int, 3> margin{reach[0] + 1, reach[1] + 1, reach[2] + 1};
  grow(padded, steps, margin, 1);
  // What was set lies a reach inside of the border, so that its outside has room too.
  grow(padded, steps, {std::max(1, reach[0]), std::max(1, reach[1]), std::max(1, reach[2])}, 0);
  VoxelImage closed{image.dims, image.T_ras_voxel, std::vector<float>(image.values.size())};
  each([&](std::size_t v, std::size_t p) { closed.values[v] = padded.voxels[p]; });
  return closed;
}

VoxelImage gaussian_smooth(const VoxelImage& image, double sigma_mm) {
  assert(image.values.size() == image.num_voxels());
  assert(sigma_mm >= 0.0);
  VoxelImage result = image;
  std::size_t inner = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const auto length = static_cast<std::size_t>(image.dims[static_cast<std::size_t>(axis)]);
    const double sigma_voxels = sigma_mm / image.T_ras_voxel.linear().col(axis).norm();
    if (sigma_voxels >= 0.1 && !result.values.empty())
      result.values = convolve(result.values, inner, length, half_kernel(sigma_voxels));
    inner *= length;
  }
  return result;
}

Interpolator::Interpolator(const VoxelImage& image)
    : image_(image), T_voxel_ras_(image.T_ras_voxel.inverse()) {}

float Interpolator::operator()(const Vec3& x_ras) const {
  const Vec3 x = T_voxel_ras_ * x_ras;
  int base[3];
  float t[3];
  for (int a = 0; a < 3; ++a) {
    // Written so that NaN is outside too.
    if (!(x[a] > -1.0 && x[a] < image_.dims[static_cast<std::size_t>(a)])) return 0.0f;
    const double floor = std::floor(x[a]);
    base[a] = static_cast<int>(floor);
    t[a] = static_cast<float>(x[a] - floor);
  }
  float sum = 0.0f;
  for (int corner = 0; corner < 8; ++corner) {
    float weight = 1.0f;
    int index[3];
    bool inside = true;
    for (int a = 0; a < 3; ++a) {
      const int up = (corner >> a) & 1;
      index[a] = base[a] + up;
      weight *= up ? t[a] : 1.0f - t[a];
      inside = inside && index[a] >= 0 && index[a] < image_.dims[static_cast<std::size_t>(a)];
    }
    if (inside) sum += weight * image_.at(index[0], index[1], index[2]);
  }
  return sum;
}

}  // namespace brainshift::geometry
