// SPDX-License-Identifier: GPL-3.0-or-later
// d, A and W_e of one inversion (paper eq. 4): misfit e = d - A u and its weighted products.
//
//   W_e = diag(1 / sd^2), one standard deviation per datum, the same for its three components
// Shapes: u is 3 x n (mm); residuals and samples are 3 x m (mm); adjoint() is 3 x n.
#pragma once

#include "common/core/error.hpp"
#include "common/core/types.hpp"
#include "common/fem/sampling.hpp"
#include "common/inversion/prepared/prepared_model.hpp"
#include "common/values/sparse_data.hpp"

namespace brainshift::inversion {

class Misfit {
 public:
  // Errors as fem::sampling_matrix: a datum outside the brain by more than kOutsideTolerance_mm.
  // Keeps a reference to `data`.
  static Result<Misfit> build(const PreparedModel& model, const SparseData& data);

  // A u
  Points sample(const Points& u) const;
  // d - A u
  Points residual(const Points& u) const;
  // A^T W_e r
  Points adjoint(const Points& r) const;
  // r . W_e s
  double inner(const Points& r, const Points& s) const;

 private:
  Misfit(const SparseData& data, const fem::SamplingMatrix& sampling);
  const SparseData& data_;
  fem::SamplingMatrix sampling_;
  VecX weights_;
};

}  // namespace brainshift::inversion
