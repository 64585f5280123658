// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/twin/truth.hpp"

#include <Eigen/LU>
#include <string>
#include <utility>

namespace brainshift::client {

TruthSolver::TruthSolver(const contact::ForwardModel& forward)
    : forward_(forward),
      penalised_(forward.factor().clone_analysis()),
      active_(static_cast<std::size_t>(forward.contact().num_slaves()), 0) {}

// x = K_A^-1 b from y = K_F^-1 b, where A and F differ by few slaves (Woodbury): with their normals as columns
// of V and S = diag(+beta where added, -beta where dropped), K_A = K_F + V S V^T and
//   x = y - Y (S^-1 + V^T Y)^-1 V^T y,   Y = K_F^-1 V
void TruthSolver::correct(const contact::ActiveSet& active, const std::vector<int>& changed,
                          VecX& x) const {
  const contact::PenaltyContact& contact = forward_.contact();
  Eigen::MatrixXd V(x.size(), static_cast<Eigen::Index>(changed.size()));
  VecX compliance(V.cols());  // S^-1
  for (Eigen::Index k = 0; k < V.cols(); ++k) {
    const int slave = changed[static_cast<std::size_t>(k)];
    const contact::ContactPair& pair = contact.pairs()[static_cast<std::size_t>(slave)];
    Points normal = Points::Zero(3, forward_.dofs().num_nodes());
    normal.col(pair.slave) = pair.normal;
    V.col(k) = forward_.dofs().restrict_to(normal);
    compliance[k] = (active[static_cast<std::size_t>(slave)] != 0 ? 1.0 : -1.0) / contact.beta();
  }
  const Eigen::MatrixXd Y = penalised_.solve_many(V);
  Eigen::MatrixXd C = V.transpose() * Y;
  C.diagonal() += compliance;
  x -= Y * C.partialPivLu().solve(V.transpose() * x);
}

Result<Points> TruthSolver::solve_with(const contact::ActiveSet& active, const Points& load) {
  if (contact::count(active) == 0) {
    Points free;
    if (Status ok = forward_.solve(load, free); !ok) return tl::unexpected(ok.error());
    return free;
  }
  std::vector<int> changed;
  for (std::size_t i = 0; i < factored_.size(); ++i) {
    if (active[i] != factored_[i]) changed.push_back(static_cast<int>(i));
  }
  if (factored_.empty() || changed.size() > kMaxCorrected) {
    linalg::SymmetricMatrix k_p = forward_.stiffness();
    forward_.contact().add_stiffness(k_p, forward_.dofs(), active);
    factored_.clear();  // a failed factorisation leaves nothing to reuse
    changed.clear();
    if (Status ok = penalised_.refactorise(k_p); !ok) return tl::unexpected(ok.error());
    factored_ = active;
  }
  Points b_p = load;
  forward_.contact().add_load(b_p, active);
  VecX x = penalised_.solve(forward_.dofs().restrict_to(b_p));
  if (!changed.empty()) correct(active, changed, x);
  return forward_.dofs().expand(x);
}

Result<Truth> TruthSolver::solve(const Points& load) {
  Truth truth;
  while (truth.iterations < kMaxIterations) {
    auto displacement = solve_with(active_, load);
    if (!displacement) return tl::unexpected(displacement.error());
    ++truth.iterations;
    contact::ActiveSet next = forward_.contact().penetrating(*displacement);
    const bool repeats = next == active_;
    active_ = std::move(next);
    if (!repeats) continue;
    truth.active = contact::count(active_);
    if (forward_.contact().num_slaves() > 0) {
      truth.max_penetration_mm = forward_.contact().penetration(*displacement).maxCoeff();
    }
    truth.displacement = std::move(*displacement);
    return truth;
  }
  return fail(ErrorCode::kNotConverged, "the contact search of the truth did not settle after " +
                                            std::to_string(kMaxIterations) + " solves");
}

}  // namespace brainshift::client
