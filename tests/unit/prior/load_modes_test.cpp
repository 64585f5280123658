// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/prior/load_modes.hpp"

#include <gtest/gtest.h>

#include "common/fem/elasticity.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::prior {
namespace {

Eigen::Map<const Points> mode(const Eigen::MatrixXd& modes, Eigen::Index column) {
  return {modes.col(column).data(), 3, modes.rows() / 3};
}

TEST(LoadModes, AreTriplesOfGravityThenFoursOfSwelling) {
  const BrainModel patient = test_support::toy_patient();
  CaseConfig config = test_support::toy_config();
  config.prior.gravity_levels_mm = {0.0, 20.0};
  config.prior.swelling_radii_mm = {15.0};
  config.prior.swelling_strain_sd = 0.05;
  const LoadModeCounts counts = load_mode_counts(config.prior);
  EXPECT_EQ(counts.gravity, 6);
  EXPECT_EQ(counts.swelling, 4);
  EXPECT_EQ(load_modes(patient, config).cols(), 10);
  EXPECT_EQ(prior_part(3, counts), PriorPart::kAlongGravity);
  EXPECT_EQ(prior_part(4, counts), PriorPart::kAcrossGravity);
  EXPECT_EQ(prior_part(6, counts), PriorPart::kSwelling);
  EXPECT_EQ(prior_part(9, counts), PriorPart::kSwelling);
  EXPECT_EQ(prior_part(10, counts), PriorPart::kOther);
  config.prior.gravity_mode_sd = 0.0;
  config.prior.swelling_strain_sd = 0.0;
  EXPECT_EQ(load_modes(patient, config).cols(), 0);
}

TEST(LoadModes, SwellingBalancesItself) {
  const BrainModel patient = test_support::toy_patient();
  CaseConfig config = test_support::toy_config();
  config.prior.swelling_strain_sd = 0.05;
  const LoadModeCounts counts = load_mode_counts(config.prior);
  const Eigen::MatrixXd modes = load_modes(patient, config);
  for (int j = counts.gravity; j < counts.all(); ++j) {
    const auto force = mode(modes, j);
    const double size = force.colwise().norm().sum();
    ASSERT_GT(size, 0.0);
    EXPECT_LT(force.rowwise().sum().norm(), 1e-12 * size) << j;
    Vec3 moment = Vec3::Zero();
    for (Eigen::Index i = 0; i < force.cols(); ++i) {
      moment += Vec3(patient.mesh.nodes.col(i)).cross(Vec3(force.col(i)));
    }
    EXPECT_LT(moment.norm(), 1e-10 * size) << j;
  }
}

// Work in a uniform dilation u = x e: sum f . x = kappa sum V theta tr(grad x) = 3 kappa int
// theta.
TEST(LoadModes, SwellingDoesTheWorkOfItsVolumeStrain) {
  const BrainModel patient = test_support::toy_patient(8);
  CaseConfig config = test_support::toy_config();
  config.prior.swelling_radii_mm = {12.0};
  config.prior.swelling_strain_sd = 0.3;
  const LoadModeCounts counts = load_mode_counts(config.prior);
  const Eigen::MatrixXd modes = load_modes(patient, config);
  const auto force = mode(modes, counts.gravity);
  const fem::Elasticity elasticity = fem::elasticity_from(config.material);
  const double bulk = elasticity.lambda + 2.0 / 3.0 * elasticity.shear;
  const Vec3 centre = patient.tumour.vertices.rowwise().mean();
  double integral = 0.0;
  for (int t = 0; t < patient.mesh.num_tets(); ++t) {
    Vec3 centroid = Vec3::Zero();
    for (int k = 0; k < 4; ++k) centroid += 0.25 * patient.mesh.nodes.col(patient.mesh.tets(k, t));
    integral += fem::tet_geometry(patient.mesh, t).volume *
                std::exp(-0.5 * (centroid - centre).squaredNorm() / (12.0 * 12.0));
  }
  const double work = force.cwiseProduct(patient.mesh.nodes).sum();
  EXPECT_NEAR(work, 3.0 * bulk * 0.3 * integral, 1e-9 * std::abs(work));
}

}  // namespace
}  // namespace brainshift::prior
