// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/contact/unilateral_solver.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <utility>

namespace brainshift::contact {
namespace {

// Relative to the largest displacement: below it, rounding decides the sign of a penetration.
constexpr double kHover = 1e-11;

ActiveSet where_positive(const VecX& values) {
  ActiveSet active(static_cast<std::size_t>(values.size()));
  for (std::size_t i = 0; i < active.size(); ++i)
    active[i] = values[static_cast<Eigen::Index>(i)] > 0.0;
  return active;
}

// True when the sets differ only in points so close to the obstacle that rounding decides their
// sign.
bool same_set(const ActiveSet& a, const ActiveSet& b, const VecX& penetration, double hover_mm) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i] != b[i] && std::abs(penetration[static_cast<Eigen::Index>(i)]) > hover_mm)
      return false;
  }
  return true;
}

// Everything that stays the same between iterations.
class Problem {
 public:
  Problem(const linalg::SymmetricMatrix& stiffness, const fem::ConstrainedDofs& constrained,
          const SurfaceContact& contact, const Points& load)
      : stiffness_(stiffness),
        constrained_(constrained),
        contact_(contact),
        load_(load),
        b_(constrained.dofs.restrict_to(load)),
        lift_penetration_(contact.penetration(constrained.lift)) {
    for (const SurfaceContactPoint& point : contact.points())
      point_stiffness_.push_back(point.stiffness);
  }

  const VecX& lift_penetration() const { return lift_penetration_; }
  VecX penetration(const VecX& q) const { return lift_penetration_ - approach(q); }

  // q of the penalised system with a fixed set. The factor is made on the first call.
  Status solve(const ActiveSet& active, VecX& q, UnilateralSolution& result) {
    linalg::SymmetricMatrix k = stiffness_;
    contact_.add_stiffness(k, constrained_.dofs, active);
    Points f = load_;
    contact_.add_force(lift_penetration_, active, f);
    const VecX b = constrained_.dofs.restrict_to(f);
    if (factor_) {
      if (Status ok = factor_->refactorise(k); !ok) return ok;
    } else {
      auto made = linalg::SparseCholesky::factorise(k);
      if (!made) return tl::unexpected(made.error());
      factor_.emplace(std::move(*made));
    }
    q = factor_->solve(b);
    q += factor_->solve(b - linalg::multiply(k, q));
    const double scale = b.norm();
    result.relative_residual = scale > 0.0 ? (b - linalg::multiply(k, q)).norm() / scale : 0.0;
    result.rcond = factor_->rcond();
    if (!q.allFinite()) return fail(ErrorCode::kNotFinite, "the solution is not finite");
    return {};
  }

  // t in (0, 1] that minimises the energy on the way from q to q + d. The slope grows with t:
  // bisection.
  double line_search(const VecX& q, const VecX& d) const {
    const VecX kd = linalg::multiply(stiffness_, d);
    const double slope_0 = kd.dot(q) - b_.dot(d);
    const double curvature = kd.dot(d);
    const VecX p = penetration(q);
    const VecX dp = -approach(d);
    const auto slope = [&](double t) {
      double sum = slope_0 + t * curvature;
      for (Eigen::Index i = 0; i < p.size(); ++i) {
        const double pressed = p[i] + t * dp[i];
        if (pressed > 0.0) sum += point_stiffness_[static_cast<std::size_t>(i)] * pressed * dp[i];
      }
      return sum;
    };
    if (slope(1.0) <= 0.0) return 1.0;
    double low = 0.0, high = 1.0;
    for (int k = 0; k < 50; ++k) {
      const double middle = 0.5 * (low + high);
      (slope(middle) > 0.0 ? high : low) = middle;
    }
    return low > 0.0 ? low : high;
  }

  Points displacement(const VecX& q) const {
    return constrained_.dofs.expand(q) + constrained_.lift;
  }

 private:
  VecX approach(const VecX& q) const { return contact_.approach(constrained_.dofs.expand(q)); }

  const linalg::SymmetricMatrix& stiffness_;
  const fem::ConstrainedDofs& constrained_;
  const SurfaceContact& contact_;
  const Points& load_;
  VecX b_;
  VecX lift_penetration_;
  std::vector<double> point_stiffness_;
  std::optional<linalg::SparseCholesky> factor_;
};

}  // namespace

Result<UnilateralSolution> solve_unilateral(const linalg::SymmetricMatrix& stiffness,
                                            const fem::ConstrainedDofs& constrained,
                                            const SurfaceContact& contact, const Points& load,
                                            const UnilateralOptions& options,
                                            const Progress& progress) {
  Problem problem(stiffness, constrained, contact, load);
  UnilateralSolution result;
  result.active = where_positive(problem.lift_penetration().array() + options.touching_mm);
  VecX q, newton;
  while (result.iterations < options.max_iterations) {
    report(progress, contact.num_points() > 0 ? "contact iterations" : "factorise and solve",
           static_cast<double>(result.iterations) / options.max_iterations);
    if (Status ok = problem.solve(result.active, newton, result); !ok) {
      return tl::unexpected(ok.error());
    }
    ++result.iterations;
    const VecX penetration = problem.penetration(newton);
    ActiveSet next = where_positive(penetration);
    const double hover_mm = kHover * newton.lpNorm<Eigen::Infinity>();
    const bool converged = same_set(next, result.active, penetration, hover_mm);
    if (converged || q.size() == 0) {
      q = newton;
    } else {
      q += problem.line_search(q, newton - q) * (newton - q);
      next = where_positive(problem.penetration(q));
    }
    result.active = std::move(next);
    if (!converged) continue;
    result.displacement = problem.displacement(q);
    report(progress, contact.num_points() > 0 ? "contact iterations" : "factorise and solve", 1.0);
    return result;
  }
  return fail(ErrorCode::kNotConverged,
              fmt::format("contact: the set of {} active points still changes after {} iterations",
                          count(result.active), result.iterations));
}

}  // namespace brainshift::contact
