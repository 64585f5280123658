// SPDX-License-Identifier: GPL-3.0-or-later
// BiotStepper: Biot consolidation in time by backward Euler (paper eq. 1-3). Steps may have any
// size; one factor is kept per step size.
//
//   K u - G p = f                                          K, G, H, M, P: biot_matrix.hpp
//   G^T (u - u0) + dt H p + (M + P)(p - p0) = dt q         u0, p0: state before the step
//
// A sudden load at t = 0 is a step with that load from the state of rest. With incompressible
// constituents the first, short step then gives the undrained pressure. First order in dt; stable
// for every dt > 0.
//
// Boundaries: displacements that DofMap fixes and pressures of drained nodes are prescribed, with
// value zero unless the load gives another. Every other boundary is stress-free and sealed, apart
// from the nodal forces and sources of the load.
#pragma once

#include <map>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/fem/biot_matrix.hpp"
#include "common/linalg/symmetric_indefinite.hpp"

namespace brainshift::fem {

struct BiotState {
  Points displacement;  // 3 x n, mm
  VecX pressure;        // n, N/mm^2
  static BiotState at_rest(int num_nodes) {
    return {Points::Zero(3, num_nodes), VecX::Zero(num_nodes)};
  }
};

// Loads and prescribed values at the end of the step. An empty array means zero.
struct BiotLoad {
  // 3 x n consistent nodal forces, N: tractions, body forces (space_elasticity.hpp).
  Points force;
  // n consistent nodal inflow, mm^3/s: the paper's psi, and flow in through the boundary.
  VecX source;
  Points displacement;  // 3 x n, read along the directions that DofMap fixes, mm
  VecX pressure;        // n, read at drained nodes, N/mm^2
};

struct BiotOptions {
  bool stabilise = true;  // below the step of Vermeer and Verruijt, biot_matrix.hpp
  int kept_factors = 4;   // step sizes whose factor is kept; the least recently used goes first
};

// Diagnostics of the last step.
struct BiotDiagnostics {
  double dt_s = 0.0;
  bool factorised = false;                               // the step size was new
  int stabilised_tets = 0;                               // elements below their bound
  double smallest_bound_s = 0.0, largest_bound_s = 0.0;  // h^2 / (6 c_v) over the elements
  double rcond = 0.0, backward_error = 0.0;
  int refinements = 0;
};

class BiotStepper {
 public:
  // drained: nodes whose pressure is prescribed. kInvalidArgument names the material, tetrahedron
  // or node that breaks a rule: S >= 0, k >= 0, 0 <= alpha <= 1, shear > 0,
  // lambda + 2/3 shear > 0, indices in range.
  static Result<BiotStepper> build(const TetMesh& mesh, const MaterialMap& materials,
                                   const DofMap& dofs, const std::vector<NodeIndex>& drained,
                                   const BiotOptions& options = {});

  // State after dt seconds. kInvalidArgument (dt, array sizes), kNotFinite, and the errors of
  // SymmetricIndefinite.
  Result<BiotState> step(const BiotState& state, const BiotLoad& load, double dt_s);
  const BiotDiagnostics& diagnostics() const { return diagnostics_; }

  // K u - G p at every node, 3 x n, N: the external forces plus, along fixed directions, the
  // reactions of the supports.
  Points internal_force(const BiotState& state) const;

  const TetMesh& mesh() const { return mesh_; }

 private:
  BiotStepper(const TetMesh& mesh, const MaterialMap& materials, const DofMap& dofs,
              const std::vector<NodeIndex>& drained, const BiotOptions& options);
  struct Kept {
    linalg::SymmetricIndefinite factor;
    int stabilised_tets = 0;
    long last_used = 0;
  };
  Result<Kept*> factor_for(double dt_s);
  Status check(const BiotState& state, const BiotLoad& load, double dt_s) const;
  BiotState with_prescribed(const BiotState& state, const BiotLoad& load) const;
  VecX residual(const BiotState& before, const BiotState& guess, const BiotLoad& load,
                double dt_s) const;

  TetMesh mesh_;
  MaterialMap materials_;
  DofMap dofs_;
  PressureMap pressure_;
  BiotOptions options_;
  std::map<double, Kept> factors_;  // by step size
  long steps_ = 0;
  BiotDiagnostics diagnostics_;
};

}  // namespace brainshift::fem
