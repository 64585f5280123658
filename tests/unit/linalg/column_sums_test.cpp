// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/linalg/column_sums.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "common/core/random.hpp"
#include "common/core/types.hpp"

namespace brainshift::linalg {
namespace {

template <typename T>
using Matrix = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic>;
template <typename T>
using Vector = Eigen::Matrix<T, Eigen::Dynamic, 1>;

constexpr int kRows = 53;

template <typename T>
struct Columns {
  explicit Columns(int count) : matrix(kRows, count), factors(count), start(kRows) {
    Random random(2);
    for (T& value : matrix.reshaped()) value = static_cast<T>(random.normal());
    for (T& value : factors) value = static_cast<T>(random.normal());
    for (T& value : start) value = static_cast<T>(random.normal());
    for (int j = 0; j < count; ++j) pointers.push_back(matrix.col(j).data());
  }
  Vector<T> sum(int first, int rows) const {
    Vector<T> out = start.segment(first, rows);
    add_columns(pointers.data(), factors.data(), pointers.size(), first, rows, out.data());
    return out;
  }
  Matrix<T> matrix;
  Vector<T> factors, start;
  std::vector<const T*> pointers;
};

template <typename T>
class AddColumns : public testing::Test {};
using Numbers = testing::Types<float, double>;
TYPED_TEST_SUITE(AddColumns, Numbers);

TYPED_TEST(AddColumns, IsTheProductWithinTheBoundOfItsRounding) {
  const double unit = std::is_same_v<TypeParam, float> ? 0x1p-24 : 0x1p-53;
  for (const int count : {0, 1, 7, 8, 9, 16, 37}) {
    const Columns<TypeParam> columns(count);
    const Eigen::MatrixXd matrix = columns.matrix.template cast<double>();
    const VecX factors = columns.factors.template cast<double>();
    const VecX start = columns.start.template cast<double>();
    const VecX expected = start + matrix * factors;
    const VecX terms = start.cwiseAbs() + matrix.cwiseAbs() * factors.cwiseAbs();
    const VecX found = columns.sum(0, kRows).template cast<double>();
    for (int i = 0; i < kRows; ++i) {
      EXPECT_LE(std::abs(found[i] - expected[i]), (count + 2) * unit * terms[i]) << count;
    }
  }
}

TYPED_TEST(AddColumns, OfARowIsTheSameInEveryPartOfTheRows) {
  const Columns<TypeParam> columns(37);
  const Vector<TypeParam> all = columns.sum(0, kRows);
  for (const int first : {1, 3, 8, 20}) {
    for (const int rows : {1, 2, 5, 13, 32}) {
      EXPECT_EQ(columns.sum(first, rows), all.segment(first, rows)) << first << ' ' << rows;
    }
  }
}

}  // namespace
}  // namespace brainshift::linalg
