// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/prior/force_prior.hpp"

#include <gtest/gtest.h>

#include "common/fem/elasticity.hpp"
#include "tests/support/box_mesh.hpp"

namespace brainshift::prior {
namespace {

TEST(ForcePrior, IsTheSumOfItsKernelsAndModes) {
  const TetMesh mesh = test_support::box_mesh(3, 3, 3, Vec3(30, 30, 30));
  const VecX volumes = fem::nodal_volumes(mesh);
  std::srand(8);
  LoadModes modes;
  modes.columns = Eigen::MatrixXd::Random(3 * mesh.num_nodes(), 2);
  modes.of_part[0] = 2;
  const ForcePrior prior({ForceKernel::compact(mesh.nodes, volumes, 6.0, 0.3),
                          ForceKernel::basis(mesh.nodes, volumes, 20.0, 0.2),
                          ForceKernel::basis(mesh.nodes, volumes, 60.0, 0.1)},
                         modes);
  const Points w = Points::Random(3, mesh.num_nodes());
  const Points f = prior.apply(w);
  const Eigen::MatrixXd dense =
      prior.kernel(0).dense() + prior.kernel(1).dense() + prior.kernel(2).dense();
  Points remainders = w * dense;  // symmetric
  Eigen::MatrixXd of_remainders;
  prior.apply_remainders(w.reshaped().transpose(), of_remainders);
  ASSERT_GT(remainders.norm(), 1.0);
  EXPECT_LT((of_remainders - remainders.reshaped().transpose()).norm(), 1e-12 * remainders.norm());
  const VecX from_modes = modes.columns * (modes.columns.transpose() * w.reshaped());
  const VecX expected = remainders.reshaped() + from_modes;
  EXPECT_LT((f.reshaped() - expected).norm(), 1e-12 * expected.norm());
}

}  // namespace
}  // namespace brainshift::prior
