// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/operators/compact_columns.hpp"

#include <gmock/gmock.h>

#include <functional>
#include <limits>
#include <vector>

namespace brainshift {
namespace {

using testing::HasSubstr;

// Two nodes in one block, node 1 first, and node 2 in another; two columns. The first block has a
// coefficient of each width, the second one narrow one.
CompactParts example() {
  CompactParts parts;
  parts.steps.resize(2);
  parts.steps << 0.5F, 0.25F;
  parts.order = {1, 0, 2};
  parts.blocks.resize(4, 2);
  parts.blocks << 2, 1, 1, 0, 1, 0, 1, 1;
  parts.wide_basis.resize(6);
  parts.wide_basis << 1, 0, 0, 0, 0, 0;
  parts.basis.resize(15);
  parts.basis << 0, 2, 0, 0, 0, 0, /**/ 0, 0, 0, 0, 0, 4, /**/ 0, 3, 0;
  parts.basis_scales.resize(3);
  parts.basis_scales << 0.5F, 0.25F, 2.0F;
  parts.words.resize(4);
  parts.words << 1000, -300, -20000, 7;
  parts.bytes.resize(6);
  parts.bytes << -128, 9, 127, -5, 11, -100;
  return parts;
}

CompactColumns made(CompactParts parts = example()) {
  auto columns = CompactColumns::from_parts(std::move(parts));
  EXPECT_TRUE(columns.has_value()) << columns.error().message;
  return std::move(*columns);
}

TEST(CompactColumns, NumbersFollowTheFormulaOfTheHeader) {
  const CompactColumns columns = made();
  ASSERT_EQ(columns.num_nodes(), 3);
  ASSERT_EQ(columns.num_columns(), 2);
  ASSERT_EQ(columns.num_blocks(), 2);
  float out[6];
  const CompactColumns::Term both[] = {{0, 2.0F}, {1, -1.0F}};
  columns.sum(0, both, out);
  // Column 0: step 0.5; column 1: step 0.25.
  EXPECT_EQ(out[0], 2.0F * 0.5F * (256 * 1000 - 128) - 0.25F * (256 * -20000 + 127));
  EXPECT_EQ(out[1], 2.0F * 0.5F * -300 - 0.25F * 7);
  EXPECT_EQ(out[5], 2.0F * 0.5F * 9 - 0.25F * -5);
  EXPECT_EQ(out[2], 0.0F);
  columns.sum(1, both, out);
  EXPECT_EQ(out[1], 6.0F * (2.0F * 0.5F * 11 - 0.25F * -100));
  columns.sum(1, {}, out);
  EXPECT_EQ(out[1], 0.0F);
}

TEST(CompactColumns, NodesHaveOnePlaceEach) {
  const CompactColumns columns = made();
  EXPECT_EQ(columns.place(0).block, 0);
  EXPECT_EQ(columns.place(0).node, 1);
  EXPECT_EQ(columns.place(1).node, 0);
  EXPECT_EQ(columns.place(2).block, 1);
  EXPECT_EQ(columns.first_node(1), 2);
  EXPECT_EQ(columns.nodes(0)[0], 1);
}

TEST(CompactColumns, BasisTimesCoefficientsIsTheColumn) {
  const CompactColumns columns = made();
  for (int block = 0; block < 2; ++block) {
    const auto rows = static_cast<Eigen::Index>(3 * columns.nodes(block).size());
    Eigen::MatrixXf basis(rows, columns.rank(block));
    columns.basis(block, basis.data());
    for (int column = 0; column < 2; ++column) {
      Eigen::VectorXf coefficients(columns.rank(block)), summed(rows);
      columns.coefficients(block, column, coefficients.data());
      const CompactColumns::Term one[] = {{column, 1.0F}};
      columns.sum(block, one, summed.data());
      EXPECT_EQ(Eigen::VectorXf(basis * coefficients), summed);
    }
  }
}

TEST(CompactColumns, NoNodesAndNoColumnsAreValid) {
  EXPECT_EQ(made({}).num_nodes(), 0);
  CompactParts still = example();
  still.steps.resize(0);
  still.words.resize(0);
  still.bytes.resize(0);
  const CompactColumns columns = made(still);
  float out[6] = {1, 1, 1, 1, 1, 1};
  columns.sum(0, {}, out);
  EXPECT_EQ(out[0], 0.0F);
}

TEST(CompactColumns, PartsThatDoNotFitAreRefused) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  struct Misfit {
    std::string message;
    std::function<void(CompactParts&)> make;
  };
  const Misfit cases[] = {
      {"steps holds a number that is not finite", [=](CompactParts& p) { p.steps[1] = nan; }},
      {"steps holds a number that is not above 0", [](CompactParts& p) { p.steps[0] = 0.0F; }},
      {"steps holds a number that is not above 0", [](CompactParts& p) { p.steps[0] = -1.0F; }},
      {"wide_basis holds a number that is not finite",
       [=](CompactParts& p) { p.wide_basis[5] = -inf; }},
      {"basis_scales holds a number that is not finite",
       [=](CompactParts& p) { p.basis_scales[0] = inf; }},
      {"blocks: block 0 has 0 nodes", [](CompactParts& p) { p.blocks(0, 0) = 0; }},
      {"blocks: block 0 has 129 nodes", [](CompactParts& p) { p.blocks(0, 0) = 129; }},
      {"blocks: block 1 has 1 nodes and -1 + 0 + 1", [](CompactParts& p) { p.blocks(1, 1) = -1; }},
      {"blocks: block 1 has 1 nodes and 0 + 3 + 1", [](CompactParts& p) { p.blocks(2, 1) = 3; }},
      {"blocks: block 1 has 1 nodes and 0 + 0 + 2147483647",
       [](CompactParts& p) { p.blocks(3, 1) = std::numeric_limits<int>::max(); }},
      {"order has 2 numbers: must be 3", [](CompactParts& p) { p.order.pop_back(); }},
      {"order does not name every node once", [](CompactParts& p) { p.order[2] = 1; }},
      {"order does not name every node once", [](CompactParts& p) { p.order[2] = 3; }},
      {"order does not name every node once", [](CompactParts& p) { p.order[2] = -1; }},
      {"wide_basis has 5 numbers: must be 6",
       [](CompactParts& p) { p.wide_basis.conservativeResize(5); }},
      {"basis has 16 numbers: must be 15", [](CompactParts& p) { p.basis.setZero(16); }},
      {"basis_scales has 2 numbers: must be 3",
       [](CompactParts& p) { p.basis_scales.conservativeResize(2); }},
      {"words has 0 numbers: must be 4", [](CompactParts& p) { p.words.resize(0); }},
      {"bytes has 5 numbers: must be 6", [](CompactParts& p) { p.bytes.conservativeResize(5); }},
      {"words has 4 numbers: must be 6", [](CompactParts& p) { p.steps.setOnes(3); }},
  };
  for (const Misfit& misfit : cases) {
    CompactParts parts = example();
    misfit.make(parts);
    const auto refused = CompactColumns::from_parts(parts);
    ASSERT_FALSE(refused.has_value()) << misfit.message;
    EXPECT_THAT(refused.error().message, HasSubstr(misfit.message));
  }
}

TEST(CompactColumns, MoreBlocksThanNodesAreRefused) {
  CompactParts parts = example();
  parts.blocks.setZero(4, 1000);
  parts.blocks.row(0).setConstant(CompactColumns::kBlockNodes);
  const auto refused = CompactColumns::from_parts(parts);
  ASSERT_FALSE(refused.has_value());
  EXPECT_THAT(refused.error().message, HasSubstr("order has 3 numbers"));
}

}  // namespace
}  // namespace brainshift
