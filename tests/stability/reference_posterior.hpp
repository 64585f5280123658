// SPDX-License-Identifier: GPL-3.0-or-later
// Posterior mean of the paper's penalised problem for one toy patient, with a contact set of its
// own, in long double.
//
//   u(A) = s + C A^T (A C A^T + R)^-1 (d - A s)
//   C = K_p^-1 Sigma K_p^-1,   s = K_p^-1 beta sum_A 0p N
//
// A set A is searched in outputs (displacement at the data, N . u at the slaves), where one set
// costs a factor of the data's size. Slaves that pull leave and open ones that penetrate join,
// from the empty set, until nothing changes. A set seen before means a cycle; from there on one
// slave changes at a time, the one of least index (Murty 1974). The field of the set found is
// then computed with K_p itself, so that an error of the search would show as a broken contact
// condition.
//
// The posterior of one set is unique. A set that repeats itself need not be, because the loads
// depend on it: Posterior::violation_mm says what any given set leaves unfulfilled.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "common/values/sparse_data.hpp"
#include "tests/stability/patient_matrices.hpp"

namespace brainshift::stability {

// Prepared once per patient; K is factorised here.
struct ReferencePatient {
  ReferencePatient(const BrainModel& brain, const CaseConfig& config, PatientMatrices matrices);

  TetMesh mesh;
  MatrixR kernel, modes;  // of PatientMatrices
  std::vector<PriorPart> part_of_mode;
  Reference system;         // K_p of any set
  MatrixR contact_columns;  // K^-1 T^T N, unknowns x s
  MatrixR compliance;       // N^T K^-1 N, s x s, mm/N

  // For nodal columns, 3n x k: (sigma_f^2 V R V (x) I) w, and Sigma w at the given scales.
  MatrixR kernel_times(const MatrixR& nodal) const;
  MatrixR covariance_times(const MatrixR& nodal, const PriorScaleValues& scales) const;
  // T q and T^T f, column by column.
  MatrixR expand(const MatrixR& unknowns) const;
  MatrixR restrict_to(const MatrixR& nodal) const;
};

// A, 3m x 3n: row 3 i + axis is that component of datum i.
MatrixR sampling_rows(const TetMesh& mesh, const Points& positions);

struct Posterior {
  contact::ActiveSet active;
  VectorR displacement;  // 3n
  VectorR penetration;   // of every slave, mm
  // Largest penetration of an open slave, or pull of an active one times its compliance.
  Real violation_mm = 0;
};

class ReferencePosterior {
 public:
  // Keeps a reference to the patient. Whole displacements with independent errors only.
  ReferencePosterior(ReferencePatient& patient, const SparseData& data);

  // A set that repeats itself; nothing when the search finds none.
  std::optional<contact::ActiveSet> find_set(const PriorScaleValues& scales) const;
  // The posterior of a set by K_p; nothing when a factor fails.
  std::optional<Posterior> of_set(const contact::ActiveSet& set, const PriorScaleValues& scales);
  // Loads averaged over hypotheses, the set kept.
  std::optional<Posterior> of_set(const contact::ActiveSet& set,
                                  const std::vector<Hypothesis>& hypotheses);
  // What is left to gain in ln p(d | scales, set) p(scales) over the strengths of
  // prior_strengths.hpp, from `scales` on: coordinate search.
  std::optional<Real> gain_left(const contact::ActiveSet& set,
                                const PriorScaleValues& scales) const;

 private:
  struct SetModel;
  std::optional<SetModel> model_of(const contact::ActiveSet& set) const;
  // Covariance of the outputs of the free body at the given scales.
  MatrixR covariance(const PriorScaleValues& scales) const;
  // B Psi B^T + R.
  MatrixR innovation(const SetModel& model, const MatrixR& psi) const;
  std::optional<Real> log_evidence(const SetModel& model, const PriorScaleValues& scales) const;

  ReferencePatient& patient_;
  Eigen::Index rows_;                                    // 3m
  MatrixR loads_;                                        // T^T A^T, unknowns x 3m
  VectorR data_, variance_;                              // 3m
  MatrixR sampled_contact_;                              // A K^-1 N, 3m x s
  std::array<MatrixR, kPriorParts> covariance_of_part_;  // empty: there is no such part
};

}  // namespace brainshift::stability
