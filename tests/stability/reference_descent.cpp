// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/stability/reference_descent.hpp"

#include <algorithm>

namespace brainshift::stability {
namespace {

// K_p^-1 for a set by the identity of Sherman, Morrison and Woodbury on K^-1 N. Gaps go in as
// contact forces, f = D^-1 (0p - N^T K^-1 b) with D = Phi_AA + 1 / beta: as loads beta 0p N they
// would cancel to f / beta and leave nothing of it at large beta.
class PenalisedSolver {
 public:
  explicit PenalisedSolver(const ReferencePatient& patient)
      : patient_(patient), set_(static_cast<std::size_t>(patient.system.num_slaves()), 0) {}

  const contact::ActiveSet& set() const { return set_; }

  bool activate(const contact::ActiveSet& set) {
    set_ = set;
    slaves_.clear();
    for (std::size_t i = 0; i < set.size(); ++i) {
      if (set[i]) slaves_.push_back(static_cast<int>(i));
    }
    if (slaves_.empty()) return true;
    MatrixR d = patient_.compliance(slaves_, slaves_);
    d.diagonal().array() += 1 / patient_.system.beta();
    factor_.compute(d);
    columns_ = patient_.contact_columns(Eigen::all, slaves_);
    return factor_.info() == Eigen::Success;
  }

  // Nodal to nodal.
  VectorR solve(const VectorR& load) const {
    const Unknowns& unknowns = patient_.system.unknowns();
    const VectorR f = unknowns.restrict_to(load);
    VectorR q = patient_.system.solve_free(f).col(0);
    if (!slaves_.empty()) q -= columns_ * factor_.solve(VectorR(columns_.transpose() * f));
    return unknowns.expand(q);
  }

  // K_p^-1 (b + beta sum_A 0p N), and P of every slave.
  VectorR solve_with_gaps(const VectorR& load, VectorR& penetration) const {
    const Unknowns& unknowns = patient_.system.unknowns();
    VectorR q = patient_.system.solve_free(unknowns.restrict_to(load)).col(0);
    if (slaves_.empty()) {
      const VectorR u = unknowns.expand(q);
      penetration = patient_.system.penetration(u);
      return u;
    }
    const VectorR open = patient_.system.penetration(unknowns.expand(q));
    const VectorR forces = factor_.solve(VectorR(open(slaves_)));
    q += columns_ * forces;
    const VectorR u = unknowns.expand(q);
    penetration = patient_.system.penetration(u);
    penetration(slaves_) = forces / patient_.system.beta();
    return u;
  }

  // The slaves with P > 0 become the set: -1 when a factor fails, 1 when the set changed.
  int follow(const VectorR& b, VectorR& u, VectorR& penetration) {
    contact::ActiveSet next(set_.size());
    for (std::size_t i = 0; i < next.size(); ++i) {
      next[i] = penetration[static_cast<Eigen::Index>(i)] > 0;
    }
    if (next == set_) return 0;
    if (!activate(next)) return -1;
    u = solve_with_gaps(b, penetration);
    return 1;
  }

 private:
  const ReferencePatient& patient_;
  contact::ActiveSet set_;
  std::vector<int> slaves_;
  MatrixR columns_;
  CholeskyFactor factor_;
};

Real mean_norm(const VectorR& nodal) {
  const Eigen::Map<const PointsR> points(nodal.data(), 3, nodal.size() / 3);
  return points.colwise().norm().mean();
}

}  // namespace

std::optional<Descent> descend(const ReferencePatient& patient, const SparseData& data,
                               const InversionConfig& config, Steps steps) {
  constexpr PriorScaleValues kAsTheCaseSays = kAsInTheCase;
  const MatrixR a = sampling_rows(patient.mesh, data.positions);
  const VectorR d =
      Eigen::Map<const VecX>(data.displacements.data(), data.displacements.size()).cast<Real>();
  VectorR precision(d.size());
  for (Eigen::Index i = 0; i < d.size(); ++i) {
    precision[i] =
        1 / (static_cast<Real>(data.sd_mm[i / 3]) * static_cast<Real>(data.sd_mm[i / 3]));
  }
  const auto sigma = [&](const VectorR& w) {
    return VectorR(patient.covariance_times(w, kAsTheCaseSays).col(0));
  };
  PenalisedSolver system(patient);
  VectorR w = VectorR::Zero(3 * patient.mesh.num_nodes()), b = w;
  VectorR residual, direction, sigma_direction, gradient_before;
  Real norm_before = 0;
  Descent result;
  while (true) {
    VectorR penetration;
    VectorR u = system.solve_with_gaps(b, penetration);
    const int followed = system.follow(b, u, penetration);
    if (followed < 0) return std::nullopt;
    const VectorR before = residual;
    residual = d - a * u;
    ++result.iterations;
    result.displacement = u;
    result.penetration = penetration;
    result.active = system.set();
    result.mean_misfit_mm = mean_norm(residual);
    const Real small = static_cast<Real>(config.relative_misfit_change) * mean_norm(d);
    result.converged = before.size() > 0 && mean_norm(residual - before) < small;
    if (result.converged || result.iterations >= config.max_iterations) return result;

    const VectorR adjoint = 2 * (a.transpose() * precision.cwiseProduct(residual));
    const VectorR gradient = system.solve(adjoint) - 2 * w;  // negative
    const VectorR sigma_gradient = sigma(gradient);
    const Real norm = gradient.dot(sigma_gradient);
    Real gamma = 0;
    if (steps == Steps::kConjugate && followed == 0 && norm_before > 0) {
      gamma = std::max(Real(0), (norm - sigma_gradient.dot(gradient_before)) / norm_before);
    }
    if (gamma > 0) {
      direction = gradient + gamma * direction;
      sigma_direction = sigma_gradient + gamma * sigma_direction;
    } else {
      direction = gradient;
      sigma_direction = sigma_gradient;
    }
    norm_before = norm;
    gradient_before = gradient;
    const VectorR move = a * system.solve(sigma_direction);
    const Real curvature = move.dot(precision.cwiseProduct(move)) + direction.dot(sigma_direction);
    const Real slope = residual.dot(precision.cwiseProduct(move)) - b.dot(direction);
    if (!(curvature > 0) || slope == 0) {
      result.converged = true;
      return result;
    }
    w += slope / curvature * direction;
    b += slope / curvature * sigma_direction;
  }
}

}  // namespace brainshift::stability
