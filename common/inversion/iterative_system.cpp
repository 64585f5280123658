// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/iterative_system.hpp"

#include <sstream>

namespace brainshift::inversion {

IterativeSystem::IterativeSystem(const contact::ForwardModel& forward,
                                 const IterativeOptions& options)
    : PenalisedSystem(forward) {
  solver_.setTolerance(options.tolerance);
  solver_.setMaxIterations(options.max_iterations);
}

Result<std::unique_ptr<IterativeSystem>> IterativeSystem::build(
    const contact::ForwardModel& forward, const IterativeOptions& options) {
  std::unique_ptr<IterativeSystem> system(new IterativeSystem(forward, options));
  if (auto status = system->refresh(); !status) return tl::unexpected(status.error());
  return system;
}

Status IterativeSystem::refresh() {
  matrix_ = forward().stiffness();
  forward().contact().add_stiffness(matrix_, forward().dofs(), active());
  solver_.compute(matrix_);
  if (solver_.info() != Eigen::Success) {
    return fail(ErrorCode::kSingularMatrix, "stiffness matrix with " +
                                                std::to_string(contact::count(active())) +
                                                " active slaves has no incomplete factor");
  }
  return {};
}

Status IterativeSystem::solve(const Points& f, Points& u) const {
  const fem::DofMap& dofs = forward().dofs();
  const bool guess = u.cols() == f.cols();
  const VecX q = guess ? VecX(solver_.solveWithGuess(dofs.restrict_to(f), dofs.restrict_to(u)))
                       : VecX(solver_.solve(dofs.restrict_to(f)));
  iterations_ += static_cast<int>(solver_.iterations());
  if (solver_.info() != Eigen::Success) {
    std::ostringstream text;
    text << "iterative solver: relative residual " << solver_.error() << " after "
         << solver_.iterations() << " iterations is above " << solver_.tolerance();
    return fail(ErrorCode::kNotConverged, text.str());
  }
  dofs.expand(q, u);
  return {};
}

}  // namespace brainshift::inversion
