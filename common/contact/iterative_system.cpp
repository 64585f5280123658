// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/contact/iterative_system.hpp"

#include <fmt/format.h>

namespace brainshift::contact {
namespace {

// Largest ratio of the true residual to the tolerance. The residual of the recurrence drifts from
// it.
constexpr double kDrift = 10.0;

}  // namespace

IterativeSystem::IterativeSystem(const ForwardModel& forward, const IterativeOptions& options)
    : PenalisedSystem(forward), options_(options) {
  solver_.setMaxIterations(options.max_iterations);
}

Result<std::unique_ptr<IterativeSystem>> IterativeSystem::build(const ForwardModel& forward,
                                                                const IterativeOptions& options) {
  std::unique_ptr<IterativeSystem> system(new IterativeSystem(forward, options));
  if (auto status = system->refresh(); !status) return tl::unexpected(status.error());
  return system;
}

Status IterativeSystem::refresh() {
  matrix_ = forward().stiffness();
  forward().contact().add_stiffness(matrix_, forward().dofs(), active());
  solver_.compute(matrix_);
  if (solver_.info() != Eigen::Success) {
    return fail(ErrorCode::kSingularMatrix,
                fmt::format("stiffness matrix with {} active slaves has no incomplete factor",
                            count(active())));
  }
  return {};
}

// Moves q by sum_A N (N . r) / beta, which is what the springs of the active slaves take up, if
// that lowers the residual r = rhs - K_p q (with soft springs it does not). Slaves carry the
// identity frame and no constraint.
void IterativeSystem::lift(const VecX& rhs, VecX& residual, VecX& q) const {
  const PenaltyContact& contact = forward().contact();
  VecX lifted = q;
  for (int i = 0; i < contact.num_slaves(); ++i) {
    if (!active()[static_cast<std::size_t>(i)]) continue;
    const ContactPair& pair = contact.pairs()[static_cast<std::size_t>(i)];
    const int first = forward().dofs().unknown(pair.slave, 0);
    lifted.segment<3>(first) +=
        pair.normal * (pair.normal.dot(residual.segment<3>(first)) / contact.beta());
  }
  VecX left = rhs - linalg::multiply(matrix_, lifted);
  if (!(left.norm() < residual.norm())) return;
  q.swap(lifted);
  residual.swap(left);
}

Status IterativeSystem::solve(const Points& f, Points& u) const {
  const fem::DofMap& dofs = forward().dofs();
  const VecX rhs = dofs.restrict_to(f);
  VecX q = VecX::Zero(rhs.size());
  VecX residual = rhs;
  lift(rhs, residual, q);
  const double scale = residual.norm();
  if (u.cols() == f.cols()) {
    q = dofs.restrict_to(u);
    residual = rhs - linalg::multiply(matrix_, q);
    lift(rhs, residual, q);
  }
  const double limit = options_.tolerance * scale;
  int iterations = 0;
  if (!(residual.norm() <= limit)) {
    solver_.setTolerance(limit / residual.norm());
    q += solver_.solve(residual);
    iterations = static_cast<int>(solver_.iterations());
    residual =
        rhs - linalg::multiply(matrix_, q);  // the true one: the recurrence of the method drifts
  }
  iterations_ += iterations;
  if (!(residual.norm() <= kDrift * limit)) {
    return fail(ErrorCode::kNotConverged,
                fmt::format("iterative solver: relative residual {:g} after {} iterations is above "
                            "{:g}",
                            residual.norm() / scale, iterations, kDrift * options_.tolerance));
  }
  dofs.expand(q, u);
  return {};
}

}  // namespace brainshift::contact
