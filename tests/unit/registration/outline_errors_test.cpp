// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/outline_errors.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace brainshift::registration {
namespace {

using Eigen::MatrixXd;

// Evenly over a ball (Fibonacci's spiral).
Points on_ball(int count, double radius_mm) {
  Points places(3, count);
  for (int i = 0; i < count; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / count, turn = 2.399963229728653 * i;
    const double r = std::sqrt(1.0 - z * z);
    places.col(i) = radius_mm * Vec3(r * std::cos(turn), r * std::sin(turn), z);
  }
  return places;
}

MatrixXd covariance(const Points& places, const OutlineError& error) {
  MatrixXd k(places.cols(), places.cols());
  for (Eigen::Index i = 0; i < k.rows(); ++i) {
    for (Eigen::Index j = 0; j < k.cols(); ++j) {
      const double r = (places.col(i) - places.col(j)).norm() / error.length_mm;
      k(i, j) = error.sd_mm * error.sd_mm * std::exp(-0.5 * r * r);
    }
  }
  return k;
}

TEST(OutlineErrors, HaveTheCovarianceOfEveryHypothesis) {
  for (const double radius_mm : {7.0, 12.5, 15.0}) {
    const Points places = on_ball(200, radius_mm);
    const OutlineErrors found = outline_errors(places);
    ASSERT_LE(found.columns.cols(), kMaxOutlineColumns);
    const std::size_t hypotheses = radius_mm < 12.0 ? 4 : kOutlineErrors.size();
    ASSERT_EQ(found.variances.cols(), static_cast<Eigen::Index>(hypotheses));
    for (std::size_t e = 0; e < hypotheses; ++e) {
      const VecX variances = found.variances.col(static_cast<Eigen::Index>(e));
      EXPECT_GE(variances.minCoeff(), 0.0);
      EXPECT_LE(variances.maxCoeff(), 1.0 + 1e-12);
      const MatrixXd made = found.columns * variances.asDiagonal() * found.columns.transpose();
      const MatrixXd expected = covariance(places, kOutlineErrors[e]);
      // Of a large outline the short errors are more than the columns hold.
      const bool many = radius_mm > 10.0 && kOutlineErrors[e].length_mm < 10.0;
      const double left_out = !many ? 0.06 : radius_mm < 13.0 ? 0.13 : 0.25;
      EXPECT_LE((made - expected).norm(), left_out * expected.norm()) << radius_mm << ", " << e;
      // What is left out is variance that the data's own errors stand for: hardly ever negative.
      EXPECT_LE((made - expected).diagonal().maxCoeff(), 0.01 * std::pow(0.5, 2));
    }
  }
}

// Points far apart have nothing to share; of a small outline nothing tells the error from motion.
TEST(OutlineErrors, FewPointsHaveAsManyColumnsAndSmallOutlinesNone) {
  Points places(3, 2);
  places << 0, 100, 0, 0, 0, 0;
  const OutlineErrors found = outline_errors(places);
  const MatrixXd made =
      found.columns * found.variances.col(3).asDiagonal() * found.columns.transpose();
  EXPECT_LT((made - 0.25 * MatrixXd::Identity(2, 2)).norm(), 1e-12);
  EXPECT_EQ(outline_errors(Points(3, 0)).columns.cols(), 0);
  EXPECT_EQ(outline_errors(on_ball(100, 5.9)).columns.cols(), 0);
  EXPECT_EQ(outline_errors(on_ball(100, 11.9)).variances.cols(), 4);
}

}  // namespace
}  // namespace brainshift::registration
