// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/skull/contact_reduction.hpp"

#include <algorithm>

#include "common/linalg/blas.hpp"

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

ContactReach::ContactReach(const CondensedOperators& operators, ModeWindow window, double beta,
                           bool contact, const ContactReduction& reduction, ThreadTeam& team)
    : operators_(operators),
      window_(window),
      beta_(beta),
      contact_(contact),
      reduction_(reduction),
      team_(team),
      opening_(operators.num_slaves()),
      closing_(operators.num_slaves()),
      crossings_(operators.num_slaves()) {}

double ContactReach::along(const VecX& step, const VecX& penetration, int most) {
  if (!contact_) return 1.0;
  const auto& active = reduction_.active();
  const int k = reduction_.size();
  auto opening = opening_.head(k);
  opening.noalias() = -reduction_.response().leftCols(window_.count) * step;
  const auto modes = operators_.slave_modes.middleCols(window_.first, window_.count);
  team_.split(closing_.size(), [&](long begin, long end) {
    closing_.segment(begin, end - begin).noalias() = -modes.middleRows(begin, end - begin) * step;
    for (int j = 0; j < k; ++j) {
      linalg::blas::add_scaled(
          end - begin, -opening[j],
          operators_.compliance.col(active[static_cast<std::size_t>(j)]).data() + begin,
          closing_.data() + begin);
    }
  });
  int count = 0;
  const auto cross = [&](double margin, double speed) {
    if (margin >= 0.0 && margin < speed) crossings_[count++] = margin / speed;
  };
  int next = 0;
  for (int slave = 0; slave < operators_.num_slaves(); ++slave) {
    if (next < k && active[static_cast<std::size_t>(next)] == slave) {
      cross(beta_ * penetration[slave], -opening[next]);
      ++next;
    } else {
      cross(-penetration[slave], closing_[slave]);
    }
  }
  if (count <= most) return 1.0;
  double* const crossing = crossings_.data() + most;
  std::nth_element(crossings_.data(), crossing, crossings_.data() + count);
  return std::max(kShortest, *crossing);
}

}  // namespace brainshift::inversion
