// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "common/core/random.hpp"
#include "common/fem/elasticity.hpp"
#include "common/linalg/distributed_cholesky.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/results.hpp"
#include "tests/support/thread_ranks.hpp"

namespace brainshift::linalg {
namespace {

using Eigen::MatrixXd;

SymmetricMatrix block_stiffness() {
  const TetMesh mesh = test_support::box_mesh(4, 3, 5, Vec3(40, 30, 50));
  fem::DofMap dofs(mesh.num_nodes());
  for (int node = 0; node < mesh.num_nodes(); ++node) {
    if (mesh.nodes(2, node) == 0.0) dofs.fix_all(node);
  }
  dofs.finalise();
  return fem::assemble_stiffness(mesh, fem::Elasticity{0.0242, 0.0021}, dofs);
}

// `parts` slices of the unknowns; or dealt at random, which puts most of them on the interface.
std::vector<int> slices(long unknowns, int parts) {
  std::vector<int> part(static_cast<std::size_t>(unknowns));
  for (long i = 0; i < unknowns; ++i) {
    part[static_cast<std::size_t>(i)] = static_cast<int>(i * parts / unknowns);
  }
  return part;
}
std::vector<int> scattered(long unknowns, int parts) {
  Random random(4);
  std::vector<int> part(static_cast<std::size_t>(unknowns));
  for (int& p : part) p = std::min(parts - 1, static_cast<int>(random.uniform() * parts));
  return part;
}

// Every process its own right-hand sides, as many as its number: the first has none.
void expect_equal_to_one_process(const SymmetricMatrix& k, const std::vector<int>& part,
                                 int parts) {
  const auto whole = value_or_fail(SparseCholesky::factorise(k));
  test_support::run_as_ranks(parts, [&](Ranks& ranks) {
    const auto factor = value_or_fail(DistributedCholesky::factorise(k, part, ranks));
    EXPECT_EQ(factor.size(), k.rows());
    EXPECT_GT(factor.rcond(), 1e-8);
    Random random(static_cast<std::uint64_t>(ranks.rank()));
    MatrixXd b(ranks.rank(), k.rows()), x;
    for (double& value : b.reshaped()) value = random.normal();
    factor.solve_rows(b, x);
    ASSERT_EQ(x.rows(), b.rows());
    const MatrixXd expected = whole.solve_rows(b);
    EXPECT_LE((x - expected).norm(), 1e-11 * expected.norm());
    EXPECT_TRUE(check_rows(k, max_norm(k), factor, b, x).has_value());
  });
}

TEST(DistributedCholesky, SolutionsAreThoseOfOneProcess) {
  const SymmetricMatrix k = block_stiffness();
  for (const int parts : {1, 2, 3, 5}) {
    expect_equal_to_one_process(k, slices(k.rows(), parts), parts);
  }
}

TEST(DistributedCholesky, APartWithoutAnInteriorTakesPart) {
  const SymmetricMatrix k = block_stiffness();
  expect_equal_to_one_process(k, scattered(k.rows(), 3), 3);
  std::vector<int> second_has_none = slices(k.rows(), 2);
  for (int& p : second_has_none) p *= 2;
  expect_equal_to_one_process(k, second_has_none, 3);
}

// Loads that meet one part alone, or the interface alone.
TEST(DistributedCholesky, SolutionsOfSingleLoadsAreThoseOfOneProcess) {
  const SymmetricMatrix k = block_stiffness();
  const auto whole = value_or_fail(SparseCholesky::factorise(k));
  test_support::run_as_ranks(2, [&](Ranks& ranks) {
    const auto factor =
        value_or_fail(DistributedCholesky::factorise(k, slices(k.rows(), 2), ranks));
    ASSERT_GT(factor.interface_size(), 0);
    for (long i = 0; i < k.rows(); i += 7) {
      MatrixXd b = MatrixXd::Zero(1, k.rows()), x;
      if (ranks.rank() == 1) b(0, i) = 1.0;
      factor.solve_rows(b, x);
      const MatrixXd expected = whole.solve_rows(b);
      EXPECT_LE((x - expected).norm(), 1e-11 * expected.norm()) << i;
    }
  });
}

TEST(DistributedCholesky, ErrorsAreTheSameInEveryProcess) {
  const SymmetricMatrix k = block_stiffness();
  SymmetricMatrix not_finite = k;
  not_finite.valuePtr()[0] = std::numeric_limits<double>::quiet_NaN();  // of the first part alone
  test_support::run_as_ranks(2, [&](Ranks& ranks) {
    refusal_of(DistributedCholesky::factorise(not_finite, slices(k.rows(), 2), ranks),
               ErrorCode::kNotFinite);
    const auto factor =
        value_or_fail(DistributedCholesky::factorise(k, slices(k.rows(), 2), ranks));
    MatrixXd b = MatrixXd::Ones(1, k.rows()), x;
    factor.solve_rows(b, x);
    if (ranks.rank() == 1) x *= 1.001;
    refusal_of(check_rows(k, max_norm(k), factor, b, x), ErrorCode::kSingularMatrix);
  });
}

}  // namespace
}  // namespace brainshift::linalg
