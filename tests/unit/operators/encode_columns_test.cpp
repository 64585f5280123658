// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <algorithm>
#include <limits>
#include <numeric>

#include "common/core/random.hpp"
#include "common/operators/encode_columns.hpp"
#include "tests/support/results.hpp"

namespace brainshift {
namespace {

Points scattered_points(int n) {
  Random random(5);
  Points points(3, n);
  for (double& x : points.reshaped()) x = 100.0 * random.uniform();
  return points;
}

double extent_mm(const Points& points, std::span<const int> block) {
  Vec3 low = points.col(block.front()), high = low;
  for (const int i : block) {
    low = low.cwiseMin(points.col(i));
    high = high.cwiseMax(points.col(i));
  }
  return (high - low).maxCoeff();
}

TEST(SpatialBlocks, HoldEveryPointOnceInBlocksOfAboutTheSameSize) {
  for (const int n : {0, 1, 2, 63, 64, 65, 129, 1000}) {
    const SpatialBlocks blocks = spatial_blocks(scattered_points(n), 64);
    EXPECT_EQ(blocks.size(), (n + 63) / 64);
    std::vector<int> all;
    for (int b = 0; b < blocks.size(); ++b) {
      EXPECT_LE(blocks.block(b).size(), 64u);
      EXPECT_GE(2 * blocks.block(b).size() + 2, static_cast<std::size_t>(std::min(n, 64)));
      all.insert(all.end(), blocks.block(b).begin(), blocks.block(b).end());
    }
    EXPECT_EQ(all, blocks.order);
    std::sort(all.begin(), all.end());
    std::vector<int> expected(static_cast<std::size_t>(n));
    std::iota(expected.begin(), expected.end(), 0);
    EXPECT_EQ(all, expected);
  }
}

TEST(SpatialBlocks, AreOfNeighbours) {
  const Points points = scattered_points(4096);  // 64 blocks: a cube of 100 in parts of 25 at best
  const SpatialBlocks blocks = spatial_blocks(points, 64);
  for (int b = 0; b < blocks.size(); ++b) EXPECT_LT(extent_mm(points, blocks.block(b)), 35.0);
}

TEST(SpatialBlocks, OfPointsInOnePlaceAreStillOfTheSizeAskedFor) {
  const SpatialBlocks blocks = spatial_blocks(Points::Ones(3, 10), 4);
  EXPECT_EQ(blocks.first, (std::vector<int>{0, 3, 6, 10}));
  EXPECT_EQ(spatial_blocks(Points::Ones(3, 3), 1).order.size(), 3u);
}

using Eigen::MatrixXf;

constexpr float kStep = 1.0F / 262144;  // of the greatest number

Points scattered(int n, Random& random) {
  Points nodes(3, n);
  for (int i = 0; i < n; ++i) nodes.col(i) = 80.0 * random.uniform() * random.direction();
  return nodes;
}

// Columns as point forces make them: a peak at a node and a long tail.
MatrixXf peaks(const Points& nodes, int columns, Random& random) {
  MatrixXf fields(nodes.size(), columns);
  for (int j = 0; j < columns; ++j) {
    const Vec3 source = 80.0 * random.direction(), force = random.direction();
    for (Eigen::Index i = 0; i < nodes.cols(); ++i) {
      const Vec3 d = nodes.col(i) - source;
      const double r = std::sqrt(d.squaredNorm() + 4.0);
      const Vec3 u = 40.0 * (force / r + d * d.dot(force) / (r * r * r));
      fields.col(j).segment<3>(3 * i) = u.cast<float>();
    }
  }
  return fields;
}

MatrixXf noise(Eigen::Index rows, int columns, float size, Random& random) {
  MatrixXf fields(rows, columns);
  for (float& value : fields.reshaped()) value = size * static_cast<float>(random.normal());
  return fields;
}

std::vector<NodeIndex> all_nodes(const CompactColumns& columns) {
  std::vector<NodeIndex> all(static_cast<std::size_t>(columns.num_nodes()));
  std::iota(all.begin(), all.end(), 0);
  return all;
}

CompactColumns encoded(const Points& nodes, const std::vector<const MatrixXf*>& groups,
                       int threads = 1, float step = kStep) {
  ThreadTeam team(threads);
  std::vector<ColumnGroup> given;
  for (const MatrixXf* group : groups) given.push_back(group_of(*group, step));
  return value_or_fail(encode_columns(node_blocks(nodes), given, team));
}

MatrixXf decoded(const CompactColumns& columns) {
  ThreadTeam team(2);
  return decode_rows(columns, all_nodes(columns), column_range(0, columns.num_columns()), team);
}

// Greatest difference in steps of its column. Decoding rounds too, in single precision.
double error_in_steps(const MatrixXf& given, const CompactColumns& columns, int first) {
  const MatrixXf found = decoded(columns).middleCols(first, given.cols());
  double worst = 0.0;
  for (Eigen::Index j = 0; j < given.cols() && given.rows() > 0; ++j) {
    const VecX apart = found.col(j).cast<double>() - given.col(j).cast<double>();
    const double step = columns.parts().steps[first + j];
    worst = std::max(worst, apart.cwiseAbs().maxCoeff() / step);
  }
  return worst;
}

TEST(EncodeColumns, EveryNumberIsWithinTheStatedErrorForEveryShape) {
  Random random(1);
  for (const int n : {0, 1, 2, 7, 127, 128, 129, 300, 641}) {
    const Points nodes = scattered(n, random);
    for (const int columns : {0, 1, 5, 33}) {
      const MatrixXf smooth = peaks(nodes, columns, random);
      const MatrixXf rough = noise(3 * n, 3, 1e-3F, random);
      const CompactColumns made = encoded(nodes, {&smooth, &rough});
      ASSERT_EQ(made.num_nodes(), n);
      ASSERT_EQ(made.num_columns(), columns + 3);
      // Half a step of room for the rounding of single precision.
      EXPECT_LT(error_in_steps(smooth, made, 0), kMaxErrorSteps + 0.5) << n << ", " << columns;
      EXPECT_LT(error_in_steps(rough, made, columns), kMaxErrorSteps + 0.5) << n << ", " << columns;
    }
  }
}

// Steps so small that single precision is what limits the sums.
TEST(EncodeColumns, TheFinestStepsAreAsGoodAsSinglePrecision) {
  Random random(13);
  const Points nodes = scattered(300, random);
  const MatrixXf fields = peaks(nodes, 60, random);
  const MatrixXf found = decoded(encoded(nodes, {&fields}, 1, kStep / 256.0F));
  EXPECT_LT((found - fields).cwiseAbs().maxCoeff(), 1e-6F * fields.cwiseAbs().maxCoeff());
}

TEST(EncodeColumns, AStepIsAPartOfTheGreatestNumberOfTheGroup) {
  Random random(2);
  const Points nodes = scattered(50, random);
  const MatrixXf large = noise(150, 4, 100.0F, random), small = noise(150, 6, 1e-6F, random);
  const CompactColumns made = encoded(nodes, {&large, &small});
  for (int j = 0; j < 10; ++j) {
    const float greatest = (j < 4 ? large : small).cwiseAbs().maxCoeff();
    EXPECT_EQ(made.parts().steps[j], greatest * kStep);
  }
}

// Errors of many columns add up as if by chance: the typical error is a third of a step.
TEST(EncodeColumns, SumsAreOffByAboutAThirdOfAStepTimesTheNormOfTheFactors) {
  Random random(3);
  const Points nodes = scattered(700, random);
  const MatrixXf fields = peaks(nodes, 400, random);
  const CompactColumns made = encoded(nodes, {&fields});
  VecX factors(400);
  std::vector<CompactColumns::Term> terms;
  for (int j = 0; j < 400; ++j) {
    factors[j] = static_cast<double>(static_cast<float>(random.normal()));
    terms.push_back({j, static_cast<float>(factors[j])});
  }
  const VecX exact = fields.cast<double>() * factors;
  double squares = 0.0, worst = 0.0;
  for (int b = 0; b < made.num_blocks(); ++b) {
    Eigen::VectorXf out(CompactColumns::kBlockRows);
    made.sum(b, terms, out.data());
    for (std::size_t i = 0; i < made.nodes(b).size(); ++i) {
      const Vec3 error = out.segment<3>(3 * static_cast<Eigen::Index>(i)).cast<double>() -
                         exact.segment<3>(3L * made.nodes(b)[i]);
      squares += error.squaredNorm();
      worst = std::max(worst, error.cwiseAbs().maxCoeff());
    }
  }
  const double unit = made.parts().steps.cast<double>().cwiseProduct(factors).norm();
  const double rms = std::sqrt(squares / static_cast<double>(exact.size()));
  EXPECT_LT(rms, 0.5 * unit);
  EXPECT_GT(rms, 0.1 * unit) << "more bits are kept than the step says";
  EXPECT_LT(worst, 3.0 * unit);
}

// A mesh of a head takes less than half with much finer steps (decision 0028).
TEST(EncodeColumns, SmoothFieldsTakeLessThanHalfOfSinglePrecision) {
  Random random(4);
  const Points nodes = scattered(2000, random);
  const MatrixXf fields = peaks(nodes, 900, random);
  const CompactColumns made = encoded(nodes, {&fields}, 2);
  EXPECT_LT(static_cast<double>(made.bytes()), 2.0 * static_cast<double>(fields.size()));
  EXPECT_LT(error_in_steps(fields, made, 0), kMaxErrorSteps + 0.5);
}

// A column costs little in a block far from where it peaks, and nothing where it rests.
TEST(EncodeColumns, QuietColumnsHaveFewCoefficients) {
  Random random(12);
  Points nodes(3, 256);
  for (int i = 0; i < 256; ++i) {
    nodes.col(i) = random.direction() + Vec3(i < 128 ? 0.0 : 50.0, 0.0, 0.0);
  }
  MatrixXf fields = noise(768, 40, 1.0F, random);
  fields.col(7).tail(384) *= 2e-5F;  // about a step
  fields.col(8).tail(384).setZero();
  const CompactColumns made = encoded(nodes, {&fields});
  ASSERT_EQ(made.num_blocks(), 2);
  const int there = made.place(255).block;
  ASSERT_NE(made.place(0).block, there);
  const auto length = [&](int block, int column) {
    return Eigen::Vector3i(made.parts().lengths.segment<3>(3L * (40 * block + column)).cast<int>());
  };
  EXPECT_GT(length(there, 6).head<2>().sum(), 0);
  EXPECT_EQ(length(there, 7).head<2>().sum(), 0);
  EXPECT_GT(length(there, 7)[2], 0);
  EXPECT_EQ(length(there, 8).sum(), 0);
  EXPECT_GT(length(1 - there, 8).sum(), 0);
  EXPECT_LT(error_in_steps(fields, made, 0), kMaxErrorSteps + 0.5);
}

TEST(EncodeColumns, ZeroesStayZeroes) {
  Random random(5);
  const Points nodes = scattered(200, random);
  const MatrixXf nothing = MatrixXf::Zero(600, 3);
  const CompactColumns made = encoded(nodes, {&nothing});
  EXPECT_TRUE(decoded(made) == nothing);
  EXPECT_EQ(made.parts().basis.size(), 0);
  EXPECT_EQ(made.parts().bytes.size(), 0);
  // A column of zeroes among others.
  MatrixXf some = peaks(nodes, 5, random);
  some.col(2).setZero();
  EXPECT_TRUE((decoded(encoded(nodes, {&some})).col(2).array() == 0.0F).all());
}

TEST(EncodeColumns, TinyNumbersKeepTheErrorOfTheSmallestStep) {
  Random random(6);
  const Points nodes = scattered(20, random);
  const MatrixXf tiny = noise(60, 2, 1e-40F, random);  // below the smallest normal number
  const CompactColumns made = encoded(nodes, {&tiny});
  EXPECT_EQ(made.parts().steps[0], std::numeric_limits<float>::min());
  EXPECT_LT(error_in_steps(tiny, made, 0), kMaxErrorSteps);
}

TEST(EncodeColumns, NumbersThatAreNotFiniteAreRefused) {
  Random random(7);
  const Points nodes = scattered(20, random);
  for (const float bad :
       {std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
        std::numeric_limits<float>::quiet_NaN()}) {
    MatrixXf fields = noise(60, 2, 1.0F, random);
    fields(31, 1) = bad;
    ThreadTeam team(1);
    refusal_of(encode_columns(node_blocks(nodes), {group_of(fields, kStep)}, team),
               ErrorCode::kNotFinite);
  }
}

TEST(EncodeColumns, TheNumberOfThreadsDoesNotChangeABit) {
  Random random(8);
  const Points nodes = scattered(900, random);
  const MatrixXf fields = peaks(nodes, 60, random);
  EXPECT_TRUE(encoded(nodes, {&fields}, 1).parts() == encoded(nodes, {&fields}, 3).parts());
}

TEST(EncodeColumns, DecodedRowsAreThoseOfTheNodesAskedFor) {
  Random random(9);
  const Points nodes = scattered(400, random);
  const MatrixXf fields = peaks(nodes, 12, random);
  const CompactColumns made = encoded(nodes, {&fields});
  const MatrixXf whole = decoded(made);
  ThreadTeam team(2);
  const std::vector<NodeIndex> some = {399, 0, 17, 250};
  const std::vector<int> which = {11, 3};
  const MatrixXf rows = decode_rows(made, some, which, team);
  ASSERT_EQ(rows.rows(), 12);
  ASSERT_EQ(rows.cols(), 2);
  for (std::size_t i = 0; i < some.size(); ++i) {
    for (std::size_t j = 0; j < which.size(); ++j) {
      const auto there = whole.col(which[j]).segment<3>(3L * some[i]);
      const auto here =
          rows.col(static_cast<Eigen::Index>(j)).segment<3>(3 * static_cast<Eigen::Index>(i));
      EXPECT_LT((here - there).norm(), 1e-6F * whole.col(which[j]).cwiseAbs().maxCoeff());
    }
  }
}

TEST(EncodeColumns, SquaredNormsAreThoseOfTheColumns) {
  Random random(10);
  const Points nodes = scattered(400, random);
  const MatrixXf fields = peaks(nodes, 4, random);
  const CompactColumns made = encoded(nodes, {&fields});
  for (int j = 0; j < 4; ++j) {
    const double exact = fields.col(j).cast<double>().squaredNorm();
    EXPECT_NEAR(made.squared_norm(j), exact, 1e-4 * exact);
  }
}

TEST(EncodeColumns, CanBeStopped) {
  Random random(11);
  const Points nodes = scattered(20, random);
  const MatrixXf fields = noise(60, 2, 1.0F, random);
  std::stop_source stop;
  stop.request_stop();
  ThreadTeam team(1);
  refusal_of(
      encode_columns(node_blocks(nodes), {group_of(fields, kStep)}, team, {}, stop.get_token()),
      ErrorCode::kUnavailable);
}

}  // namespace
}  // namespace brainshift
