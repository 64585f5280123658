// SPDX-License-Identifier: GPL-3.0-or-later
// PriorScales: how strong each part of the force prior is, estimated from the data of an update
// (empirical Bayes).
//
// The case names the forces that may act and their rough strength; the true strength differs from
// surgery to surgery. Parts g (PriorPart): buoyancy along gravity, buoyancy across it, swelling,
// everything else. Modes of part g are z ~ N(0, s_g^2 I) with
//
//   theta_g = ln s_g^2 ~ N(0, kLogVarianceSd^2)      s_g = 1: as in the case
//
// s maximises p(d | s) p(s) for the linear model of one contact set, by Fisher scoring (MacKay
// 1992, Neural Computation 4:415; Tipping 2001, JMLR 1:211). With posterior mean m and covariance S
// of the modes in units of s and Q = I - S:
//   gradient_g     = 1/2 (|m_g|^2 - tr Q_gg) - theta_g / sd^2
//   information_gh = 1/2 |Q_gh|_F^2 + [g = h] / sd^2
//
// with s_g <= kLargestScales. A part that the data do not need fades, and the error bars
// with it. Allocates nothing after construction.
#pragma once

#include "common/core/types.hpp"
#include "common/inversion/condensed/mode_window.hpp"
#include "common/linalg/blas.hpp"
#include "common/prior/load_modes.hpp"

namespace brainshift::inversion {

// A standard deviation of ln s of ln 3: two of them are an order of magnitude.
inline constexpr double kLogVarianceSd = 2.1972245773362196;  // 2 ln 3

// The case gives the greatest strength of a part; of swelling it gives the usual one
// (docs/decisions/0014). Where other forces may be many times stronger than in the case, the
// contact set does not settle (docs/decisions/0012).
inline constexpr PriorScaleValues kLargestScales = {1.0, 1.0, 4.0, 1.0};

class PriorScales {
 public:
  // counts: of CondensedOperators, whose columns begin with the load modes.
  PriorScales(prior::LoadModeCounts counts, ModeWindow window, int max_common);

  const PriorScaleValues& scales() const { return scales_; }
  double of_mode(int mode) const { return scales_[static_cast<std::size_t>(part(mode))]; }
  double of_other() const { return scales_[static_cast<std::size_t>(PriorPart::kOther)]; }
  void reset() { scales_.fill(1.0); }

  // Maximises from the present scales. gram: J^T R^-1 J of [common errors | modes], lower triangle,
  // without the prior; right: J^T R^-1 (d - ...). False when nothing better was found: the scales
  // stay, because what is left to gain in ln p is below kWorthwhile, or because the normal
  // equations are not positive definite.
  bool fit(const linalg::blas::In<double>& gram, const Eigen::Ref<const VecX>& right);

 private:
  static constexpr int kParts = kPriorParts;
  using Parts = Eigen::Matrix<double, kParts, 1>;
  struct Slope {
    Parts gradient;
    Eigen::Matrix<double, kParts, kParts> information;
  };
  int part(int mode) const {
    return static_cast<int>(prior::prior_part(window_.first + mode, counts_));
  }
  bool slope(const linalg::blas::In<double>& gram, const Eigen::Ref<const VecX>& right, Slope& out);

  prior::LoadModeCounts counts_;
  ModeWindow window_;
  PriorScaleValues scales_{1.0, 1.0, 1.0, 1.0};
  VecX factor_storage_, inverse_storage_, mean_;
};

}  // namespace brainshift::inversion
