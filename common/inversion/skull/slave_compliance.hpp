// SPDX-License-Identifier: GPL-3.0-or-later
// SlaveCompliance: how far forces on some slaves S keep all slaves off the skull,
//
//   Phi_:S f     s numbers, mm
//
// in single precision, because reading the columns of Phi is what a search for contact spends most
// of its time with: half the bytes. How wrong a sum may be is known, so that single slaves whose
// sign matters can be asked for exactly:
//
//   |error_i| <= (k + 3) 2^-24 sum_j |Phi_ij f_j|      k = |S|; rounding of Phi and f, and of sums
//             <= (k + 3) 2^-24 max_i Phi_ii^1/2 sum_j Phi_jj^1/2 |f_j|
//
// because Phi is positive semidefinite. Some 1e-4 mm for the 400 forces of a sag; the sums
// themselves are off by a tenth of that. Nothing is allocated after construction. 4 s^2 bytes.
#pragma once

#include <memory>
#include <vector>

#include "common/core/thread_team.hpp"
#include "common/core/types.hpp"
#include "common/operators/condensed_operators.hpp"

namespace brainshift::inversion {

class SlaveCompliance {
 public:
  // Keeps references to both. The team shares the work; results do not depend on its size.
  SlaveCompliance(const CondensedOperators& operators, ThreadTeam& team);

  // penetration -= Phi_:S f. forces: one per slave of S, N; penetration: s, mm.
  void subtract(const std::vector<int>& slaves, const Eigen::Ref<const VecX>& forces,
                VecX& penetration);
  // Bound of the error of subtract() for these forces, mm.
  double error_mm(const std::vector<int>& slaves, const Eigen::Ref<const VecX>& forces) const;
  // (Phi_:S f)_slave in double precision, mm.
  double at(int slave, const std::vector<int>& slaves, const Eigen::Ref<const VecX>& forces) const;

 private:
  const CondensedOperators& operators_;
  ThreadTeam& team_;
  // Uninitialised: the threads that read it write it first.
  std::unique_ptr<float[]> single_;  // Phi, s x s
  VecX root_;                        // Phi_jj^1/2
  double largest_root_ = 0.0;
  std::vector<const float*> columns_;
  std::vector<float> factors_;
  Eigen::VectorXf sum_;
};

}  // namespace brainshift::inversion
