// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/data_check.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <sstream>
#include <string>

namespace brainshift::inversion {

Status check_data(const SparseData& data) {
  const int m = data.size();
  if (data.displacements.cols() != m || data.sd_mm.size() != m) {
    std::ostringstream text;
    text << "sparse data: " << m << " positions, " << data.displacements.cols()
         << " displacements and " << data.sd_mm.size()
         << " standard deviations must be equal counts";
    return fail(ErrorCode::kInvalidArgument, text.str());
  }
  if (m < 3) {
    return fail(ErrorCode::kInvalidArgument,
                "sparse data: " + std::to_string(m) + " points, at least 3 are needed");
  }
  for (int i = 0; i < m; ++i) {
    if (!data.positions.col(i).allFinite() || !data.displacements.col(i).allFinite() ||
        !std::isfinite(data.sd_mm[i])) {
      return fail(ErrorCode::kNotFinite,
                  "sparse data: point " + std::to_string(i) +
                      " has a position, displacement or sd that is not finite");
    }
    if (!(data.sd_mm[i] > 0.0)) {
      std::ostringstream text;
      text << "sparse data: sd_mm[" << i << "] = " << data.sd_mm[i] << ": must be > 0";
      return fail(ErrorCode::kInvalidArgument, text.str());
    }
  }
  const Points centred = data.positions.colwise() - data.positions.rowwise().mean();
  const Eigen::SelfAdjointEigenSolver<Mat3> spread(centred * centred.transpose());
  const Vec3 variances = spread.eigenvalues();  // ascending
  if (!(variances[1] > kCollinearRatio * kCollinearRatio * variances[2])) {
    return fail(ErrorCode::kInvalidArgument, "sparse data: the " + std::to_string(m) +
                                                 " positions lie on one line or in one point");
  }
  return {};
}

}  // namespace brainshift::inversion
