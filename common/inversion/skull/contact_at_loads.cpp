// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/skull/contact_at_loads.hpp"

#include <algorithm>
#include <string>

#include "common/linalg/blas.hpp"

namespace brainshift::inversion {
namespace {

namespace blas = linalg::blas;

constexpr double kShortestStep = 1e-6;

}  // namespace

ContactAtLoads::ContactAtLoads(const CondensedOperators& operators, ModeWindow window, double beta,
                               bool contact, ContactFactor& factor, ThreadTeam& team)
    : operators_(operators),
      window_(window),
      beta_(beta),
      contact_(contact),
      factor_(factor),
      team_(team),
      set_(static_cast<std::size_t>(operators.num_slaves()), 0),
      free_penetration_(operators.initial_penetration_mm),
      forces_(operators.num_slaves()),
      all_forces_(VecX::Zero(operators.num_slaves())),
      before_(VecX::Zero(operators.num_slaves())),
      penetration_(operators.initial_penetration_mm),
      work_(ContactFactor::most_work_rows(operators)) {
  const auto slaves = static_cast<std::size_t>(operators.num_slaves());
  active_.reserve(slaves);
}

void ContactAtLoads::forget() {
  std::fill(set_.begin(), set_.end(), char{0});
  active_.clear();
  all_forces_.setZero();
}

void ContactAtLoads::begin_from(const std::vector<int>& slaves,
                                const Eigen::Ref<const VecX>& forces) {
  all_forces_.setZero();
  for (std::size_t j = 0; j < slaves.size(); ++j) {
    all_forces_[slaves[j]] = std::max(0.0, forces[static_cast<Eigen::Index>(j)]);
  }
}

Status ContactAtLoads::solve(const VecX& z) {
  const auto modes = operators_.slave_modes.middleCols(window_.first, window_.count);
  team_.split(free_penetration_.size(), [&](long begin, long end) {
    free_penetration_.segment(begin, end - begin).noalias() =
        operators_.initial_penetration_mm.segment(begin, end - begin) -
        modes.middleRows(begin, end - begin) * z;
  });
  violation_mm_ = 0.0;
  sets_ = 0;
  if (!contact_) {
    penetration_ = free_penetration_;
    return {};
  }
  update_penetration();
  while (sets_ < kMaxSets) {
    // Free to press: slaves that do, and those that penetrate.
    for (std::size_t i = 0; i < set_.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      set_[i] = all_forces_[row] > 0.0 || penetration_[row] > kContactViolation_mm ? 1 : 0;
    }
    ++sets_;
    list_active(set_, active_);
    if (auto status = solve_forces(); !status) return status;
    before_ = all_forces_;
    const double value = dual();
    const bool all_press = size() == 0 || forces_.head(size()).minCoeff() >= 0.0;
    double step = 1.0;
    for (;; step *= 0.5) {
      all_forces_ = before_;
      for (int j = 0; j < size(); ++j) {
        const int slave = active_[static_cast<std::size_t>(j)];
        all_forces_[slave] = std::max(0.0, before_[slave] + step * (forces_[j] - before_[slave]));
      }
      update_penetration();
      if (all_press || step < kShortestStep || dual() < value) break;
    }
    violation_mm_ = 0.0;
    for (std::size_t i = 0; i < set_.size(); ++i) {
      if (!set_[i]) {
        violation_mm_ = std::max(violation_mm_, penetration_[static_cast<Eigen::Index>(i)]);
      }
    }
    if (!all_press || violation_mm_ > kContactViolation_mm) continue;
    for (const int slave : active_) {  // by construction; the sum has it up to rounding
      penetration_[slave] = all_forces_[slave] / beta_;
    }
    return {};
  }
  return fail(ErrorCode::kNotConverged,
              "contact: the active set of fixed loads did not settle in " +
                  std::to_string(kMaxSets) + " sets");
}

// 1/2 f D f - p f with D f = p - P + f / beta; penetration_ is that of all_forces_.
double ContactAtLoads::dual() const {
  return -0.5 * all_forces_.dot(free_penetration_ + penetration_ - all_forces_ / beta_);
}

Status ContactAtLoads::solve_forces() {
  if (auto status = factor_.take(set_); !status) return status;
  for (int j = 0; j < size(); ++j) {
    forces_[j] = free_penetration_[active_[static_cast<std::size_t>(j)]];
  }
  factor_.solve(forces_.head(size()), work_.head(factor_.work_rows()));
  return {};
}

Status ContactAtLoads::add_adjoint(const Eigen::Ref<const VecX>& felt, VecX& out) {
  if (auto status = factor_.take(set_); !status) return status;
  adjoint_ = felt;
  factor_.solve(adjoint_, work_.head(factor_.work_rows()));
  for (int j = 0; j < size(); ++j) {
    out += adjoint_[j] * operators_.slave_modes.row(active_[static_cast<std::size_t>(j)])
                             .segment(window_.first, window_.count)
                             .transpose();
  }
  return {};
}

void ContactAtLoads::update_penetration() {
  penetration_ = free_penetration_;
  team_.split(penetration_.size(), [&](long begin, long end) {
    for (Eigen::Index slave = 0; slave < all_forces_.size(); ++slave) {
      if (all_forces_[slave] == 0.0) continue;
      blas::add_scaled(end - begin, -all_forces_[slave],
                       operators_.compliance.col(slave).data() + begin,
                       penetration_.data() + begin);
    }
  });
}

}  // namespace brainshift::inversion
