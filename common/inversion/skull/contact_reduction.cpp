// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/skull/contact_reduction.hpp"

namespace brainshift::inversion {

ContactReduction::ContactReduction(const CondensedOperators& operators, ModeWindow window,
                                   ContactFactor& factor, ThreadTeam& team)
    : operators_(operators),
      window_(window),
      factor_(factor),
      team_(team),
      response_(operators.num_slaves(), window.count + 1),
      work_(ContactFactor::most_work_rows(operators), window.count + 1) {
  active_.reserve(static_cast<std::size_t>(operators.num_slaves()));
  set_.reserve(static_cast<std::size_t>(operators.num_slaves()));
}

Status ContactReduction::activate(const contact::ActiveSet& set) {
  if (set == set_) return {};
  set_.clear();
  active_.clear();
  if (auto status = factor_.take(set); !status) return status;
  set_ = set;
  active_ = factor_.active();
  const int k = size();
  if (k == 0) return {};
  Eigen::Map<Eigen::MatrixXd> response(response_.data(), k, window_.count + 1);
  for (int j = 0; j < window_.count; ++j) {
    const double* column = operators_.slave_modes.col(window_.first + j).data();
    for (int i = 0; i < k; ++i) response(i, j) = column[active_[static_cast<std::size_t>(i)]];
  }
  for (int i = 0; i < k; ++i) {
    response(i, window_.count) =
        operators_.initial_penetration_mm[active_[static_cast<std::size_t>(i)]];
  }
  team_.split(response.cols(), [&](long begin, long end) {
    factor_.solve(response.middleCols(begin, end - begin),
                  work_.block(0, begin, factor_.work_rows(), end - begin));
  });
  return {};
}

void ContactReduction::forces_at(const VecX& z, Eigen::Ref<VecX> out) const {
  out = response().col(window_.count);
  out.noalias() -= response().leftCols(window_.count) * z;
}

Result<Eigen::MatrixXd> ContactReduction::response_before() const {
  const int k = size();
  Eigen::MatrixXd response(k, window_.first);
  if (k == 0) return response;
  if (auto status = factor_.take(set_); !status) return tl::unexpected(status.error());
  for (int i = 0; i < k; ++i) {
    response.row(i) =
        operators_.slave_modes.row(active_[static_cast<std::size_t>(i)]).head(window_.first);
  }
  Eigen::MatrixXd work(factor_.work_rows(), window_.first);
  factor_.solve(response, work);
  return response;
}

}  // namespace brainshift::inversion
