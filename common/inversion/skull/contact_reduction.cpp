// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/skull/contact_reduction.hpp"

namespace brainshift::inversion {

ContactReduction::ContactReduction(const CondensedOperators& operators, ModeWindow window,
                                   ContactSystem& system)
    : operators_(operators),
      window_(window),
      system_(system),
      response_(operators.num_slaves(), window.count + 1) {
  active_.reserve(static_cast<std::size_t>(operators.num_slaves()));
  set_.reserve(static_cast<std::size_t>(operators.num_slaves()));
}

Status ContactReduction::activate(const contact::ActiveSet& set) {
  if (set == set_) return {};
  set_.clear();
  active_.clear();
  if (auto status = system_.take(set); !status) return status;
  set_ = set;
  active_ = system_.active();
  if (size() == 0) return {};
  system_.respond(Eigen::Map<Eigen::MatrixXd>(response_.data(), size(), window_.count + 1));
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
  if (auto status = system_.take(set_); !status) return tl::unexpected(status.error());
  response = operators_.slave_modes(active_, Eigen::seqN(0, window_.first));
  system_.solve(response);
  return response;
}

VecX ContactReduction::penetration_change(const VecX& dg, const VecX& dz, const VecX& df) const {
  VecX change = -operators_.slave_modes.leftCols(window_.first) * dg -
                operators_.slave_modes.middleCols(window_.first, window_.count) * dz;
  for (int j = 0; j < size(); ++j) {
    change -= df[j] * operators_.compliance.col(active_[static_cast<std::size_t>(j)]);
  }
  return change;
}

}  // namespace brainshift::inversion
