// SPDX-License-Identifier: GPL-3.0-or-later
// Forward model and prior of a toy patient, assembled a second time from what the patient is:
// nodes, tetrahedra, node sets, skull and case. Nothing of the product's preparation goes in;
// definitions come from the paper and from the headers named below.
//
//   supports   a fixed node keeps its mean boundary normal (paper 2.3), found from the tetrahedra
//   K          B^T D B of each element, from G and nu
//   contact    three-step search over the skull's triangles (paper 2.3; penalty.hpp)
//   Sigma      sigma_f^2 V R V (x) I + M M^T: Wendland's C2 kernel (force_prior.hpp), M: buoyancy
//              of each fluid plane along gravity and across it (load_modes.hpp)
//   A          barycentric weights of the tetrahedron around each datum
// Covers what the sweeps ask: one material, no swelling, drained.
#pragma once

#include "common/configuration/case_config.hpp"
#include "common/contact/penalty.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/estimate.hpp"
#include "tests/stability/reference.hpp"

namespace brainshift::stability {

struct PatientMatrices {
  Unknowns unknowns;
  MatrixR stiffness;
  std::vector<ReferencePair> pairs;
  MatrixR kernel;  // sigma_f^2 V R V, n x n, N^2/mm^2
  MatrixR modes;   // M, 3n x k, N
  std::vector<PriorPart> part_of_mode;
};

// product_pairs decide between contact points that are equally close to their slave, as at the
// edges of a box; where none of those is the product's, the first is taken.
PatientMatrices patient_matrices(const BrainModel& brain, const CaseConfig& config,
                                 const std::vector<contact::ContactPair>& product_pairs);

// m x n.
MatrixR sampling_weights(const TetMesh& mesh, const Points& positions);

// Part of a tetrahedron where the linear function with these corner values is negative.
Real negative_part(Eigen::Matrix<Real, 4, 1> values);

}  // namespace brainshift::stability
