// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/contact/surface_contact.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "common/fem/elasticity.hpp"

namespace brainshift::contact {
namespace {

using Pairs = Result<std::vector<ContactPair>>;

Pairs with_plane(const Points& points, const RigidPlane& plane) {
  std::vector<ContactPair> pairs;
  for (int i = 0; i < points.cols(); ++i) {
    const double penetration = (plane.point - points.col(i)).dot(plane.normal);
    pairs.push_back({i, points.col(i) + penetration * plane.normal, plane.normal, penetration});
  }
  return pairs;
}

Pairs with_sphere(const Points& points, const RigidSphere& sphere) {
  std::vector<ContactPair> pairs;
  for (int i = 0; i < points.cols(); ++i) {
    const Vec3 out = points.col(i) - sphere.centre;
    const double distance = out.norm();
    if (!(distance > 1e-6 * sphere.radius)) {
      return invalid("a point of the surface lies in the centre of the rigid sphere");
    }
    const Vec3 normal = out / distance;
    pairs.push_back({i, sphere.centre + sphere.radius * normal, normal, sphere.radius - distance});
  }
  return pairs;
}

Pairs with_surface(const Points& points, const RigidSurface& obstacle) {
  // search_contact expects a surface that looks away from the body, as a skull does from the
  // brain.
  TriangleSurface flipped = obstacle.surface;
  flipped.triangles.row(1).swap(flipped.triangles.row(2));
  std::vector<NodeIndex> all(static_cast<std::size_t>(points.cols()));
  std::iota(all.begin(), all.end(), 0);
  return search_contact(points, all, flipped);
}

}  // namespace

Result<std::vector<ContactPair>> contact_pairs(const Points& points, const Obstacle& obstacle) {
  if (const auto* plane = std::get_if<RigidPlane>(&obstacle)) return with_plane(points, *plane);
  if (const auto* sphere = std::get_if<RigidSphere>(&obstacle)) return with_sphere(points, *sphere);
  return with_surface(points, std::get<RigidSurface>(obstacle));
}

SurfaceContact::SurfaceContact(const fem::DisplacementSpace& space) : space_(&space) {}

Status SurfaceContact::add(const Eigen::Matrix<int, 3, Eigen::Dynamic>& faces,
                           const Obstacle& obstacle, double kappa) {
  assert(kappa > 0.0);
  const auto& rule = space_->element == fem::Element::kP1 ? fem::coarse_triangle_rule()
                                                          : fem::fine_triangle_rule();
  std::vector<SurfaceContactPoint> added;
  Points places(3, faces.cols() * static_cast<Eigen::Index>(rule.size()));
  for (Eigen::Index f = 0; f < faces.cols(); ++f) {
    const Eigen::Vector3i face = faces.col(f);
    Mat3 corners;
    for (int k = 0; k < 3; ++k) corners.col(k) = space_->mesh.nodes.col(face[k]);
    const double area =
        0.5 * (corners.col(1) - corners.col(0)).cross(corners.col(2) - corners.col(0)).norm();
    for (const fem::TrianglePoint& q : rule) {
      SurfaceContactPoint point;
      point.nodes = fem::face_nodes(*space_, face);
      const auto shape = fem::face_shape_values(space_->element, q.l);
      std::copy(shape.begin(), shape.end(), point.shape.begin());
      std::copy(q.l.begin(), q.l.end(), point.vertex_weight.begin());
      point.area = q.weight * area;
      point.stiffness = kappa * point.area;
      point.obstacle = num_obstacles_;
      places.col(static_cast<Eigen::Index>(added.size())) = corners * q.l;
      added.push_back(point);
    }
  }
  const auto pairs = contact_pairs(places, obstacle);
  if (!pairs) return tl::unexpected(pairs.error());
  for (std::size_t i = 0; i < added.size(); ++i) {
    added[i].normal = (*pairs)[i].normal;
    added[i].initial_penetration_mm = (*pairs)[i].initial_penetration_mm;
  }
  points_.insert(points_.end(), added.begin(), added.end());
  ++num_obstacles_;
  return {};
}

VecX SurfaceContact::approach(const Points& u) const {
  VecX along(num_points());
  for (int i = 0; i < num_points(); ++i) {
    const SurfaceContactPoint& point = points_[static_cast<std::size_t>(i)];
    double sum = 0.0;
    for (std::size_t k = 0; k < static_cast<std::size_t>(space_->nodes_per_face()); ++k) {
      sum += point.shape[k] * point.normal.dot(u.col(point.nodes[k]));
    }
    along[i] = sum;
  }
  return along;
}

VecX SurfaceContact::penetration(const Points& u) const {
  VecX p = -approach(u);
  for (int i = 0; i < num_points(); ++i) {
    p[i] += points_[static_cast<std::size_t>(i)].initial_penetration_mm;
  }
  return p;
}

void SurfaceContact::add_stiffness(linalg::SymmetricMatrix& lower, const fem::DofMap& dofs,
                                   const ActiveSet& active) const {
  const auto n = static_cast<std::size_t>(space_->nodes_per_face());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (!active[i]) continue;
    const SurfaceContactPoint& point = points_[i];
    const Mat3 direction = point.stiffness * point.normal * point.normal.transpose();
    for (std::size_t a = 0; a < n; ++a) {
      for (std::size_t b = 0; b < n; ++b) {
        if (point.nodes[a] < point.nodes[b]) continue;
        fem::add_block(lower, dofs, point.nodes[a], point.nodes[b],
                       point.shape[a] * point.shape[b] * direction);
      }
    }
  }
}

void SurfaceContact::add_force(const VecX& values, const ActiveSet& active, Points& force) const {
  const auto n = static_cast<std::size_t>(space_->nodes_per_face());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (!active[i]) continue;
    const SurfaceContactPoint& point = points_[i];
    const Vec3 push = point.stiffness * values[static_cast<Eigen::Index>(i)] * point.normal;
    for (std::size_t k = 0; k < n; ++k) force.col(point.nodes[k]) += point.shape[k] * push;
  }
}

VecX SurfaceContact::vertex_pressure(const Points& u) const {
  const VecX p = penetration(u);
  VecX force = VecX::Zero(space_->num_vertices());
  VecX area = VecX::Zero(space_->num_vertices());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const SurfaceContactPoint& point = points_[i];
    const double pressed = std::max(0.0, p[static_cast<Eigen::Index>(i)]);
    for (std::size_t k = 0; k < 3; ++k) {
      force[point.nodes[k]] += point.vertex_weight[k] * point.stiffness * pressed;
      area[point.nodes[k]] += point.vertex_weight[k] * point.area;
    }
  }
  return (area.array() > 0.0).select(force.array() / area.array(), 0.0);
}

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
  VecX b_, lift_penetration_;
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
