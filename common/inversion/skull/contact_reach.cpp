// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/skull/contact_reach.hpp"

#include <algorithm>

#include "common/linalg/blas.hpp"

namespace brainshift::inversion {

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
