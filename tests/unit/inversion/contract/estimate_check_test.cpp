// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/contract/estimate_check.hpp"

#include <limits>

#include "common/inversion/invert.hpp"
#include "common/operators/encode_columns.hpp"
#include "tests/unit/inversion/condensed_fixture.hpp"

namespace brainshift::inversion {
namespace {

using EstimateCheck = Condensed;

TEST_F(EstimateCheck, AnOrdinaryEstimateIsUprightAndHasNoWarning) {
  auto inverter = Condensed::inverter(Boundary::kContact);
  const SparseData data = sagging_data(Boundary::kContact, 0.05);
  Estimate estimate;
  ASSERT_TRUE(inverter.update(data, estimate));
  const auto exact = fem::measure_deformation(patient()->mesh, estimate.displacement);
  EXPECT_NEAR(estimate.min_volume_ratio, exact.min_volume_ratio, 1e-4);
  EXPECT_LT(estimate.min_volume_ratio, 1.0);
  EXPECT_GE(estimate.min_nodal_volume_ratio, estimate.min_volume_ratio);
  EXPECT_EQ(estimate.inverted_elements, 0);
  EXPECT_EQ(estimate.reason.find("; "), std::string::npos) << estimate.reason;
}

// Neighbours that are asked to change places, within what check_data lets pass.
TEST_F(EstimateCheck, InvertedElementsAreCountedAndSaid) {
  SparseData data = sagging_data(Boundary::kContact, 0.0);
  for (Eigen::Index i = 0; i < data.positions.cols(); ++i) {
    data.displacements.col(i) = Vec3(i % 2 == 0 ? 9.0 : -9.0, 0.0, 0.0);
  }
  data.sd_mm.setConstant(1e-3);
  auto inverter = Condensed::inverter(Boundary::kContact);
  Estimate estimate;
  const auto status = inverter.update(data, estimate);
  ASSERT_TRUE(status.has_value()) << status.error().message;
  const auto exact = fem::measure_deformation(patient()->mesh, estimate.displacement);
  ASSERT_GT(exact.inverted, 0);
  EXPECT_EQ(estimate.inverted_elements, exact.inverted);
  EXPECT_LT(estimate.min_volume_ratio, 0.0);
  EXPECT_NE(estimate.reason.find(std::to_string(exact.inverted) + " elements inverted"),
            std::string::npos)
      << estimate.reason;
}

// A contact column that is not what contact was solved with.
TEST_F(EstimateCheck, AFieldThatContradictsItsContactForcesIsRefused) {
  const SparseData data = sagging_data(Boundary::kContact, 0.05);
  Estimate estimate;
  auto inverter = Condensed::inverter(Boundary::kContact);
  ASSERT_TRUE(inverter.update(data, estimate));
  ASSERT_FALSE(estimate.active_slaves.empty());
  auto wrong = std::make_shared<CondensedOperators>(*operators(Boundary::kContact));
  const auto slave =
      std::find(wrong->slaves.begin(), wrong->slaves.end(), estimate.active_slaves.front()) -
      wrong->slaves.begin();
  ThreadTeam team(1);
  Eigen::MatrixXf columns = decode_rows(wrong->responses, column_range(0, wrong->num_nodes()),
                                        column_range(0, wrong->responses.num_columns()), team);
  columns.col(wrong->contact_column(static_cast<int>(slave))) *= 1.5F;
  wrong->responses =
      *encode_columns(node_blocks(patient()->mesh.nodes), {group_of(columns, kModeStep)}, team);
  const auto locator = std::make_shared<const geometry::TetLocator>(patient()->mesh);
  auto broken = CondensedInverter::build(wrong, locator, config(), {});
  ASSERT_TRUE(broken.has_value());
  const auto status = broken->update(data, estimate);
  ASSERT_FALSE(status.has_value());
  EXPECT_EQ(status.error().code, ErrorCode::kNotConverged);
  EXPECT_NE(status.error().message.find("equilibrium"), std::string::npos);
  EXPECT_EQ(estimate.status, EstimateStatus::kNotRun);
}

TEST_F(EstimateCheck, AFieldThatIsNotFiniteIsRefused) {
  auto wrong = std::make_shared<CondensedOperators>(*operators(Boundary::kContact));
  NodeIndex hidden = 0;  // neither data nor contact look there
  while (std::binary_search(wrong->region.begin(), wrong->region.end(), hidden) ||
         std::count(wrong->slaves.begin(), wrong->slaves.end(), hidden) > 0) {
    ++hidden;
  }
  // Its row of the basis: finite, as a file's must be, but no sum with it is.
  CompactParts parts = wrong->responses.parts();
  const CompactColumns::Place place = wrong->responses.place(hidden);
  const auto sizes = [&](int block) { return Eigen::Vector2i(parts.blocks.col(block).head<2>()); };
  Eigen::Index at = 3 * place.node;
  for (int b = 0; b < place.block; ++b) at += 3 * sizes(b)[0] * sizes(b)[1];
  ASSERT_GT(sizes(place.block)[1], 0);
  for (int j = 0; j < sizes(place.block)[1]; ++j, at += 3 * sizes(place.block)[0]) {
    parts.wide_basis[at] = std::numeric_limits<float>::max();
  }
  wrong->responses = *CompactColumns::from_parts(std::move(parts));
  const auto locator = std::make_shared<const geometry::TetLocator>(patient()->mesh);
  auto broken = CondensedInverter::build(wrong, locator, config(), {});
  ASSERT_TRUE(broken.has_value());
  Estimate estimate;
  const auto status = broken->update(sagging_data(Boundary::kContact, 0.05), estimate);
  ASSERT_FALSE(status.has_value());
  EXPECT_EQ(status.error().code, ErrorCode::kNotFinite);
}

TEST_F(EstimateCheck, LinearElementsNearIncompressibilityAreSaidToLock) {
  const SparseData data = sagging_data(Boundary::kContact, 0.05);
  CaseConfig nearly = config();
  nearly.material.poisson_ratio = 0.49;
  auto inverter = Condensed::inverter(Boundary::kContact, {}, nearly);
  Estimate estimate;
  ASSERT_TRUE(inverter.update(data, estimate));
  EXPECT_NE(estimate.reason.find("lock"), std::string::npos) << estimate.reason;

  const auto model = PreparedModel::prepare(patient(), nearly, Boundary::kContact);
  ASSERT_TRUE(model.has_value());
  const auto paper = invert(*model, data, Method::kPaper);
  ASSERT_TRUE(paper.has_value());
  EXPECT_NE(paper->reason.find("lock"), std::string::npos) << paper->reason;
  EXPECT_FALSE(std::isnan(paper->min_volume_ratio));
}

}  // namespace
}  // namespace brainshift::inversion
