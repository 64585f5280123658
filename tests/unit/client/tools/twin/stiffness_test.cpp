// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/stiffness.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/support/toy_patient.hpp"

namespace brainshift::client {
namespace {

constexpr double kSd = 0.3, kLength_mm = 8.0;

const BrainModel& stiffness_patient() {
  static const BrainModel model = test_support::toy_patient(6);
  return model;
}

// ln of the relative shear modulus of every element.
VecX log_stiffness(std::uint64_t seed) {
  const CaseConfig config = test_support::toy_config();
  const VariedBrain varied = vary_stiffness(stiffness_patient(), config, kSd, kLength_mm, seed);
  VecX ln(varied.model.mesh.num_tets());
  for (int t = 0; t < varied.model.mesh.num_tets(); ++t) {
    const int label = varied.model.mesh.labels.at(static_cast<std::size_t>(t));
    ln[t] = std::log(varied.config.material.regions.at(label).shear_modulus_pa /
                     config.material.shear_modulus_pa);
  }
  return ln;
}

Points centroids(const TetMesh& mesh) {
  Points x(3, mesh.num_tets());
  for (int t = 0; t < mesh.num_tets(); ++t) {
    x.col(t) = mesh.nodes(Eigen::all, mesh.tets.col(t)).rowwise().mean();
  }
  return x;
}

TEST(VariedStiffness, IsTheSameBrainForASeed) {
  EXPECT_EQ(log_stiffness(7), log_stiffness(7));
  EXPECT_NE(log_stiffness(7), log_stiffness(8));
}

// Over many brains: mean 0, standard deviation sd, and covariance sd^2 exp(-d^2 / 2 l^2) of two
// elements at a distance d. Classes of 0.5 sd within +-2 sd leave 0.970 of the standard deviation:
// the variance of a standard normal clamped to +-2 is 0.9205, rounding adds 0.5^2 / 12.
TEST(VariedStiffness, HasTheMeanSpreadAndLengthAskedFor) {
  constexpr int kBrains = 60;
  const Points x = centroids(stiffness_patient().mesh);
  const Eigen::Index elements = x.cols();
  double sum = 0.0, squares = 0.0;
  // Of pairs of elements by distance in units of the length: about 1, and beyond 4.
  double near = 0.0, far = 0.0, expected_near = 0.0;
  long near_pairs = 0, far_pairs = 0;
  for (std::uint64_t seed = 1; seed <= kBrains; ++seed) {
    const VecX ln = log_stiffness(seed);
    sum += ln.mean() / kBrains;
    squares += ln.squaredNorm() / static_cast<double>(elements) / kBrains;
    for (Eigen::Index a = 0; a < elements; a += 17) {
      for (Eigen::Index b = a + 1; b < elements; b += 5) {
        const double d = (x.col(a) - x.col(b)).norm() / kLength_mm;
        if (d > 0.7 && d < 1.3) {
          near += ln[a] * ln[b];
          expected_near += std::exp(-0.5 * d * d);
          ++near_pairs;
        } else if (d > 4.0) {
          far += ln[a] * ln[b];
          ++far_pairs;
        }
      }
    }
  }
  ASSERT_GT(near_pairs, 1000);
  ASSERT_GT(far_pairs, 1000);
  // The spread over 60 brains of this size is a fifth of these bounds.
  EXPECT_NEAR(sum, 0.0, 0.03);
  EXPECT_NEAR(std::sqrt(squares), 0.970 * kSd, 0.03 * kSd);
  const double variance = squares;
  EXPECT_NEAR(near / static_cast<double>(near_pairs) / variance,
              expected_near / static_cast<double>(near_pairs), 0.08);
  EXPECT_NEAR(far / static_cast<double>(far_pairs) / variance, 0.0, 0.08);
}

// ln of the relative shear modulus of every element, with tissues told apart.
VecX log_tissues(std::uint64_t seed) {
  const CaseConfig config = test_support::toy_config();
  const auto varied = vary_tissues(stiffness_patient(), config, seed);
  EXPECT_TRUE(varied) << varied.error().message;
  VecX ln(varied->model.mesh.num_tets());
  for (int t = 0; t < varied->model.mesh.num_tets(); ++t) {
    const int label = varied->model.mesh.labels.at(static_cast<std::size_t>(t));
    ln[t] = std::log(varied->config.material.regions.at(label).shear_modulus_pa /
                     config.material.shear_modulus_pa);
  }
  return ln;
}

// Averaged over brains, what the field adds vanishes, and a tissue is 30 % stiffer or softer with
// equal probability: ln 1.3 and ln 0.7 have the mean -0.047 and the standard deviation 0.31; with
// the field's (0.29, see above) that is 0.42 in all.
TEST(VariedTissues, AreStifferAndSofterByWhatIsSaid) {
  constexpr int kBrains = 60;
  double sum = 0.0, squares = 0.0;
  for (std::uint64_t seed = 1; seed <= kBrains; ++seed) {
    const VecX ln = log_tissues(seed);
    sum += ln.mean() / kBrains;
    squares += ln.squaredNorm() / static_cast<double>(ln.size()) / kBrains;
  }
  EXPECT_NEAR(sum, -0.047, 0.1);
  EXPECT_NEAR(std::sqrt(squares), 0.42, 0.06);
}

TEST(VariedTissues, AreTheSameForASeedAndDifferInTheTumour) {
  EXPECT_EQ(log_tissues(3), log_tissues(3));
  EXPECT_NE(log_tissues(3), log_tissues(4));
  // Centres of tetrahedra well inside the tumour, and well outside it but not at the surface.
  const Points x = centroids(stiffness_patient().mesh);
  int differ = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const VecX ln = log_tissues(seed);
    double inside = 0.0, outside = 0.0;
    int in = 0, out = 0;
    for (Eigen::Index t = 0; t < x.cols(); ++t) {
      const double distance = (x.col(t) - Vec3(30, 30, 40)).norm();
      if (distance < 9.0) inside += ln[t], ++in;
      if (distance > 12.0 && distance < 17.0) outside += ln[t], ++out;
    }
    ASSERT_GT(in, 5);
    ASSERT_GT(out, 5);
    differ += std::abs(inside / in - outside / out) > 0.35 ? 1 : 0;
  }
  EXPECT_GE(differ, 5);  // half of the brains have tissues of unlike sign
  EXPECT_LE(differ, 17);
}

}  // namespace
}  // namespace brainshift::client
