// SPDX-License-Identifier: GPL-3.0-or-later
// What neighbours on an outline are off by alike, as common errors of unknown size.
//
// The error along the normal is Gaussian with the covariance s^2 exp(-|x - y|^2 / 2 l^2); s and l
// are one of kOutlineErrors. For every one of them the covariance of the errors at given points is
//
//   K_e ~ B V_e B^T,   V_e diagonal, 0 to 1
//
// with the same few columns B: the smooth part of K of the shortest length, U Lambda U^T, and of
// every other length its part in the span of U, which the smoother K has nearly all of. With two
// lengths both become diagonal: Lambda^-1/2 U^T K U Lambda^-1/2 = Q D Q^T, B ~ U Lambda^1/2 Q. What
// B leaves out is rough: neighbours do not share it, and the data's own errors stand for it.
//
// Of a small outline an error over the length l is growth, shift or stretch of the whole, which is
// motion: a swelling that is there would pass for it. A length counts where the outline's radius,
// the root mean square distance from its centre, is kLeastRadius l or more.
#pragma once

#include "common/core/types.hpp"
#include "common/values/sparse_data.hpp"

namespace brainshift::registration {

// Columns of B at most: on a ball the spherical harmonics up to the fourth degree.
inline constexpr int kMaxOutlineColumns = 25;
inline constexpr double kLeastRadius = 1.2;

struct OutlineErrors {
  Eigen::MatrixXd columns;  // B, points x k, mm
  // V_e by column, k x hypotheses: the first ones of kOutlineErrors, without lengths that do not
  // count.
  Eigen::MatrixXd variances;
};

// places: 3 x m on the outline, mm. No columns where no length counts. Some milliseconds for 200 of
// them.
OutlineErrors outline_errors(const Points& places);

}  // namespace brainshift::registration
