// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/linalg/symmetric_indefinite.hpp"

#include <gmock/gmock.h>

#include <limits>

#include "common/fem/biot_matrix.hpp"
#include "common/fem/elasticity.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/dense.hpp"
#include "tests/support/results.hpp"

namespace brainshift::linalg {
namespace {

using testing::HasSubstr;

struct IndefiniteBlock {
  TetMesh mesh = test_support::box_mesh(3, 2, 2, Vec3(30, 20, 20));
  fem::DofMap dofs{mesh.num_nodes()};
  fem::PressureMap pressure;
  explicit IndefiniteBlock(bool held = true) {
    std::vector<NodeIndex> drained;
    for (int n = 0; n < mesh.num_nodes(); ++n) {
      if (held && mesh.nodes(2, n) == 0.0) dofs.fix_all(n);
      if (mesh.nodes(2, n) == 20.0) drained.push_back(n);
    }
    dofs.finalise();
    pressure = fem::PressureMap(mesh.num_nodes(), drained);
  }
  fem::BiotMatrix matrix(double dt_s, double shear = 0.0021) const {
    fem::PoroMaterial tissue;
    tissue.elastic = {0.024, shear};
    tissue.permeability = 1e5;
    return fem::assemble_biot(mesh, fem::MaterialMap::uniform(tissue, mesh.num_tets()), dofs,
                              pressure, dt_s);
  }
};

Eigen::MatrixXd dense(const SymmetricMatrix& lower) {
  return Eigen::MatrixXd(SymmetricMatrix(lower.selfadjointView<Eigen::Lower>()));
}

Result<SymmetricIndefinite> factor_of(const fem::BiotMatrix& matrix) {
  return SymmetricIndefinite::factorise(matrix.lower, matrix.pressure_unknowns);
}

TEST(SymmetricIndefinite, EqualsDenseEliminationForStepsOfAllSizes) {
  const IndefiniteBlock block;
  for (const double dt : {1e-6, 1e-3, 1.0, 1e6}) {
    const fem::BiotMatrix matrix = block.matrix(dt);
    const auto factor = value_or_fail(factor_of(matrix));
    const VecX exact = VecX::LinSpaced(matrix.lower.rows(), -1.0, 2.0);
    VecX x;
    ASSERT_TRUE(factor.solve(multiply(matrix.lower, exact), x).has_value());
    const VecX reference = test_support::solve(dense(matrix.lower), multiply(matrix.lower, exact));
    const double rounding = (reference - exact).norm();
    EXPECT_LT((x - exact).norm(), std::max(100.0 * rounding, 1e-9 * exact.norm())) << dt;
    EXPECT_LT(factor.last_check().backward_error, 1e-14);
  }
}

TEST(SymmetricIndefinite, ManyRightHandSidesEqualSingleSolves) {
  const fem::BiotMatrix matrix = IndefiniteBlock().matrix(0.1);
  const auto factor = value_or_fail(factor_of(matrix));
  Eigen::MatrixXd b(matrix.lower.rows(), 70), x;  // more than one block
  for (Eigen::Index j = 0; j < b.cols(); ++j) {
    b.col(j) = std::pow(10.0, static_cast<double>(j % 7) - 3.0) *
               VecX::LinSpaced(b.rows(), 1.0, static_cast<double>(j)).array().sin().matrix();
  }
  ASSERT_TRUE(factor.solve_many(b, x).has_value());
  VecX single;
  for (Eigen::Index j = 0; j < b.cols(); ++j) {
    ASSERT_TRUE(factor.solve(b.col(j), single).has_value());
    EXPECT_LT((x.col(j) - single).norm(), 1e-10 * single.norm()) << j;
  }
  ASSERT_TRUE(factor.solve_many(Eigen::MatrixXd(b.rows(), 0), x).has_value());
  EXPECT_EQ(x.cols(), 0);
}

TEST(SymmetricIndefinite, ReciprocalConditionIsThatOfTheDenseScaledMatrix) {
  const fem::BiotMatrix matrix = IndefiniteBlock().matrix(0.1);
  const auto factor = value_or_fail(factor_of(matrix));
  Eigen::MatrixXd a = dense(matrix.lower);
  const VecX s = a.diagonal().cwiseAbs().cwiseSqrt().cwiseInverse();
  a = s.asDiagonal() * a * s.asDiagonal();
  const double norm = a.cwiseAbs().colwise().sum().maxCoeff();
  const double inverse = test_support::inverse(a).cwiseAbs().colwise().sum().maxCoeff();
  EXPECT_GE(factor.rcond() * norm * inverse, 0.999);
  EXPECT_LE(factor.rcond() * norm * inverse, 3.0);
}

TEST(SymmetricIndefinite, RefactorisedCloneEqualsAFreshFactorAndLeavesTheOriginalAlone) {
  const IndefiniteBlock block;
  const fem::BiotMatrix soft = block.matrix(0.1), stiff = block.matrix(0.1, 0.01);
  const auto original = value_or_fail(factor_of(soft));
  const VecX b = VecX::LinSpaced(soft.lower.rows(), -1.0, 1.0);
  VecX before, after, cloned, fresh;
  ASSERT_TRUE(original.solve(b, before).has_value());
  SymmetricIndefinite clone = original.clone_analysis();
  ASSERT_TRUE(clone.refactorise(stiff.lower).has_value());
  ASSERT_TRUE(clone.solve(b, cloned).has_value());
  ASSERT_TRUE(factor_of(stiff)->solve(b, fresh).has_value());
  ASSERT_TRUE(original.solve(b, after).has_value());
  EXPECT_LT((cloned - fresh).norm(), 1e-10 * fresh.norm());
  EXPECT_EQ(before, after);
  EXPECT_GT((cloned - before).norm(), 1e-3 * before.norm());
}

TEST(SymmetricIndefinite, RejectsABodyThatFloats) {
  EXPECT_THAT(refusal_of(factor_of(IndefiniteBlock(false).matrix(0.1)), ErrorCode::kFloatingBody),
              HasSubstr("not held"));
}

TEST(SymmetricIndefinite, RejectsAMatrixOfTheRightInertiaThatIsAsGoodAsSingular) {
  SymmetricMatrix lower(3, 3);
  for (int i = 0; i < 3; ++i) lower.insert(i, i) = i < 2 ? 1.0 : -1.0;
  lower.insert(1, 0) = 1.0 - 1e-15;
  lower.makeCompressed();
  EXPECT_THAT(refusal_of(SymmetricIndefinite::factorise(lower, 1), ErrorCode::kFloatingBody),
              HasSubstr("reciprocal condition"));
}

// Nothing moves at the boundary and nothing drains: a constant pressure is left open.
TEST(SymmetricIndefinite, RejectsFluidEnclosedInABodyThatCannotChangeItsVolume) {
  IndefiniteBlock block;
  block.dofs = fem::DofMap(block.mesh.num_nodes());
  const Vec3 size(30, 20, 20);
  for (int n = 0; n < block.mesh.num_nodes(); ++n) {
    const Vec3 x = block.mesh.nodes.col(n);
    if (x.minCoeff() == 0.0 || (size - x).minCoeff() == 0.0) block.dofs.fix_all(n);
  }
  block.dofs.finalise();
  ASSERT_GT(block.dofs.num_unknowns(), 0);
  block.pressure = fem::PressureMap(block.mesh.num_nodes(), {});
  EXPECT_THAT(refusal_of(factor_of(block.matrix(0.1)), ErrorCode::kFloatingBody),
              HasSubstr("fluid is enclosed"));
}

TEST(SymmetricIndefinite, RejectsTheWrongInertia) {
  fem::BiotMatrix matrix = IndefiniteBlock().matrix(0.1);
  // A tissue that pushes back with negative stiffness at one unknown.
  matrix.lower.coeffRef(5, 5) *= -1.0;
  EXPECT_THAT(refusal_of(factor_of(matrix), ErrorCode::kFloatingBody),
              HasSubstr("negative pivots instead of"));
}

TEST(SymmetricIndefinite, RejectsNumbersThatAreNotFinite) {
  const fem::BiotMatrix good = IndefiniteBlock().matrix(0.1);
  auto factor = value_or_fail(factor_of(good));
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    SymmetricMatrix spoilt = good.lower;
    spoilt.valuePtr()[7] = bad;
    EXPECT_EQ(SymmetricIndefinite::factorise(spoilt, good.pressure_unknowns).error().code,
              ErrorCode::kNotFinite);
    EXPECT_EQ(factor.refactorise(spoilt).error().code, ErrorCode::kNotFinite);
    ASSERT_TRUE(factor.refactorise(good.lower).has_value());
    VecX b = VecX::Ones(good.lower.rows()), x;
    b[3] = bad;
    EXPECT_EQ(factor.solve(b, x).error().code, ErrorCode::kNotFinite);
    Eigen::MatrixXd y;
    EXPECT_EQ(factor.solve_many(b, y).error().code, ErrorCode::kNotFinite);
  }
}

TEST(SymmetricIndefinite, RejectsASolutionThatOverflows) {
  const fem::BiotMatrix matrix = IndefiniteBlock().matrix(0.1);
  const auto factor = value_or_fail(factor_of(matrix));
  VecX x;
  const VecX b = VecX::Constant(matrix.lower.rows(), 1e307);
  EXPECT_FALSE(factor.solve(b, x).has_value());
}

TEST(SymmetricIndefinite, RejectsASystemWithoutUnknowns) {
  EXPECT_EQ(SymmetricIndefinite::factorise(SymmetricMatrix(0, 0), 0).error().code,
            ErrorCode::kEmptySet);
}

}  // namespace
}  // namespace brainshift::linalg
