// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/files/number_text.hpp"

#include <gmock/gmock.h>

#include <cmath>

namespace brainshift::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST(NumberRows, AreReadBetweenAnySeparators) {
  const auto rows = parse_number_rows("1 2\t3\n\n# comment\n// another\n4,5;6\r\n -7.5e1\n+8");
  ASSERT_TRUE(rows) << rows.error().message;
  EXPECT_THAT(*rows, ElementsAre(ElementsAre(1, 2, 3), ElementsAre(4, 5, 6), ElementsAre(-75),
                                 ElementsAre(8)));
  EXPECT_THAT(parse_number_rows("").value(), IsEmpty());
}

TEST(NumberRows, NonFiniteNumbersAreLeftToTheCaller) {
  const auto rows = parse_number_rows("nan inf -inf");
  ASSERT_TRUE(rows) << rows.error().message;
  EXPECT_TRUE(std::isnan((*rows)[0][0]));
  EXPECT_TRUE(std::isinf((*rows)[0][2]));
}

TEST(NumberRows, AnythingElseIsRefusedWithLineAndWord) {
  const auto rows = parse_number_rows("1 2\n# ok\n3 4x\n");
  ASSERT_FALSE(rows);
  EXPECT_EQ(rows.error().code, ErrorCode::kUnreadable);
  EXPECT_THAT(rows.error().message, HasSubstr("line 3: \"4x\" is no number"));
}

}  // namespace
}  // namespace brainshift::io
