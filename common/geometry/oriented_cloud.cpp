// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/oriented_cloud.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nanoflann.hpp>
#include <utility>
#include <vector>

#include "common/core/point_columns.hpp"
#include "common/core/small_matrices.hpp"

namespace brainshift::geometry {
namespace {

constexpr double kReachOverSpacing = 5.0;
// Neighbours whose second principal spread is below this fraction of the first lie on a line.
constexpr double kOnALine = 0.01;
// Closer than this (mm), the direction from one point to another is rounding.
constexpr double kCoincident = 1e-9;
// Planes that are blended; with one, alignment stalls where the closest points change.
constexpr std::size_t kBlended = 8;

using CloudTree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, PointColumns>,
                                        PointColumns, 3, std::uint32_t>;

Status check(const Points& points, const Points& normals, const CloudOptions& options) {
  if (points.cols() < 3)
    return fail(ErrorCode::kEmptySet,
                fmt::format("point cloud: {} points given, at least 3 needed", points.cols()));
  if (normals.cols() != 0 && normals.cols() != points.cols())
    return fail(ErrorCode::kInvalidArgument, fmt::format("point cloud: {} normals for {} points",
                                                         normals.cols(), points.cols()));
  for (Eigen::Index i = 0; i < points.cols(); ++i)
    if (!points.col(i).allFinite())
      return fail(ErrorCode::kNotFinite, fmt::format("point cloud: point {} is not finite", i));
  for (Eigen::Index i = 0; i < normals.cols(); ++i) {
    if (!normals.col(i).allFinite())
      return fail(ErrorCode::kNotFinite, fmt::format("point cloud: normal {} is not finite", i));
    if (!(normals.col(i).norm() > 0.0))
      return fail(ErrorCode::kInvalidArgument,
                  fmt::format("point cloud: normal {} has no length", i));
  }
  if (options.neighbours < 3)
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("point cloud: neighbours = {}: must be >= 3", options.neighbours));
  if (!(std::isfinite(options.reach_mm) && options.reach_mm >= 0.0))
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("point cloud: reach_mm = {}: must be >= 0", options.reach_mm));
  return {};
}

}  // namespace

struct OrientedCloud::Impl {
  explicit Impl(const Points& given) : points(given) {}

  Points points, normals;
  double reach_mm = 0.0;
  PointColumns columns{points};
  CloudTree tree{3, columns};

  void nearest(const Vec3& x, std::vector<std::uint32_t>& ids, std::vector<double>& squared) const {
    nanoflann::KNNResultSet<double, std::uint32_t> found(ids.size());
    found.init(ids.data(), squared.data());
    tree.findNeighbors(found, x.data(), nanoflann::SearchParams());
    ids.resize(found.size());
  }
  void estimate_normals(int neighbours);
  double median_spacing() const;
};

void OrientedCloud::Impl::estimate_normals(int neighbours) {
  normals = Points::Zero(3, points.cols());
  const auto wanted =
      static_cast<std::size_t>(std::min<Eigen::Index>(neighbours + 1, points.cols()));
  std::vector<std::uint32_t> ids;
  std::vector<double> squared(wanted);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    ids.resize(wanted);
    nearest(points.col(i), ids, squared);
    Vec3 mean = Vec3::Zero();
    for (const std::uint32_t id : ids) mean += points.col(id);
    mean /= static_cast<double>(ids.size());
    Mat3 spread = Mat3::Zero();
    for (const std::uint32_t id : ids) {
      const Vec3 arm = points.col(id) - mean;
      spread += arm * arm.transpose();
    }
    const SymmetricEigen<3> principal = symmetric_eigen(spread);
    if (principal.values[1] > kOnALine * kOnALine * principal.values[2])
      normals.col(i) = principal.vectors.col(0);
  }
}

double OrientedCloud::Impl::median_spacing() const {
  std::vector<double> spacings;
  std::vector<std::uint32_t> ids(2);
  std::vector<double> squared(2);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    nearest(points.col(i), ids, squared);
    spacings.push_back(std::sqrt(squared[1]));
  }
  const auto middle = spacings.begin() + static_cast<std::ptrdiff_t>(spacings.size() / 2);
  std::nth_element(spacings.begin(), middle, spacings.end());
  return *middle;
}

OrientedCloud::OrientedCloud(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
OrientedCloud::OrientedCloud(OrientedCloud&&) noexcept = default;
OrientedCloud& OrientedCloud::operator=(OrientedCloud&&) noexcept = default;
OrientedCloud::~OrientedCloud() = default;

Result<OrientedCloud> OrientedCloud::build(const Points& points, const Points& normals,
                                           const CloudOptions& options) {
  if (Status valid = check(points, normals, options); !valid) return tl::unexpected(valid.error());
  auto impl = std::make_unique<Impl>(points);
  impl->tree.buildIndex();
  if (normals.cols() > 0)
    impl->normals = normals.colwise().normalized();
  else
    impl->estimate_normals(options.neighbours);
  if (impl->normals.isZero())
    return fail(
        ErrorCode::kEmptySet,
        fmt::format("point cloud: all {} points lie on lines, none has a normal", points.cols()));
  if (options.seen_from_mm)
    for (Eigen::Index i = 0; i < points.cols(); ++i)
      if (impl->normals.col(i).dot(*options.seen_from_mm - points.col(i)) < 0.0)
        impl->normals.col(i) *= -1.0;
  impl->reach_mm =
      options.reach_mm > 0.0 ? options.reach_mm : kReachOverSpacing * impl->median_spacing();
  return OrientedCloud(std::move(impl));
}

int OrientedCloud::closest(const Vec3& x, double& distance_mm) const {
  std::uint32_t id = 0;
  double squared = 0.0;
  nanoflann::KNNResultSet<double, std::uint32_t> found(1);
  found.init(&id, &squared);
  impl_->tree.findNeighbors(found, x.data(), nanoflann::SearchParams());
  distance_mm = std::sqrt(squared);
  return static_cast<int>(id);
}

DistanceSample OrientedCloud::at(const Vec3& x) const {
  std::array<std::uint32_t, kBlended> ids;
  std::array<double, kBlended> squared;
  nanoflann::KNNResultSet<double, std::uint32_t> found(kBlended);
  found.init(ids.data(), squared.data());
  impl_->tree.findNeighbors(found, x.data(), nanoflann::SearchParams());
  const Vec3 away = x - impl_->points.col(ids[0]);
  const Vec3 first = impl_->normals.col(ids[0]);
  const double distance = std::sqrt(squared[0]);
  if (distance <= kCoincident) return {0.0, first};
  if (distance > impl_->reach_mm || first.isZero()) return {distance, away / distance};
  const double per_reach = 1.0 / (impl_->reach_mm * impl_->reach_mm);
  double weights = 0.0, sum = 0.0;
  Vec3 direction = Vec3::Zero();
  for (std::size_t k = 0; k < found.size(); ++k) {
    const double part = std::max(0.0, 1.0 - per_reach * squared[k]);
    const Vec3 n = impl_->normals.col(ids[k]);
    const double weight = part * part * (n.dot(first) < 0.0 ? -1.0 : 1.0);
    weights += n.isZero() ? 0.0 : part * part;
    sum += weight * n.dot(x - impl_->points.col(ids[k]));
    direction += weight * n;
  }
  if (!(weights > 0.0)) return {first.dot(away), first};
  return {sum / weights, direction / weights};
}

const Points& OrientedCloud::points() const { return impl_->points; }
const Points& OrientedCloud::normals() const { return impl_->normals; }
double OrientedCloud::reach_mm() const { return impl_->reach_mm; }

}  // namespace brainshift::geometry
