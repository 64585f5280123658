// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/skull/contact_system.hpp"

#include <algorithm>
#include <string>

namespace brainshift::inversion {
namespace {

namespace blas = linalg::blas;

constexpr Eigen::Index kTile = 64;

// The upper triangle becomes the lower one's mirror image.
void mirror_lower(Eigen::Map<Eigen::MatrixXd> a, ThreadTeam& team) {
  const Eigen::Index n = a.rows(), tiles = (n + kTile - 1) / kTile;
  team.split(tiles, [&](long begin, long end) {
    for (Eigen::Index j = begin * kTile; j < std::min(n, end * kTile); j += kTile) {
      const Eigen::Index width = std::min(kTile, n - j);
      for (Eigen::Index i = 0; i < j; i += kTile) {
        a.block(i, j, kTile, width) = a.block(j, i, width, kTile).transpose();
      }
      a.block(j, j, width, width).triangularView<Eigen::StrictlyUpper>() =
          a.block(j, j, width, width).transpose();
    }
  });
}

}  // namespace

ReleasedSlaves::ReleasedSlaves(const CondensedOperators& operators, ModeWindow window, double beta,
                               ThreadTeam& team)
    : operators_(operators),
      window_(window),
      beta_(beta),
      team_(team),
      inverse_(new double[static_cast<std::size_t>(operators.compliance.size())]),
      factor_(inverse_.get(), operators.num_slaves(), 0.0, team),
      released_set_(static_cast<std::size_t>(operators.num_slaves()), 0),
      loads_(operators.num_slaves(), window.count + 1),
      all_(operators.num_slaves()),
      released_(operators.num_slaves()),
      response_(operators.num_slaves(), window.count + 1),
      work_(PrincipalFactor::most_work_rows(operators.num_slaves()), window.count + 1),
      gathered_(new double[static_cast<std::size_t>(operators.compliance.size()) / 4 + 1]) {
  pressing_.reserve(static_cast<std::size_t>(operators.num_slaves()));
}

bool ReleasedSlaves::make_inverse() {
  auto e = inverse();
  e = operators_.compliance;
  e.diagonal().array() += 1.0 / beta_;
  if (!linalg::cholesky(e, team_) || !blas::invert_factored(e)) return false;
  mirror_lower(e, team_);
  const Eigen::Index r = window_.count;
  response_.leftCols(r) = operators_.slave_modes.middleCols(window_.first, r);
  response_.col(r) = operators_.initial_penetration_mm;
  team_.split(r + 1, [&](long begin, long end) {
    blas::multiply(1.0, e, response_.middleCols(begin, end - begin), 0.0,
                   loads_.middleCols(begin, end - begin));
  });
  return true;
}

bool ReleasedSlaves::take(const contact::ActiveSet& pressing) {
  prepare();
  if (!made_) return false;
  for (std::size_t i = 0; i < pressing.size(); ++i) released_set_[i] = pressing[i] ? 0 : 1;
  list_active(pressing, pressing_);
  return factor_.take(released_set_);
}

void ReleasedSlaves::solve(const VecX& z, Eigen::Ref<VecX> forces, VecX& penetration) {
  const Eigen::Index r = window_.count;
  const std::vector<int>& released = factor_.active();
  team_.split(slaves(), [&](long begin, long end) {
    all_.segment(begin, end - begin).noalias() =
        loads_.col(r).segment(begin, end - begin) -
        loads_.middleRows(begin, end - begin).leftCols(r) * z;
  });
  auto depth = released_.head(factor_.size());
  gather(all_.data(), released, depth.data());
  factor_.solve(depth, work_.topLeftCorner(factor_.work_rows(), 1));
  team_.split(slaves(), [&](long begin, long end) {
    for (std::size_t j = 0; j < released.size(); ++j) {
      blas::add_scaled(end - begin, -depth[static_cast<Eigen::Index>(j)],
                       column(released[j]) + begin, all_.data() + begin);
    }
  });
  for (std::size_t j = 0; j < pressing_.size(); ++j) {
    forces[static_cast<Eigen::Index>(j)] = all_[pressing_[j]];
    penetration[pressing_[j]] = all_[pressing_[j]] / beta_;
  }
  for (std::size_t j = 0; j < released.size(); ++j) {
    penetration[released[j]] = depth[static_cast<Eigen::Index>(j)];
  }
}

Eigen::Map<Eigen::MatrixXd> ReleasedSlaves::gather_between() {
  const std::vector<int>& released = factor_.active();
  Eigen::Map<Eigen::MatrixXd> between(gathered_.get(), factor_.size(),
                                      static_cast<Eigen::Index>(pressing_.size()));
  team_.split(between.cols(), [&](long begin, long end) {
    for (Eigen::Index j = begin; j < end; ++j) {
      gather(column(pressing_[static_cast<std::size_t>(j)]), released, between.col(j).data());
    }
  });
  return between;
}

// D_AA^-1 D_AQ = -E_AQ E_QQ^-1 and D_AA^-1 = E_AA - E_AQ E_QQ^-1 E_QA.
void ReleasedSlaves::respond_to_changes(const std::vector<int>& left,
                                        const std::vector<int>& joined,
                                        Eigen::Ref<Eigen::MatrixXd> out) {
  const auto q = static_cast<Eigen::Index>(factor_.size());
  const auto away = static_cast<Eigen::Index>(left.size());
  const std::vector<int>& released = factor_.active();
  const auto between = gather_between();
  auto depth = response_.topLeftCorner(q, out.cols());
  team_.split(out.cols(), [&](long begin, long end) {
    for (Eigen::Index c = begin; c < end; ++c) {
      if (c < away) {
        const int slave = left[static_cast<std::size_t>(c)];
        depth.col(c).setZero();
        depth(std::lower_bound(released.begin(), released.end(), slave) - released.begin(), c) =
            1.0;
        out.col(c).setZero();
      } else {
        const double* own = column(joined[static_cast<std::size_t>(c - away)]);
        gather(own, released, depth.col(c).data());
        gather(own, pressing_, out.col(c).data());
      }
    }
    if (q == 0) return;
    auto own = depth.middleCols(begin, end - begin);
    factor_.solve(own, work_.block(0, begin, factor_.work_rows(), end - begin));
    blas::multiply_transposed(-1.0, between, own, 1.0, out.middleCols(begin, end - begin));
  });
}

void ReleasedSlaves::respond(Eigen::Ref<Eigen::MatrixXd> out) {
  const auto q = static_cast<Eigen::Index>(factor_.size());
  const std::vector<int>& released = factor_.active();
  const auto between = gather_between();
  auto depth = response_.topRows(q);
  team_.split(out.cols(), [&](long begin, long end) {
    for (Eigen::Index c = begin; c < end; ++c) {
      gather(loads_.col(c).data(), released, depth.col(c).data());
      gather(loads_.col(c).data(), pressing_, out.col(c).data());
    }
    auto own = depth.middleCols(begin, end - begin);
    factor_.solve(own, work_.block(0, begin, factor_.work_rows(), end - begin));
    if (q > 0) {
      blas::multiply_transposed(-1.0, between, own, 1.0, out.middleCols(begin, end - begin));
    }
  });
}

// With w_A = felt, w_Q = -E_QQ^-1 E_QA felt: L_A^T D_AA^-1 felt = (E L)^T w.
void ReleasedSlaves::add_adjoint(const Eigen::Ref<const VecX>& felt, VecX& out) {
  const std::vector<int>& released = factor_.active();
  all_.setZero();
  for (std::size_t j = 0; j < pressing_.size(); ++j) {
    all_[pressing_[j]] = felt[static_cast<Eigen::Index>(j)];
  }
  auto depth = released_.head(factor_.size());
  team_.split(depth.size(), [&](long begin, long end) {
    for (Eigen::Index j = begin; j < end; ++j) {
      depth[j] =
          all_.dot(Eigen::Map<const VecX>(column(released[static_cast<std::size_t>(j)]), slaves()));
    }
  });
  factor_.solve(depth, work_.topLeftCorner(factor_.work_rows(), 1));
  for (std::size_t j = 0; j < released.size(); ++j) {
    all_[released[j]] = -depth[static_cast<Eigen::Index>(j)];
  }
  out.noalias() += loads_.leftCols(window_.count).transpose() * all_;
}

void ReleasedSlaves::solve(blas::Out<double> b) {
  Eigen::MatrixXd given = Eigen::MatrixXd::Zero(slaves(), b.cols());
  given(pressing_, Eigen::all) = b;
  Eigen::MatrixXd solved(slaves(), b.cols());
  blas::multiply(1.0, inverse(), given, 0.0, solved);
  const std::vector<int>& released = factor_.active();
  Eigen::MatrixXd depth = solved(released, Eigen::all);
  Eigen::MatrixXd work(factor_.work_rows(), b.cols());
  factor_.solve(depth, work);
  given.setZero();
  given(released, Eigen::all) = depth;
  blas::multiply(-1.0, inverse(), given, 1.0, solved);
  b = solved(pressing_, Eigen::all);
}

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
      modes_of_slave_(operators.slave_modes.middleCols(window.first, window.count).transpose()),
      work_(PrincipalFactor::most_work_rows(operators.num_slaves()), window.count + 1) {
  set_.reserve(static_cast<std::size_t>(operators.num_slaves()));
  active_.reserve(static_cast<std::size_t>(operators.num_slaves()));
}

Status ContactSystem::take(const contact::ActiveSet& set) {
  if (set == set_) return {};
  set_ = set;
  list_active(set, active_);
  by_released_ = size() > kMax * operators_.num_slaves();
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
  if (by_released_) return released_.solve(z, forces, penetration);
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
  if (by_released_) return released_.respond(out);
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

void ContactSystem::respond_to_changes(const std::vector<int>& left, const std::vector<int>& joined,
                                       Eigen::Ref<Eigen::MatrixXd> out) {
  if (by_released_) return released_.respond_to_changes(left, joined, out);
  const auto away = static_cast<Eigen::Index>(left.size());
  team_.split(out.cols(), [&](long begin, long end) {
    for (Eigen::Index c = begin; c < end; ++c) {
      if (c < away) {
        gather(operators_.compliance.col(left[static_cast<std::size_t>(c)]).data(), active_,
               out.col(c).data());
      } else {
        const int slave = joined[static_cast<std::size_t>(c - away)];
        out.col(c).setZero();
        out(std::lower_bound(active_.begin(), active_.end(), slave) - active_.begin(), c) = 1.0;
      }
    }
    pressing_.solve(out.middleCols(begin, end - begin),
                    work_.block(0, begin, pressing_.work_rows(), end - begin));
  });
}

void ContactSystem::add_adjoint(const Eigen::Ref<const VecX>& felt, VecX& out) {
  if (by_released_) return released_.add_adjoint(felt, out);
  adjoint_ = felt;
  pressing_.solve(adjoint_, work_.topLeftCorner(pressing_.work_rows(), 1));
  for (int j = 0; j < size(); ++j) {
    out += adjoint_[j] * modes_of_slave_.col(active_[static_cast<std::size_t>(j)]);
  }
}

void ContactSystem::solve(blas::Out<double> b) {
  if (by_released_) return released_.solve(b);
  Eigen::MatrixXd work(pressing_.work_rows(), b.cols());
  pressing_.solve(b, work);
}

}  // namespace brainshift::inversion
