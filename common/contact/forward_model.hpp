// SPDX-License-Identifier: GPL-3.0-or-later
// ForwardModel: K u = b of one patient under one boundary condition (paper section 2.6),
// factorised once.
//
//   craniotomy, brainstem   stress-free
//   slaves                  kContact: free, with penalty contact against the skull
//                           kFixed: fixed in the normal direction
//   septa                   kContact: penalty contact against their sheets, from both sides
//                           kFixed: fixed along the sheet's normal
//   fixed                   fixed in the normal direction, tangentially free, exactly (rotated
//                           frames, eliminated)
//
// The normals of fixed nodes are the average nodal normals of the brain's boundary.
//
// K is the stiffness of drained elasticity. With scene.pressure = on it is that of one
// backward-Euler step of consolidation of length scene.pressure_step_s from rest, with the
// pressure eliminated (fem/stiffness_factor.hpp). The whole boundary drains (p = 0): cerebrospinal
// fluid or air surrounds it.
//
// Each tissue has its own stiffness (tissue_map).
#pragma once

#include "common/configuration/case_config.hpp"
#include "common/contact/penalty.hpp"
#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/fem/displacement_space.hpp"
#include "common/fem/dof_map.hpp"
#include "common/fem/elasticity.hpp"
#include "common/fem/stiffness_factor.hpp"
#include "common/ranks/ranks.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/estimate.hpp"

namespace brainshift::contact {

// The tissue of each tetrahedron of a patient's brain, by the case's material section.
//
//   material.tumour    tetrahedra whose centre lies inside the tumour's surface
//   material.regions   tetrahedra of a label of the mesh (ventricles, white matter, tentorium)
//   material.tissues   tetrahedra whose tissue the label map told (values/brain_model.hpp)
//   the rest           material itself
// The tumour has precedence over the regions, and they over the tissues. Density, permeability and
// storage are the same everywhere.

// The pairs of the model's slaves: with the skull (search_contact), then with the sheets of falx
// and tentorium, whose gaps and normals the model holds.
Result<std::vector<ContactPair>> contact_pairs(const BrainModel& model);

// kInvalidArgument: a label that the mesh does not have; the sentence names the labels it has.
// kEmptySet: no tetrahedron has its centre in the tumour.
Result<fem::MaterialMap> tissue_map(const BrainModel& model, const Material& material);

// Processes that hold one factor together, and whose part each node is (DistributedCholesky).
struct SharedNodes {
  Ranks* ranks = nullptr;  // nullptr: this process alone
  std::vector<int> part;
};

class ForwardModel {
 public:
  // kFloatingBody, kSingularMatrix, kNotFinite: as StiffnessFactor. kEmptySet and
  // kDegenerateMesh: as search_contact. kInvalidArgument and kEmptySet: as tissue_map.
  // kInvalidArgument: pressure by several processes.
  static Result<ForwardModel> build(const BrainModel& model, const CaseConfig& config,
                                    Boundary boundary, const Progress& progress = {},
                                    const SharedNodes& shared = {});

  // Drained elasticity on linear or quadratic elements, with the constraints and the contact of the
  // caller. The pairs' slaves are nodes of the space, free and with the identity frame. Vertices of
  // quadratic faces carry no load (surface_contact.hpp), so there the slaves are middles of edges.
  // boundary() is kContact. Errors as StiffnessFactor.
  static Result<ForwardModel> assemble(const fem::DisplacementSpace& space,
                                       const fem::MaterialMap& materials, fem::DofMap dofs,
                                       PenaltyContact contact, const Progress& progress = {});

  Boundary boundary() const { return boundary_; }
  const fem::DofMap& dofs() const { return dofs_; }
  // The matrix of drained elasticity, also when the factor carries pressure. Contact stiffness is
  // added to it.
  const linalg::SymmetricMatrix& stiffness() const { return stiffness_; }
  double stiffness_norm() const { return stiffness_norm_; }  // linalg::max_norm
  const fem::StiffnessFactor& factor() const { return factor_; }
  // No pairs under the fixed boundary condition.
  const PenaltyContact& contact() const { return contact_; }
  double assemble_seconds() const { return assemble_s_; }
  std::uint64_t bytes() const;

  // u = K^-1 b without contact; b, u: 3 x n. Errors as fem::checked_solve.
  Status solve(const Points& load, Points& u) const;
  // The same without the check of the residual.
  Points solve(const Points& load) const;

 private:
  ForwardModel(Boundary boundary, fem::DofMap dofs, const linalg::SymmetricMatrix& stiffness,
               fem::StiffnessFactor factor, PenaltyContact contact, double assemble_s);
  Boundary boundary_;
  fem::DofMap dofs_;
  linalg::SymmetricMatrix stiffness_;
  double stiffness_norm_;
  fem::StiffnessFactor factor_;
  PenaltyContact contact_;
  double assemble_s_;
};

// t_solve: the time of one full solve K x = b on this machine, the unit of every speed figure.
// Median of 9 single solves after one that warms up, ms. Takes 10 solves of time: a third of a
// second on the default head.
double measure_full_solve_ms(const ForwardModel& forward);

}  // namespace brainshift::contact
