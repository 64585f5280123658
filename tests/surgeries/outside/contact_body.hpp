// SPDX-License-Identifier: GPL-3.0-or-later
// ContactBody: an elastic body on springs between rigid walls, for truths from outside. It shares
// elements and linear algebra with the product, but neither its contact nor its supports.
//
//   K u = f - sum_i lambda_i n_i,   lambda_i >= 0,   n_i . u <= gap_i,   one of both equal
//
// K: stiffness of drained elasticity and of the springs. n_i: outward normal of the body at a side,
// lambda_i: force of the wall on it, N. Contact is exact: no penalty. By sides,
//
//   s = n . K^-1 f - gap - Phi lambda <= 0,   Phi_ij = n_i . K^-1 n_j
//
// solved by a primal-dual active set (Hintermueller, Ito and Kunisch 2003, SIAM J Optim 13:865);
// after kSettling sets by one side at a time, the worst, so that no sets call for one another.
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "common/core/error.hpp"
#include "common/fem/displacement_space.hpp"
#include "common/fem/space_elasticity.hpp"
#include "common/linalg/cholesky.hpp"

namespace brainshift::outside {

struct Spring {
  NodeIndex node;
  Mat3 stiffness;  // N/mm, symmetric
};
struct Side {
  NodeIndex node;
  Vec3 normal;  // outward, length one
  double gap_mm;
};
inline constexpr double kNoWall = std::numeric_limits<double>::infinity();  // a gap

struct Supports {
  fem::DofMap dofs;  // finalised
  std::vector<Spring> springs;
  std::vector<Side> sides;
};

struct Equilibrium {
  Points displacement;  // 3 x nodes of the space, mm
  VecX pressing_n;      // lambda, one per side
  int sets = 0;         // active sets solved for
};

class ContactBody {
 public:
  // Errors as SparseCholesky.
  static Result<ContactBody> make(const fem::DisplacementSpace& space,
                                  const fem::MaterialMap& materials, Supports supports);

  // load: 3 x nodes, N. gaps: one per side, mm; kNoWall where there is none. Columns of Phi are
  // computed when their side is pressed for the first time. kNotConverged.
  Result<Equilibrium> solve(const Points& load, const VecX& gaps);
  VecX gaps() const;  // of the sides
  // n_i . u, one per side.
  VecX outward(const Points& u) const;
  // Nodal forces of the walls, 3 x nodes: - sum_i lambda_i n_i.
  Points push(const VecX& pressing) const;
  // Forces that balance u: K u, without constraints 3 x nodes; springs included.
  Points internal_force(const Points& u) const;

 private:
  ContactBody(const fem::DisplacementSpace& space, const fem::MaterialMap& materials,
              Supports supports, linalg::SparseCholesky factor);
  VecX outward_of(const VecX& q) const;
  void know(const std::vector<int>& sides);

  const fem::DisplacementSpace* space_;
  fem::MaterialMap materials_;
  Supports supports_;
  linalg::SparseCholesky factor_;
  struct Entry {
    int unknown;
    double value;
  };
  std::vector<std::vector<Entry>> normals_;  // of every side, in the unknowns
  std::vector<VecX> phi_;                    // columns; empty: not known yet
  std::vector<char> active_;                 // where the next search begins
};

}  // namespace brainshift::outside
