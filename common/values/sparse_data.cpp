// SPDX-License-Identifier: Apache-2.0
#include "common/values/sparse_data.hpp"

#include <algorithm>

namespace brainshift {

int SparseData::rows() const {
  int rows = 0;
  for (int i = 0; i < size(); ++i) rows += along_direction(i) ? 1 : 3;
  return rows;
}

SparseData combine(const std::vector<SparseData>& parts) {
  Eigen::Index m = 0, q = 0;
  Eigen::Index hypotheses = 0;
  bool directed = false;
  for (const SparseData& part : parts) {
    m += part.size();
    q += part.common_error.rows() > 0 ? part.common_error.cols() : 0;
    directed = directed || part.directions.cols() > 0;
    hypotheses = std::max(hypotheses, part.common_variance.cols());
  }
  SparseData all;
  all.positions.resize(3, m);
  all.displacements.resize(3, m);
  all.sd_mm.resize(m);
  if (q > 0) all.common_error.setZero(3 * m, q);
  if (hypotheses > 0) all.common_variance.setOnes(q, hypotheses);
  if (directed) all.directions.setZero(3, m);
  Eigen::Index first = 0, column = 0;
  for (const SparseData& part : parts) {
    const Eigen::Index count = part.size();
    all.positions.middleCols(first, count) = part.positions;
    all.displacements.middleCols(first, count) = part.displacements;
    all.sd_mm.segment(first, count) = part.sd_mm;
    if (part.directions.cols() > 0) all.directions.middleCols(first, count) = part.directions;
    if (part.common_error.rows() > 0) {
      const Eigen::Index errors = part.common_error.cols();
      all.common_error.block(3 * first, column, 3 * count, errors) = part.common_error;
      const Eigen::MatrixXd& own = part.common_variance;
      for (Eigen::Index e = 0; own.cols() > 0 && e < hypotheses; ++e) {
        constexpr Eigen::Index kSizes = 3;  // of one length
        all.common_variance.block(column, e, errors, 1) =
            own.col(e < own.cols() ? e : std::clamp<Eigen::Index>(e - kSizes, 0, own.cols() - 1));
      }
      column += errors;
    }
    if (part.sources.empty()) all.sources.push_back({"", static_cast<int>(first), part.size()});
    for (DataSource source : part.sources) {
      source.first += static_cast<int>(first);
      all.sources.push_back(std::move(source));
    }
    first += count;
  }
  return all;
}

}  // namespace brainshift
