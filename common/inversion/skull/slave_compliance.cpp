// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/skull/slave_compliance.hpp"

#include <algorithm>
#include <cmath>

#include "common/linalg/column_sums.hpp"

namespace brainshift::inversion {
namespace {

constexpr double kRoundingOfSingle = 0x1p-24;

}  // namespace

SlaveCompliance::SlaveCompliance(const CondensedOperators& operators, ThreadTeam& team)
    : operators_(operators),
      team_(team),
      single_(new float[static_cast<std::size_t>(operators.compliance.size())]),
      root_(operators.compliance.diagonal().cwiseMax(0.0).cwiseSqrt()),
      largest_root_(root_.size() > 0 ? root_.maxCoeff() : 0.0),
      sum_(operators.num_slaves()) {
  const Eigen::MatrixXd& phi = operators.compliance;
  team.split(phi.cols(), [&](long begin, long end) {
    for (long j = begin; j < end; ++j) {
      float* to = single_.get() + static_cast<std::ptrdiff_t>(j) * phi.rows();
      for (Eigen::Index i = 0; i < phi.rows(); ++i) to[i] = static_cast<float>(phi(i, j));
    }
  });
  columns_.reserve(static_cast<std::size_t>(operators.num_slaves()));
  factors_.reserve(static_cast<std::size_t>(operators.num_slaves()));
}

void SlaveCompliance::subtract(const std::vector<int>& slaves, const Eigen::Ref<const VecX>& forces,
                               VecX& penetration) {
  columns_.clear();
  factors_.clear();
  for (std::size_t j = 0; j < slaves.size(); ++j) {
    columns_.push_back(single_.get() + static_cast<std::ptrdiff_t>(slaves[j]) * sum_.size());
    factors_.push_back(static_cast<float>(forces[static_cast<Eigen::Index>(j)]));
  }
  team_.split(penetration.size(), [&](long begin, long end) {
    auto sum = sum_.segment(begin, end - begin);
    sum.setZero();
    linalg::add_columns(columns_.data(), factors_.data(), columns_.size(), begin, end - begin,
                        sum.data());
    penetration.segment(begin, end - begin) -= sum.cast<double>();
  });
}

double SlaveCompliance::error_mm(const std::vector<int>& slaves,
                                 const Eigen::Ref<const VecX>& forces) const {
  double sum = 0.0;
  for (std::size_t j = 0; j < slaves.size(); ++j) {
    sum += root_[slaves[j]] * std::abs(forces[static_cast<Eigen::Index>(j)]);
  }
  return kRoundingOfSingle * static_cast<double>(slaves.size() + 3) * largest_root_ * sum;
}

double SlaveCompliance::at(int slave, const std::vector<int>& slaves,
                           const Eigen::Ref<const VecX>& forces) const {
  const double* own = operators_.compliance.col(slave).data();
  double sum = 0.0;
  for (std::size_t j = 0; j < slaves.size(); ++j) {
    sum += own[slaves[j]] * forces[static_cast<Eigen::Index>(j)];
  }
  return sum;
}

}  // namespace brainshift::inversion
