// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/contour_file.hpp"

#include <gmock/gmock.h>

#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using test_support::TemporaryFolder;
using testing::HasSubstr;

std::string contour_refusal(const std::string& name, const std::string& text) {
  const TemporaryFolder folder;
  const auto path = folder.write(name, text);
  const auto contours = read_contours(path, true);
  if (contours) return {};
  EXPECT_THAT(contours.error().message, testing::StartsWith(path.string() + ": "));
  return contours.error().message;
}

TEST(ContourFile, CsvGroupsRowsByFrame) {
  const TemporaryFolder folder;
  const auto contours = read_contours(
      folder.write(
          "c.csv",
          "frame,u_px,v_px\n# traced by hand\n3, 1.5, 2\n3,4,5 # corner\n3,6,-7\r\n\n8,1,1\n"),
      false);
  ASSERT_TRUE(contours) << contours.error().message;
  ASSERT_EQ(contours->size(), 2U);
  EXPECT_EQ((*contours)[0].frame, 3);
  EXPECT_FALSE((*contours)[0].closed);
  Eigen::Matrix2Xd expected(2, 3);
  expected << 1.5, 4, 6, 2, 5, -7;
  EXPECT_EQ((*contours)[0].points_px, expected);
  EXPECT_EQ((*contours)[1].frame, 8);
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
  EXPECT_THAT(contour_refusal("c.csv", "frame,u_px,v_px\n1,2,x\n"), HasSubstr("line 2: \"1,2,x\""));
  EXPECT_THAT(contour_refusal("c.csv", "1,2\n"), HasSubstr("line 1: \"1,2\""));
  EXPECT_THAT(contour_refusal("c.csv", "1,2,3,4\n"), HasSubstr("line 1"));
  EXPECT_THAT(contour_refusal("c.csv", "-1,2,3\n"), HasSubstr("line 1: \"-1,2,3\""));
  EXPECT_THAT(contour_refusal("c.csv", "1.5,2,3\n"), HasSubstr("line 1"));
  EXPECT_THAT(contour_refusal("c.csv", "1,nan,3\n"), HasSubstr("line 1"));
  EXPECT_THAT(contour_refusal("c.csv", "1,2,3\n2,2,3\n1,5,5\n"),
              HasSubstr("line 3: frame 1 comes a second time"));
  EXPECT_THAT(contour_refusal("c.csv", "frame,u_px,v_px\n"), HasSubstr("holds no row"));
  EXPECT_THAT(contour_refusal("c.txt", "1,2,3\n"), HasSubstr("must be a .csv or .json"));
}

TEST(ContourFile, NamesContourAndKeyThatAreWrong) {
  EXPECT_THAT(contour_refusal("c.json", "{"), HasSubstr("must be JSON"));
  EXPECT_THAT(contour_refusal("c.json", "[]"), HasSubstr("list \"contours\""));
  EXPECT_THAT(contour_refusal("c.json", R"({"contours": []})"), HasSubstr("holds no contour"));
  EXPECT_THAT(contour_refusal("c.json", R"({"contours": [3]})"),
              HasSubstr("contours[0]: is no object"));
  EXPECT_THAT(contour_refusal("c.json", R"({"contours": [{"frame": -1, "points_px": []}]})"),
              HasSubstr("contours[0]: frame must be"));
  EXPECT_THAT(
      contour_refusal("c.json", R"({"contours": [{"frame": 1, "points_px": [[1, 2], [3]]}]})"),
      HasSubstr("contours[0]: points_px[1] must be [u, v]"));
  EXPECT_THAT(
      contour_refusal("c.json", R"({"contours": [{"frame": 1, "closed": 1, "points_px": []}]})"),
      HasSubstr("closed must be true or false"));
  EXPECT_THAT(contour_refusal("c.json", R"({"contours": [{"frame": 1, "points": []}]})"),
              HasSubstr("key points is unknown"));
  const auto none = read_contours("/nonexistent/c.csv", true);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::kNotFound);
}

TEST(SeedFile, HasASeedPerRow) {
  const TemporaryFolder folder;
  const auto seeds = read_seeds(folder.write("s.csv", "frame,u_px,v_px\n3,10,20\n40,11,21\n"));
  ASSERT_TRUE(seeds);
  ASSERT_EQ(seeds->size(), 2U);
  EXPECT_EQ((*seeds)[1].frame, 40);
  EXPECT_EQ((*seeds)[1].at_px, Eigen::Vector2d(11, 21));
}

}  // namespace
}  // namespace brainshift::io
