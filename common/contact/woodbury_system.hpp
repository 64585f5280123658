// SPDX-License-Identifier: GPL-3.0-or-later
// K_p^-1 as a low-rank correction of the factor of K (Woodbury 1950; Hager 1989, SIAM Review 31:221):
//
//   K_p^-1 f = K^-1 (f - N_A c),     (Phi_AA + I / beta) c = N_A^T K^-1 f,     Phi = N^T K^-1 N  (mm/N)
//
// which is K^-1 f - X_A (Phi_AA + I / beta)^-1 X_A^T f with X_A = K^-1 N_A. A column of X is solved for when its
// slave is active for the first time, in blocks, and only its entries in Phi are kept, for the life of the system:
// multiplying by X_A would read as much memory as a second solve with the factor does, and X takes 3n numbers
// per slave that was ever active (0.4 MB each for the default head). The dense Phi_AA + I / beta is factorised when
// the set changes.
#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "common/fem/stiffness_factor.hpp"
#include "common/contact/penalised_system.hpp"

namespace brainshift::contact {

class WoodburySystem final : public PenalisedSystem {
 public:
  explicit WoodburySystem(const contact::ForwardModel& forward);
  Status solve(const Points& f, Points& u) const override;
  // Columns of Phi known so far.
  int columns() const;

 private:
  Status refresh() override;
  void solve_columns(const std::vector<int>& slaves);

  std::vector<int> set_;     // indices of the active slaves
  std::vector<char> known_;  // per slave: its column of Phi is known
  Eigen::MatrixXd phi_;      // slaves x slaves; columns that are not known hold nothing
  Eigen::LLT<Eigen::MatrixXd> capacitance_;
  fem::StiffnessFactor::Workspace workspace_;  // of blocks of columns
};

}  // namespace brainshift::contact
