// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/contact_reduction.hpp"

#include <string>

#include "common/linalg/blas.hpp"

namespace brainshift::inversion {

namespace blas = linalg::blas;

ContactReduction::ContactReduction(const CondensedOperators& operators, ModeWindow window,
                                   double beta, ThreadTeam& team)
    : operators_(operators),
      window_(window),
      beta_(beta),
      team_(team),
      factor_storage_(new double[static_cast<std::size_t>(operators.compliance.size())]),
      response_(operators.num_slaves(), window.count + 1),
      forces_(operators.num_slaves()),
      all_forces_(VecX::Zero(operators.num_slaves())),
      penetration_(operators.initial_penetration_mm),
      diagonal_(operators.compliance.diagonal()) {
  active_.reserve(static_cast<std::size_t>(operators.num_slaves()));
  set_.reserve(static_cast<std::size_t>(operators.num_slaves()));
}

Status ContactReduction::activate(const contact::ActiveSet& set) {
  if (set == set_) return {};
  set_ = set;
  active_.clear();
  for (std::size_t i = 0; i < set.size(); ++i) {
    if (set[i]) active_.push_back(static_cast<int>(i));
  }
  const int k = size();
  if (k == 0) return {};
  Eigen::Map<Eigen::MatrixXd> d(factor_storage_.get(), k, k);
  Eigen::Map<Eigen::MatrixXd> response(response_.data(), k, window_.count + 1);
  for (int j = 0; j < k; ++j) {
    const double* column = operators_.compliance.col(active_[static_cast<std::size_t>(j)]).data();
    for (int i = j; i < k; ++i) d(i, j) = column[active_[static_cast<std::size_t>(i)]];
    d(j, j) += 1.0 / beta_;
  }
  for (int j = 0; j < window_.count; ++j) {
    const double* column = operators_.slave_modes.col(window_.first + j).data();
    for (int i = 0; i < k; ++i) response(i, j) = column[active_[static_cast<std::size_t>(i)]];
  }
  for (int i = 0; i < k; ++i) {
    response(i, window_.count) =
        operators_.initial_penetration_mm[active_[static_cast<std::size_t>(i)]];
  }
  if (!blas::cholesky(d)) {
    set_.clear();
    active_.clear();
    return fail(ErrorCode::kSingularMatrix, "contact: the compliance of " + std::to_string(k) +
                                                " active slaves is not positive definite");
  }
  team_.split(response.cols(), [&](long begin, long end) {
    auto columns = response.middleCols(begin, end - begin);
    blas::solve_lower(d, columns);
    blas::solve_lower_transposed(d, columns);
  });
  return {};
}

Eigen::MatrixXd ContactReduction::response_before() const {
  const int k = size();
  Eigen::MatrixXd response(k, window_.first);
  if (k == 0) return response;
  for (int i = 0; i < k; ++i) {
    response.row(i) =
        operators_.slave_modes.row(active_[static_cast<std::size_t>(i)]).head(window_.first);
  }
  const Eigen::Map<const Eigen::MatrixXd> factor(factor_storage_.get(), k, k);
  blas::solve_lower(factor, response);
  blas::solve_lower_transposed(factor, response);
  return response;
}

void ContactReduction::update_forces(const VecX& z) {
  const int k = size();
  const auto modes = operators_.slave_modes.middleCols(window_.first, window_.count);
  penetration_.noalias() = operators_.initial_penetration_mm - modes * z;
  all_forces_.setZero();
  if (k == 0) return;
  const auto t = response();
  auto f = forces_.head(k);
  f = t.col(window_.count);
  f.noalias() -= t.leftCols(window_.count) * z;
  for (int j = 0; j < k; ++j) all_forces_[active_[static_cast<std::size_t>(j)]] = f[j];
  team_.split(penetration_.size(), [&](long begin, long end) {
    for (int j = 0; j < k; ++j) {
      const int slave = active_[static_cast<std::size_t>(j)];
      blas::add_scaled(end - begin, -f[j], operators_.compliance.col(slave).data() + begin,
                       penetration_.data() + begin);
    }
  });
  // By construction; the sum above has it up to rounding.
  for (int j = 0; j < k; ++j) penetration_[active_[static_cast<std::size_t>(j)]] = f[j] / beta_;
}

}  // namespace brainshift::inversion
