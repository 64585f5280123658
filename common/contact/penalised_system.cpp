// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/contact/penalised_system.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>

namespace brainshift::contact {

PenalisedSystem::PenalisedSystem(const ForwardModel& forward)
    : forward_(forward), active_(static_cast<std::size_t>(forward.contact().num_slaves()), 0) {}

Status PenalisedSystem::activate(const ActiveSet& active) {
  if (active == active_) return {};
  active_ = active;
  if (count(active_) > 0) ++changes_;
  return refresh();
}

Status PenalisedSystem::solve_with_gaps(const Points& b, Points& u) const {
  Points b_p = b;
  forward_.contact().add_load(b_p, active_);
  return solve(b_p, u);
}

Result<bool> PenalisedSystem::follow_contact(const Points& b, Points& u) {
  const ActiveSet penetrating = forward_.contact().penetrating(u);
  if (penetrating == active_) return false;
  if (auto status = activate(penetrating); !status) return tl::unexpected(status.error());
  if (auto status = solve_with_gaps(b, u); !status) return tl::unexpected(status.error());
  return true;
}

RefactorisedSystem::RefactorisedSystem(const ForwardModel& forward)
    : PenalisedSystem(forward), penalised_(forward.factor().clone_analysis()) {}

Status RefactorisedSystem::refresh() {
  if (count(active()) == 0) return {};
  matrix_ = forward().stiffness();
  forward().contact().add_stiffness(matrix_, forward().dofs(), active());
  norm_ = linalg::max_norm(matrix_);
  return penalised_.refactorise(matrix_);
}

Status RefactorisedSystem::solve(const Points& f, Points& u) const {
  if (count(active()) == 0) return forward().solve(f, u);
  VecX unknowns;
  const auto quality =
      fem::checked_solve(matrix_, norm_, penalised_, forward().dofs().restrict_to(f), unknowns);
  if (!quality) return tl::unexpected(quality.error());
  forward().dofs().expand(unknowns, u);
  return {};
}

namespace {

// Right-hand sides per block. A solve then costs about a fifth of a single one, and a block of
// the default head takes 28 MB.
constexpr std::size_t kBlock = 64;

}  // namespace

WoodburySystem::WoodburySystem(const ForwardModel& forward)
    : PenalisedSystem(forward),
      known_(static_cast<std::size_t>(forward.contact().num_slaves()), 0) {
  phi_.resize(forward.contact().num_slaves(), forward.contact().num_slaves());
}

int WoodburySystem::columns() const {
  return static_cast<int>(std::count(known_.begin(), known_.end(), 1));
}

// Slaves carry the identity frame and no constraint (contact/penalty.hpp), so their unknowns are
// x, y, z.
Status WoodburySystem::solve_columns(const std::vector<int>& slaves) {
  const auto& pairs = forward().contact().pairs();
  const fem::DofMap& dofs = forward().dofs();
  Eigen::MatrixXd rhs, x;
  for (std::size_t begin = 0; begin < slaves.size(); begin += kBlock) {
    const auto width = static_cast<Eigen::Index>(std::min(kBlock, slaves.size() - begin));
    rhs.setZero(width, dofs.num_unknowns());
    for (Eigen::Index j = 0; j < width; ++j) {
      const ContactPair& pair = pairs[slaves[begin + j]];
      for (int axis = 0; axis < 3; ++axis) {
        rhs(j, dofs.unknown(pair.slave, axis)) = pair.normal[axis];
      }
    }
    forward().factor().solve_rows(rhs, x, workspace_);
    const auto quality = fem::check_rows(forward().stiffness(), forward().stiffness_norm(),
                                         forward().factor(), rhs, x, workspace_);
    if (!quality) return tl::unexpected(quality.error());
    for (Eigen::Index j = 0; j < width; ++j) {
      const int column = slaves[begin + j];
      for (Eigen::Index i = 0; i < phi_.rows(); ++i) {
        const int first = dofs.unknown(pairs[i].slave, 0);
        phi_(i, column) = x.row(j).segment<3>(first).dot(pairs[i].normal);
      }
      known_[column] = 1;
    }
  }
  return {};
}

Status WoodburySystem::refresh() {
  set_.clear();
  std::vector<int> missing;
  for (int i = 0; i < forward().contact().num_slaves(); ++i) {
    if (!active()[i]) continue;
    set_.push_back(i);
    if (!known_[i]) missing.push_back(i);
  }
  if (set_.empty()) return {};
  if (auto status = solve_columns(missing); !status) return status;
  Eigen::MatrixXd capacitance = phi_(set_, set_);
  capacitance.diagonal().array() += 1.0 / forward().contact().beta();
  capacitance_.compute(capacitance);
  if (capacitance_.info() != Eigen::Success) {
    return fail(ErrorCode::kSingularMatrix, "contact compliance of " + std::to_string(set_.size()) +
                                                " active slaves is not positive definite");
  }
  return {};
}

Status WoodburySystem::apply(const Points& f, const VecX& gaps, Points& u, VecX& c) const {
  if (auto status = forward().solve(f, u); !status) return status;
  const auto& pairs = forward().contact().pairs();
  c.resize(static_cast<Eigen::Index>(set_.size()));
  for (std::size_t i = 0; i < set_.size(); ++i) {
    c[i] = pairs[set_[i]].normal.dot(u.col(pairs[set_[i]].slave)) - gaps[i];
  }
  capacitance_.solveInPlace(c);
  Points corrected = f;
  for (std::size_t i = 0; i < set_.size(); ++i) {
    corrected.col(pairs[set_[i]].slave) -= c[i] * pairs[set_[i]].normal;
  }
  return forward().solve(corrected, u);
}

VecX WoodburySystem::imbalance(const Points& u, const VecX& c, const VecX& gaps) const {
  const auto& pairs = forward().contact().pairs();
  VecX left = c;
  for (std::size_t i = 0; i < set_.size(); ++i) {
    const ContactPair& pair = pairs[set_[i]];
    left[i] -= forward().contact().beta() * (pair.normal.dot(u.col(pair.slave)) - gaps[i]);
  }
  return left;
}

Status WoodburySystem::solve(const Points& f, Points& u) const {
  return solve_with(f, VecX::Zero(static_cast<Eigen::Index>(set_.size())), u);
}

Status WoodburySystem::solve_with_gaps(const Points& b, Points& u) const {
  VecX gaps(static_cast<Eigen::Index>(set_.size()));
  for (std::size_t i = 0; i < set_.size(); ++i) {
    gaps[i] = forward().contact().pairs()[set_[i]].initial_penetration_mm;
  }
  return solve_with(b, gaps, u);
}

Status WoodburySystem::solve_with(const Points& f, const VecX& gaps, Points& u) const {
  if (set_.empty()) return forward().solve(f, u);
  const VecX none = VecX::Zero(gaps.size());
  VecX c;
  if (auto status = apply(f, gaps, u, c); !status) return status;
  const double beta = forward().contact().beta();
  for (int refinements = 0;; ++refinements) {
    const VecX left = imbalance(u, c, gaps);
    const double scale = beta * u.cwiseAbs().maxCoeff() + f.cwiseAbs().maxCoeff();
    const double eta = left.cwiseAbs().maxCoeff();
    if (eta <= linalg::kRefuseAbove * scale) return {};
    if (refinements == linalg::kMaxRefinements) {
      return fail(
          ErrorCode::kSingularMatrix,
          fmt::format("low-rank correction for {} active slaves: relative imbalance {:g} is "
                      "above {:g}",
                      set_.size(), eta / scale, linalg::kRefuseAbove));
    }
    Points residual = Points::Zero(3, f.cols());
    for (std::size_t i = 0; i < set_.size(); ++i) {
      const ContactPair& pair = forward().contact().pairs()[set_[i]];
      residual.col(pair.slave) += left[i] * pair.normal;
    }
    Points du;
    VecX dc;
    if (auto status = apply(residual, none, du, dc); !status) return status;
    u += du;
    c += dc - left;  // K du = N_A (left - dc), so that K u + N_A c = f still holds
  }
}

}  // namespace brainshift::contact
