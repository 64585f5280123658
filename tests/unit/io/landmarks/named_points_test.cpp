// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/landmarks/pair_file.hpp"

#include <gmock/gmock.h>

namespace brainshift::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

NamedPoints list(std::initializer_list<const char*> names, double shift = 0.0) {
  NamedPoints points;
  for (const char* name : names) {
    points.add(name, Vec3(shift + static_cast<double>(points.points.size()), 0, 0));
  }
  return points;
}

TEST(NamedPoints, PairsAreFoundByNameInWhateverOrder) {
  const auto pairs = pair_by_name(list({"a", "b", "c"}), list({"d", "c", "a"}, 10));
  ASSERT_TRUE(pairs) << pairs.error().message;
  EXPECT_THAT(pairs->names, ElementsAre("a", "c"));
  EXPECT_THAT(pairs->first, ElementsAre(Vec3(0, 0, 0), Vec3(2, 0, 0)));
  EXPECT_THAT(pairs->second, ElementsAre(Vec3(12, 0, 0), Vec3(11, 0, 0)));
  EXPECT_THAT(pairs->left_out, ElementsAre("b", "d"));
}

TEST(NamedPoints, RefusesNamesThatDoNotName) {
  const auto refusal = [](const NamedPoints& first, const NamedPoints& second, ErrorCode code) {
    const auto pairs = pair_by_name(first, second);
    EXPECT_FALSE(pairs);
    if (pairs) return std::string();
    EXPECT_EQ(pairs.error().code, code);
    return pairs.error().message;
  };
  const ErrorCode bad = ErrorCode::kInvalidArgument;
  EXPECT_THAT(refusal(list({"a", "b", "a"}), list({"a"}), bad),
              HasSubstr("the first list has two points called \"a\""));
  EXPECT_THAT(refusal(list({"a"}), list({"b", "b"}), bad), HasSubstr("the second list"));
  EXPECT_THAT(refusal(list({"a"}), list({"a", ""}), bad),
              HasSubstr("point 2 of the second list has no name"));
  EXPECT_THAT(refusal(list({"a"}), list({"A"}), ErrorCode::kEmptySet),
              HasSubstr("no name is in both lists of 1 and 1 points"));
  EXPECT_FALSE(list({"a", ""}).all_named());
  EXPECT_TRUE(list({"a", "b"}).all_named());
}

TEST(NamedPoints, ColumnsKeepTheOrder) {
  const Points columns = columns_of({Vec3(1, 2, 3), Vec3(4, 5, 6)});
  ASSERT_EQ(columns.cols(), 2);
  EXPECT_EQ(Vec3(columns.col(1)), Vec3(4, 5, 6));
}

}  // namespace
}  // namespace brainshift::io
