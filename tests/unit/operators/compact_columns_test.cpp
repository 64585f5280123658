// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/operators/compact_columns.hpp"
#include "tests/support/results.hpp"

#include <gmock/gmock.h>

#include <functional>
#include <limits>

namespace brainshift {
namespace {

using testing::HasSubstr;

// Seven nodes in one block, node 1 first, and node 7 in another; two columns. Direction i of the
// first block is row i, times 1.5 at i = 8: column 0 has eight coefficients of each width, column 1
// eight words and eight bytes. In the second block column 0 has a coefficient and column 1 none.
CompactParts example() {
  CompactParts parts;
  parts.steps.resize(2);
  parts.steps << 0.5F, 0.25F;
  parts.order = {1, 0, 2, 3, 4, 5, 6, 7};
  parts.blocks.resize(3, 2);
  parts.blocks << 7, 1, 8, 0, 13, 1;
  Eigen::MatrixXf wide = Eigen::MatrixXf::Zero(21, 8);
  Eigen::Matrix<std::int16_t, 21, 13> others = decltype(others)::Zero();
  for (int i = 0; i < 8; ++i) wide(i, i) = 1.0F;
  for (int i = 0; i < 13; ++i) others(8 + i, i) = i == 0 ? 6 : 4;
  parts.wide_basis = wide.reshaped();
  parts.basis.resize(21 * 13 + 3);
  parts.basis << others.reshaped(), 0, 3, 0;
  parts.basis_scales.resize(14);
  parts.basis_scales << Eigen::VectorXf::Constant(13, 0.25F), 2.0F;
  parts.lengths.resize(12);
  parts.lengths << 1, 1, 1, /**/ 0, 1, 1, /**/ 0, 0, 1, /**/ 0, 0, 0;
  parts.longs.setZero(8);
  parts.longs.head(2) << 16777216, -5;
  parts.words.setZero(16);
  parts.words[0] = -300;  // column 0, direction 8
  parts.words[8] = 7;     // column 1, direction 0
  parts.words[15] = -32768;
  parts.bytes.setZero(24);
  parts.bytes[4] = 127;   // column 0, direction 20, the last
  parts.bytes[8] = -128;  // column 1, direction 8
  parts.bytes[16] = 11;
  return parts;
}

CompactColumns made(CompactParts parts = example()) {
  return value_or_fail(CompactColumns::from_parts(std::move(parts)));
}

TEST(CompactColumns, NumbersFollowTheFormulaOfTheHeader) {
  const CompactColumns columns = made();
  ASSERT_EQ(columns.num_nodes(), 8);
  ASSERT_EQ(columns.num_columns(), 2);
  ASSERT_EQ(columns.num_blocks(), 2);
  float out[21];
  const CompactColumns::Term both[] = {{0, 2.0F}, {1, -1.0F}};
  columns.sum(0, both, out);
  // Column 0: step 0.5; column 1: step 0.25.
  EXPECT_EQ(out[0], 2.0F * 0.5F * 16777216 - 0.25F * 7);
  EXPECT_EQ(out[1], 2.0F * 0.5F * -5);
  EXPECT_EQ(out[2], 0.0F);
  EXPECT_EQ(out[7], -0.25F * -32768);
  EXPECT_EQ(out[8], 1.5F * (2.0F * 0.5F * -300 - 0.25F * -128));
  EXPECT_EQ(out[20], 2.0F * 0.5F * 127);
  columns.sum(1, both, out);
  EXPECT_EQ(out[1], 6.0F * (2.0F * 0.5F * 11));
  columns.sum(1, {}, out);
  EXPECT_EQ(out[1], 0.0F);
}

TEST(CompactColumns, NodesHaveOnePlaceEach) {
  const CompactColumns columns = made();
  EXPECT_EQ(columns.place(0).block, 0);
  EXPECT_EQ(columns.place(0).node, 1);
  EXPECT_EQ(columns.place(1).node, 0);
  EXPECT_EQ(columns.place(7).block, 1);
  EXPECT_EQ(columns.first_node(1), 7);
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

// Column 0 has -150 in direction 8 and 63.5 in the last one, 20, and nothing between.
TEST(CompactColumns, NoMoreIsLeftOutOfASumThanIsAllowed) {
  const CompactColumns columns = made();
  const CompactColumns::Term one[] = {{0, 1.0F}};
  Eigen::VectorXf exact(21), less(21);
  columns.sum(0, one, exact.data());
  ASSERT_EQ(exact[20], 63.5F);
  columns.sum(0, one, less.data(), 63.4F);
  EXPECT_EQ(less, exact);
  columns.sum(0, one, less.data(), 63.6F);
  EXPECT_EQ(less[20], 0.0F);
  EXPECT_EQ(less.head(20), exact.head(20));
}

TEST(CompactColumns, NoNodesAndNoColumnsAreValid) {
  EXPECT_EQ(made({}).num_nodes(), 0);
  CompactParts still = example();
  still.steps.resize(0);
  still.lengths.resize(0);
  still.longs.resize(0);
  still.words.resize(0);
  still.bytes.resize(0);
  const CompactColumns columns = made(still);
  float out[21] = {1};
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
      {"blocks: block 1 has 1 nodes and -1 + 1", [](CompactParts& p) { p.blocks(1, 1) = -1; }},
      {"blocks: block 1 has 1 nodes and 3 + 1", [](CompactParts& p) { p.blocks(1, 1) = 3; }},
      {"blocks: block 1 has 1 nodes and 0 + 2147483647",
       [](CompactParts& p) { p.blocks(2, 1) = std::numeric_limits<int>::max(); }},
      {"order has 7 numbers: must be 8", [](CompactParts& p) { p.order.pop_back(); }},
      {"order does not name every node once", [](CompactParts& p) { p.order[2] = 1; }},
      {"order does not name every node once", [](CompactParts& p) { p.order[2] = 8; }},
      {"order does not name every node once", [](CompactParts& p) { p.order[2] = -1; }},
      {"wide_basis has 167 numbers: must be 168",
       [](CompactParts& p) { p.wide_basis.conservativeResize(167); }},
      {"basis has 300 numbers: must be 276", [](CompactParts& p) { p.basis.setZero(300); }},
      {"basis_scales has 2 numbers: must be 14",
       [](CompactParts& p) { p.basis_scales.conservativeResize(2); }},
      {"lengths has 11 numbers: must be 12",
       [](CompactParts& p) { p.lengths.conservativeResize(11); }},
      {"lengths has 12 numbers: must be 18", [](CompactParts& p) { p.steps.setOnes(3); }},
      {"lengths: column 1 of block 0 has -1 + 1 + 1 eights",
       [](CompactParts& p) { p.lengths[3] = -1; }},
      {"lengths: column 1 of block 0 has 0 + -128 + 1 eights",
       [](CompactParts& p) { p.lengths[4] = -128; }},
      {"lengths: column 0 of block 0 has 1 + 1 + 2 eights of coefficients, the block 21 directions",
       [](CompactParts& p) { p.lengths[2] = 2; }},
      {"lengths: column 1 of block 1 has 0 + 2 + 0 eights of coefficients, the block 1 directions",
       [](CompactParts& p) { p.lengths[10] = 2; }},
      {"longs has 0 numbers: must be 8", [](CompactParts& p) { p.longs.resize(0); }},
      {"words has 0 numbers: must be 16", [](CompactParts& p) { p.words.resize(0); }},
      {"bytes has 23 numbers: must be 24", [](CompactParts& p) { p.bytes.conservativeResize(23); }},
  };
  for (const Misfit& misfit : cases) {
    CompactParts parts = example();
    misfit.make(parts);
    EXPECT_THAT(sentence_of(CompactColumns::from_parts(parts)), HasSubstr(misfit.message));
  }
}

TEST(CompactColumns, MoreBlocksThanNodesAreRefused) {
  CompactParts parts = example();
  parts.blocks.setZero(3, 1000);
  parts.lengths.setZero(6000);
  parts.blocks.row(0).setConstant(CompactColumns::kBlockNodes);
  EXPECT_THAT(sentence_of(CompactColumns::from_parts(parts)), HasSubstr("order has 8 numbers"));
}

}  // namespace
}  // namespace brainshift
