// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/skull/contact_system.hpp"

#include <string>

namespace brainshift::inversion {

namespace blas = linalg::blas;

void subtract_penetration(const CondensedOperators& operators, const std::vector<int>& slaves,
                          const Eigen::Ref<const VecX>& change, ThreadTeam& team,
                          VecX& penetration) {
  team.split(penetration.size(), [&](long begin, long end) {
    for (std::size_t j = 0; j < slaves.size(); ++j) {
      blas::add_scaled(end - begin, -change[static_cast<Eigen::Index>(j)],
                       operators.compliance.col(slaves[j]).data() + begin,
                       penetration.data() + begin);
    }
  });
}

ContactSystem::ContactSystem(const CondensedOperators& operators, ModeWindow window, double beta,
                             ThreadTeam& team)
    : operators_(operators),
      window_(window),
      beta_(beta),
      team_(team),
      pressing_(operators.compliance.data(), operators.num_slaves(), 1.0 / beta, team),
      released_(operators, window, beta, team),
      work_(PrincipalFactor::most_work_rows(operators.num_slaves()), window.count + 1) {
  set_.reserve(static_cast<std::size_t>(operators.num_slaves()));
  active_.reserve(static_cast<std::size_t>(operators.num_slaves()));
}

Status ContactSystem::take(const contact::ActiveSet& set) {
  if (set == set_) return {};
  set_ = set;
  list_active(set, active_);
  by_released_ = size() > kMost * operators_.num_slaves();
  if (by_released_ ? released_.take(set) : pressing_.take(set)) return {};
  const std::string slaves = std::to_string(size());
  set_.clear();
  active_.clear();
  return fail(ErrorCode::kSingularMatrix,
              "contact: the compliance of " + slaves + " active slaves is not positive definite");
}

void ContactSystem::forget() {
  pressing_.forget();
  released_.forget();
  set_.clear();
  active_.clear();
}

void ContactSystem::solve(const VecX& z, const VecX& free_penetration, Eigen::Ref<VecX> forces,
                          VecX& penetration) {
  if (by_released_) {
    released_.solve(z, forces, penetration);
    return;
  }
  gather(free_penetration.data(), active_, forces.data());
  pressing_.solve(forces, work_.topLeftCorner(pressing_.work_rows(), 1));
  penetration = free_penetration;
  subtract_penetration(operators_, active_, forces, team_, penetration);
  // By construction; the sum has it up to rounding.
  for (int j = 0; j < size(); ++j) {
    penetration[active_[static_cast<std::size_t>(j)]] = forces[j] / beta_;
  }
}

void ContactSystem::respond(Eigen::Ref<Eigen::MatrixXd> out) {
  if (by_released_) {
    released_.respond(out);
    return;
  }
  const Eigen::Index r = window_.count;
  team_.split(r + 1, [&](long begin, long end) {
    for (Eigen::Index j = begin; j < end; ++j) {
      const double* load = j < r ? operators_.slave_modes.col(window_.first + j).data()
                                 : operators_.initial_penetration_mm.data();
      gather(load, active_, out.col(j).data());
    }
    pressing_.solve(out.middleCols(begin, end - begin),
                    work_.block(0, begin, pressing_.work_rows(), end - begin));
  });
}

void ContactSystem::add_adjoint(const Eigen::Ref<const VecX>& felt, VecX& out) {
  if (by_released_) {
    released_.add_adjoint(felt, out);
    return;
  }
  adjoint_ = felt;
  pressing_.solve(adjoint_, work_.topLeftCorner(pressing_.work_rows(), 1));
  for (int j = 0; j < size(); ++j) {
    out += adjoint_[j] * operators_.slave_modes.row(active_[static_cast<std::size_t>(j)])
                             .segment(window_.first, window_.count)
                             .transpose();
  }
}

void ContactSystem::solve(blas::Out<double> b) {
  if (by_released_) {
    released_.solve(b);
    return;
  }
  Eigen::MatrixXd work(pressing_.work_rows(), b.cols());
  pressing_.solve(b, work);
}

}  // namespace brainshift::inversion
