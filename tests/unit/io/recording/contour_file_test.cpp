// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/contour_file.hpp"

#include <gmock/gmock.h>

#include "tests/support/refusals.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using test_support::expect_refused;
using test_support::TemporaryFolder;

// read_contours of a file of this name; an error begins with its path.
auto reading_contours(const std::string& name) {
  return [name](const std::string& content) {
    const TemporaryFolder folder;
    const auto path = folder.write(name, content);
    auto read = read_contours(path, true);
    if (!read) {
      EXPECT_THAT(read.error().message, testing::StartsWith(path.string() + ": "));
    }
    return read;
  };
}

TEST(ContourFile, CsvGroupsRowsByFrame) {
  const TemporaryFolder folder;
  const auto contours = value_or_fail(read_contours(
      folder.write(
          "c.csv",
          "frame,u_px,v_px\n# traced by hand\n3, 1.5, 2\n3,4,5 # corner\n3,6,-7\r\n\n8,1,1\n"),
      false));
  ASSERT_EQ(contours.size(), 2U);
  EXPECT_EQ(contours[0].frame, 3);
  EXPECT_FALSE(contours[0].closed);
  Eigen::Matrix2Xd expected(2, 3);
  expected << 1.5, 4, 6, 2, 5, -7;
  EXPECT_EQ(contours[0].points_px, expected);
  EXPECT_EQ(contours[1].frame, 8);
}

TEST(ContourFile, AHeadingOrdersTheColumns) {
  const TemporaryFolder folder;
  for (const char* text : {"\xEF\xBB\xBFv_px,frame,u_px\n2,3,1.5\n", "y,Image,x,note\n2,3,1.5,a\n",
                           "# v_px,frame,u_px\n2,3,1.5\n"}) {
    const auto contours = value_or_fail(read_contours(folder.write("c.csv", text), false));
    EXPECT_EQ(contours[0].frame, 3) << text;
    EXPECT_EQ(contours[0].points_px.col(0), Eigen::Vector2d(1.5, 2)) << text;
    EXPECT_EQ(value_or_fail(read_seeds(folder.write("s.csv", text)))[0].frame, 3);
  }
}

TEST(ContourFile, JsonSaysWhetherEachContourIsClosed) {
  const TemporaryFolder folder;
  const auto contours = read_contours(
      folder.write("c.json",
                   R"({"contours": [{"frame": 2, "closed": false, "points_px": [[1, 2], [3.5, 4]]},
                                              {"frame": 2, "points_px": [[1, 2], [3, 4], [5, 9]]}]})"),
      false);
  ASSERT_TRUE(contours) << contours.error().message;
  ASSERT_EQ(contours->size(), 2U);
  EXPECT_FALSE((*contours)[0].closed);
  EXPECT_TRUE((*contours)[1].closed);
  EXPECT_EQ((*contours)[0].points_px(0, 1), 3.5);
}

TEST(ContourFile, NamesLineAndValueThatAreWrong) {
  expect_refused(reading_contours("c.csv"),
                 {{"frame,u_px,v_px\n1,2,x\n", "line 2: \"1,2,x\""},
                  {"1,2\n", "line 1: \"1,2\""},
                  {"a,b,c\n1,2,3\n", "line 1: \"a,b,c\" must name the columns frame"},
                  {"frame,u_mm,v_mm\n1,2,3\n", "must name the columns"},
                  {"frame,x,u,v\n1,2,3,4\n", "each once"},
                  {"1,2,3,4\n", "line 1"},
                  {"-1,2,3\n", "line 1: \"-1,2,3\""},
                  {"1.5,2,3\n", "line 1"},
                  {"1,nan,3\n", "line 1"},
                  {"1,2,3\n2,2,3\n1,5,5\n", "line 3: frame 1 comes a second time"}});
  expect_refused(reading_contours("c.csv"), {{"frame,u_px,v_px\n", "holds no row"}},
                 ErrorCode::kEmptySet);
  expect_refused(reading_contours("c.txt"), {{"1,2,3\n", "must be a .csv or .json"}});
}

TEST(ContourFile, NamesContourAndKeyThatAreWrong) {
  expect_refused(
      reading_contours("c.json"),
      {{"{", "must be JSON"},
       {"[]", "list \"contours\""},
       {R"({"contours": [3]})", "contours[0]: is no object"},
       {R"({"contours": [{"frame": -1, "points_px": []}]})", "contours[0]: frame must be"},
       {R"({"contours": [{"frame": 1, "points_px": [[1, 2], [3]]}]})",
        "contours[0]: points_px[1] must be [u, v]"},
       {R"({"contours": [{"frame": 1, "closed": 1, "points_px": []}]})",
        "closed must be true or false"},
       {R"({"contours": [{"frame": 1, "points": []}]})", "key points is unknown"}});
  expect_refused(reading_contours("c.json"), {{R"({"contours": []})", "holds no contour"}},
                 ErrorCode::kEmptySet);
  refusal_of(read_contours("/nonexistent/c.csv", true), ErrorCode::kNotFound);
}

TEST(SeedFile, HasASeedPerRow) {
  const TemporaryFolder folder;
  const auto seeds =
      value_or_fail(read_seeds(folder.write("s.csv", "frame,u_px,v_px\n3,10,20\n40,11,21\n")));
  ASSERT_EQ(seeds.size(), 2U);
  EXPECT_EQ(seeds[1].frame, 40);
  EXPECT_EQ(seeds[1].at_px, Eigen::Vector2d(11, 21));
}

}  // namespace
}  // namespace brainshift::io
