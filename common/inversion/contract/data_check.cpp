// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/contract/data_check.hpp"

#include <fmt/format.h>

#include <cmath>

#include "common/core/small_matrices.hpp"

namespace brainshift::inversion {
namespace {

// Not on one line, not in one plane.
Status check_spread(const Points& positions) {
  const Vec3 centre = positions.rowwise().mean();
  Mat3 scatter = Mat3::Zero();
  for (Eigen::Index i = 0; i < positions.cols(); ++i) {
    const Vec3 arm = positions.col(i) - centre;
    scatter += arm * arm.transpose();
  }
  const Vec3 variances = symmetric_eigen(scatter).values;  // ascending
  const double limit = kCollinearRatio * kCollinearRatio * variances[2];
  if (variances[1] > limit && variances[0] > limit) return {};
  return invalid(
      fmt::format("sparse data: the {} positions lie {}", positions.cols(),
                  variances[1] > limit ? "in one plane" : "on one line or in one point"));
}

// Neighbours that would have to tear apart. All pairs are compared, of a subset beyond 2000 data.
Status check_agreement(const SparseData& data) {
  constexpr int kMaxCompared = 2000;
  const int step = 1 + (data.size() - 1) / kMaxCompared;
  for (int i = 0; i < data.size(); i += step) {
    if (data.along_direction(i)) continue;
    for (int j = i + step; j < data.size(); j += step) {
      if (data.along_direction(j)) continue;
      const double apart = (data.positions.col(i) - data.positions.col(j)).norm();
      const double differ = (data.displacements.col(i) - data.displacements.col(j)).norm();
      const double noise = kContradictionSds * (data.sd_mm[i] + data.sd_mm[j]);
      if (!(differ > kContradiction_mm + kContradictionStretch * apart + noise)) continue;
      return invalid(
          fmt::format("sparse data: points {} and {} contradict each other: {:g} mm apart, their "
                      "displacements differ by {:g} mm",
                      i, j, apart, differ));
    }
  }
  return {};
}

Status check_directions(const SparseData& data) {
  if (data.directions.cols() == 0) return {};
  if (data.directions.cols() != data.size()) {
    return invalid(
        fmt::format("sparse data: {} directions for {} data", data.directions.cols(), data.size()));
  }
  for (int i = 0; i < data.size(); ++i) {
    const double length = data.directions.col(i).norm();
    if (length == 0.0 || std::abs(length - 1.0) <= kUnitTolerance) continue;
    return fail(
        std::isfinite(length) ? ErrorCode::kInvalidArgument : ErrorCode::kNotFinite,
        fmt::format("sparse data: direction {} has length {:g}: must be 0 or 1", i, length));
  }
  return {};
}

// Sources must follow one another and cover all data.
Status check_sources(const SparseData& data) {
  int next = 0;
  for (const DataSource& source : data.sources) {
    if (source.first != next || source.count < 0) {
      return invalid(fmt::format("sparse data: source \"{}\" begins at datum {}, must begin at {}",
                                 source.name, source.first, next));
    }
    next += source.count;
  }
  if (data.sources.empty() || next == data.size()) return {};
  return invalid(fmt::format("sparse data: the sources hold {} of {} data", next, data.size()));
}

}  // namespace

Status check_whole(const SparseData& data) {
  for (int i = 0; i < data.size(); ++i) {
    if (!data.along_direction(i)) continue;
    return invalid(fmt::format(
        "sparse data: datum {} is a distance along a direction: only method condensed takes it",
        i));
  }
  return {};
}

Status check_data(const SparseData& data) {
  const int m = data.size();
  if (data.displacements.cols() != m || data.sd_mm.size() != m) {
    return invalid(
        fmt::format("sparse data: {} positions, {} displacements and {} standard deviations must "
                    "be equal counts",
                    m, data.displacements.cols(), data.sd_mm.size()));
  }
  const Eigen::MatrixXd& common = data.common_error;
  if (common.rows() > 0 &&
      (common.rows() != 3 * m || common.cols() > SparseData::kMaxCommonErrors)) {
    return invalid(
        fmt::format("sparse data: common_error is {} x {}: must have 3 rows for each of {} data "
                    "and at most {} columns",
                    common.rows(), common.cols(), m, SparseData::kMaxCommonErrors));
  }
  if (!common.allFinite()) {
    return fail(ErrorCode::kNotFinite,
                "sparse data: common_error holds a value that is not finite");
  }
  const Eigen::MatrixXd& variance = data.common_variance;
  if (variance.cols() > 0) {
    const Eigen::Index errors = common.rows() > 0 ? common.cols() : 0;
    if (variance.rows() != errors || variance.cols() > Eigen::Index{kOutlineErrors.size()}) {
      return invalid(
          fmt::format("sparse data: common_variance is {} x {}: must have {} rows, one for each "
                      "common error, and at most {} columns",
                      variance.rows(), variance.cols(), errors, kOutlineErrors.size()));
    }
    if (!(variance.array() >= 0.0 && variance.array() <= 1.0).all()) {
      return invalid("sparse data: common_variance holds a value outside 0 to 1");
    }
  }
  if (m < 3) return invalid(fmt::format("sparse data: {} points, at least 3 are needed", m));
  for (int i = 0; i < m; ++i) {
    if (!data.positions.col(i).allFinite() || !data.displacements.col(i).allFinite() ||
        !std::isfinite(data.sd_mm[i])) {
      return fail(
          ErrorCode::kNotFinite,
          fmt::format("sparse data: point {} has a position, displacement or sd that is not finite",
                      i));
    }
    if (!(data.sd_mm[i] > 0.0)) {
      return invalid(fmt::format("sparse data: sd_mm[{}] = {:g}: must be > 0", i, data.sd_mm[i]));
    }
  }
  if (auto status = check_directions(data); !status) return status;
  if (auto status = check_sources(data); !status) return status;
  if (auto status = check_spread(data.positions); !status) return status;
  return check_agreement(data);
}

}  // namespace brainshift::inversion
