// SPDX-License-Identifier: GPL-3.0-or-later
// SurfaceContact: frictionless penalty contact of a body's faces with rigid obstacles, integrated
// over the faces.
//
//   E_c(u) = 1/2 int kappa <P(u)>^2 dA,   P = 0p - N . u,   <P> = max(P, 0)
//   contact pressure kappa <P>
//
// kappa: N/mm^3. It is evaluated at quadrature points of the faces (3 for P1, 6 for P2), each
// with the contact pair of its undeformed place. So displacements along the obstacle must be
// small against its radius. The paper uses nodal contact (penalty.hpp). On P2 that would be
// wrong, because the vertices of a P2 face carry no load.
// The stiffness of a point couples only nodes of one face, so the pattern of K holds the sum.
#pragma once

#include <array>
#include <variant>
#include <vector>

#include "common/contact/penalty.hpp"
#include "common/core/progress.hpp"
#include "common/fem/displacement_space.hpp"
#include "common/linalg/cholesky.hpp"

namespace brainshift::contact {

// Rigid obstacles, and the contact pair of any point with one: closest point y, normal N out of
// the obstacle, and initial penetration 0p = (y - x) . N (penalty.hpp; positive
// penetrates).

// The half-space behind the plane is rigid. The normal has length one and points to the side
// where the body may be.
struct RigidPlane {
  Vec3 point = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();
};
// A rigid ball; the body is outside.
struct RigidSphere {
  Vec3 centre = Vec3::Zero();
  double radius = 0.0;  // mm, > 0
};
// Triangles whose normals point out of the obstacle, to the side where the body may be.
struct RigidSurface {
  TriangleSurface surface;
};
using Obstacle = std::variant<RigidPlane, RigidSphere, RigidSurface>;

// One pair per point; `slave` is its column. kInvalidArgument: a point at the centre of the
// sphere. For a surface the errors of search_contact.
Result<std::vector<ContactPair>> contact_pairs(const Points& points, const Obstacle& obstacle);

struct SurfaceContactPoint {
  std::array<int, fem::kMaxFaceNodes> nodes{};
  std::array<double, fem::kMaxFaceNodes> shape{};  // N_k
  std::array<double, 3> vertex_weight{};           // barycentric
  Vec3 normal = Vec3::Zero();                      // N, out of the obstacle
  double initial_penetration_mm = 0.0;
  double area = 0.0;       // mm^2: weight of the point
  double stiffness = 0.0;  // kappa area, N/mm
  int obstacle = 0;        // order of add()
};

class SurfaceContact {
 public:
  explicit SurfaceContact(const fem::DisplacementSpace& space);

  // faces: 3 x f vertices; kappa > 0. Errors as contact_pairs.
  Status add(const Eigen::Matrix<int, 3, Eigen::Dynamic>& faces, const Obstacle& obstacle,
             double kappa);

  const std::vector<SurfaceContactPoint>& points() const { return points_; }
  int num_points() const { return static_cast<int>(points_.size()); }

  VecX penetration(const Points& u) const;
  // N . u at every point. The penetration is 0p minus this.
  VecX approach(const Points& u) const;
  void add_stiffness(linalg::SymmetricMatrix& lower, const fem::DofMap& dofs,
                     const ActiveSet& active) const;
  // Adds sum over the active points of stiffness * values_i N_k N to the nodal forces (3 x n).
  void add_force(const VecX& values, const ActiveSet& active, Points& force) const;

  // Contact pressure at the vertices, N/mm^2: mean over the points around each vertex, weighted
  // by area and by nearness.
  VecX vertex_pressure(const Points& u) const;

 private:
  const fem::DisplacementSpace* space_;
  std::vector<SurfaceContactPoint> points_;
  int num_obstacles_ = 0;
};

// Elastic equilibrium with SurfaceContact: the minimum of 1/2 u.Ku - f.u + E_c(u) under
// prescribed displacements.
//
// Semi-smooth Newton: solve for the active set, take the points that penetrate as the next one,
// stop when a set repeats. The energy is convex and piecewise quadratic, so with an exact line
// search towards each Newton point the method descends from any start; without it, sets can
// cycle. The first set holds the points that touch, so that a body that only its obstacle holds
// has support from the first solve.
struct UnilateralSolution {
  Points displacement;  // 3 x n, mm
  ActiveSet active;     // of the contact points
  int iterations = 0;   // linear solves with a set of their own
  double rcond = 0.0;
  // |b - K u| / |b| of the last solve, after one step of refinement.
  double relative_residual = 0.0;
};

struct UnilateralOptions {
  int max_iterations = 60;
  double touching_mm = 1e-9;  // a gap below this counts as touching at the start
};

// stiffness: K of the constrained unknowns (lower); load: f - K lift, 3 x n nodal.
// kNotConverged: max_iterations reached. kFloatingBody: no contact is left that holds the body.
// Otherwise errors as SparseCholesky.
Result<UnilateralSolution> solve_unilateral(const linalg::SymmetricMatrix& stiffness,
                                            const fem::ConstrainedDofs& constrained,
                                            const SurfaceContact& contact, const Points& load,
                                            const UnilateralOptions& options = {},
                                            const Progress& progress = {});

}  // namespace brainshift::contact
