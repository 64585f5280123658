// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/dicom/slice_places.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

double lower_median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Vec3 middle_of(const std::vector<Vec3>& points) {
  Vec3 middle;
  for (Eigen::Index a = 0; a < 3; ++a) {
    std::vector<double> values;
    for (const Vec3& x : points) values.push_back(x[a]);
    middle[a] = lower_median(std::move(values));
  }
  return middle;
}

// Of points that should be one: how many are, and the one that is farthest off.
struct Spread {
  std::size_t together = 0, farthest = 0;
  double off_mm = 0.0;
};
Spread spread_of(const std::vector<Vec3>& points) {
  const Vec3 middle = middle_of(points);
  Spread spread;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double off = (points[i] - middle).norm();
    if (off <= kLargestSliceError_mm) ++spread.together;
    if (off > spread.off_mm) spread.off_mm = off, spread.farthest = i;
  }
  return spread;
}

// Sideways per mm of depth, of two places as far apart in depth as any.
Vec3 slope_of(const std::vector<double>& depths, const std::vector<Vec3>& beside) {
  const auto [low, high] = std::minmax_element(depths.begin(), depths.end());
  const auto from = static_cast<std::size_t>(low - depths.begin());
  const auto to = static_cast<std::size_t>(high - depths.begin());
  const double apart = depths[to] - depths[from];
  return apart > kLargestSliceError_mm ? Vec3((beside[to] - beside[from]) / apart)
                                       : Vec3(Vec3::Zero());
}

}  // namespace

std::string place_text(const SlicePlace& place) {
  return fmt::format("{} at ({:g}, {:g}, {:g})", place.name, place.position.x(), place.position.y(),
                     place.position.z());
}

Status check_slice_line(const std::vector<SlicePlace>& places, const Vec3& normal) {
  std::vector<double> depths;
  std::vector<Vec3> beside;
  for (const SlicePlace& place : places) {
    const Vec3 away = place.position - places.front().position;
    depths.push_back(away.dot(normal));
    beside.push_back(away - depths.back() * normal);
  }
  const Spread straight = spread_of(beside);
  if (straight.together == places.size()) return {};
  const Vec3 slope = slope_of(depths, beside);
  std::vector<Vec3> along_line;
  for (std::size_t i = 0; i < places.size(); ++i) {
    along_line.push_back(beside[i] - depths[i] * slope);
  }
  if (slope.norm() > 0.0 && 2 * straight.together <= places.size() &&
      spread_of(along_line).together == places.size()) {
    return unreadable(
        fmt::format("the images are tilted by {:.3g} degrees: from one to the next "
                    "ImagePositionPatient (0020,0032) moves sideways (gantry tilt); "
                    "let dcm2niix make an upright volume of them",
                    std::atan(slope.norm()) * 180.0 / std::numbers::pi));
  }
  return unreadable(fmt::format("{} lies {:.2f} mm beside the others: not slices of one volume",
                                place_text(places[straight.farthest]), straight.off_mm));
}

}  // namespace brainshift::io
