// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include "common/io/recording/contour_file.hpp"
#include "common/io/recording/fiducial_file.hpp"
#include "common/io/recording/registration_file.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::client {
namespace {

using test_support::TemporaryFolder;
using testing::HasSubstr;

std::string contour_refusal(const std::string& name, const std::string& text) {
  const TemporaryFolder folder;
  const auto path = folder.write(name, text);
  const auto contours = io::read_contours(path, true);
  if (contours) return {};
  EXPECT_THAT(contours.error().message, testing::StartsWith(path.string() + ": "));
  return contours.error().message;
}

TEST(ContourFile, CsvGroupsRowsByFrame) {
  const TemporaryFolder folder;
  const auto contours = io::read_contours(
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
  const auto contours = io::read_contours(
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
  const auto none = io::read_contours("/nonexistent/c.csv", true);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::kNotFound);
}

TEST(SeedFile, HasASeedPerRow) {
  const TemporaryFolder folder;
  const auto seeds = io::read_seeds(folder.write("s.csv", "frame,u_px,v_px\n3,10,20\n40,11,21\n"));
  ASSERT_TRUE(seeds);
  ASSERT_EQ(seeds->size(), 2U);
  EXPECT_EQ((*seeds)[1].frame, 40);
  EXPECT_EQ((*seeds)[1].at_px, Eigen::Vector2d(11, 21));
}

TEST(RegistrationFile, TakesTextJsonAndYaml) {
  const TemporaryFolder folder;
  Eigen::Matrix4d expected;
  expected << 0, -1, 0, 10.5, 1, 0, 0, -20, 0, 0, 1, 0.5, 0, 0, 0, 1;
  for (const char* text :
       {"0 -1 0 10.5\n1 0 0 -20\n0 0 1 .5\n0 0 0 1\n",
        R"({"T_ras_reference": [[0, -1, 0, 10.5], [1, 0, 0, -2e1], [0,0,1,0.5], [0,0,0,1]]})",
        "T_ras_reference: [0, -1, 0, 10.5, 1, 0, 0, -20, 0, 0, 1, 0.5, 0, 0, 0, 1]\n",
        "T_ras_reference:\n  - [0, -1, 0, 10.5]\n  - [1, 0, 0, -20]\n  - [0, 0, 1, 0.5]\n  - [0, "
        "0, 0, 1]\n"}) {
    const auto T = io::read_registration(folder.write("r", text));
    ASSERT_TRUE(T) << text << T.error().message;
    EXPECT_LT((T->matrix() - expected).cwiseAbs().maxCoeff(), 1e-12) << text;
  }
}

TEST(RegistrationFile, NamesWhatIsWrong) {
  const TemporaryFolder folder;
  for (const auto& [text, says] :
       {std::pair{"1 0 0", "holds 3 numbers: T_ras_reference has 16"},
        std::pair{"", "holds 0 numbers"},
        std::pair{"T_ras_tracker: 1 0", "\"T_ras_tracker:\" is no number"},
        std::pair{"1000 0 0 0 0 1000 0 0 0 0 1000 0 0 0 0 1", "no rigid motion"},
        std::pair{"1 0 0 nan 0 1 0 0 0 0 1 0 0 0 0 1", "finite"},
        std::pair{"1 0 0 0 0 1 0 0 0 0 -1 0 0 0 0 1", "reflection"}}) {
    const auto T = io::read_registration(folder.write("r.txt", text));
    ASSERT_FALSE(T) << text;
    EXPECT_THAT(T.error().message, testing::AllOf(HasSubstr("r.txt: "), HasSubstr(says)));
  }
  EXPECT_EQ(io::read_registration("/nonexistent").error().code, ErrorCode::kNotFound);
}

std::string fiducial_refusal(const std::string& text) {
  const TemporaryFolder folder;
  const auto path = folder.write("f.csv", text);
  const auto file = io::read_fiducials(path);
  if (file) return {};
  EXPECT_THAT(file.error().message, testing::StartsWith(path.string() + ": "));
  return file.error().message;
}

// Turned by 90 degrees about z and moved by (10, 20, 30); distances between them all differ.
constexpr const char* kPairs =
    "x,y,z,R,A,S\n0,0,0,10,20,30\n50,0,0,10,70,30\n0,80,0,-70,20,30  # behind the ear\n"
    "10,20,60,-10,30,90\n";

TEST(io::FiducialFile, PairsAreFitted) {
  const TemporaryFolder folder;
  const auto file = io::read_fiducials(folder.write("f.csv", kPairs));
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_FALSE(file->matched);
  EXPECT_LT(file->fit.fre_mm, 1e-9);
  EXPECT_LT((file->fit.T_image_measured * Vec3(1, 0, 0) - Vec3(10, 21, 30)).norm(), 1e-9);
}

TEST(io::FiducialFile, TheOrderOfUnpairedPointsIsFound) {
  const TemporaryFolder folder;
  const auto file = io::read_fiducials(
      folder.write("f.csv",
                   "ras,-10,30,90\nreference,0,0,0\nreference,50,0,0\nras,-70,20,30\nras,10,70,30\n"
                   "reference,0,80,0\nreference,10,20,60\nras,10,20,30\n"));
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_TRUE(file->matched);
  EXPECT_LT((file->fit.T_image_measured * Vec3(1, 0, 0) - Vec3(10, 21, 30)).norm(), 1e-9);
}

TEST(io::FiducialFile, NamesWhatIsWrong) {
  EXPECT_THAT(fiducial_refusal("a,b,c,d,e,f\n1,2,3,4,5\n"), HasSubstr("line 2: \"1,2,3,4,5\""));
  EXPECT_THAT(fiducial_refusal("1,2,3,4,5,6\nras,1,2,3\n"), HasSubstr("line 2"));
  EXPECT_THAT(fiducial_refusal("1,2,3,4,5,6\ntracker,1,2,3\n"), HasSubstr("line 2"));
  EXPECT_THAT(fiducial_refusal("1,2,3,nan,5,6\n1,2,3,nan,5,6\n"), HasSubstr("line 1"));
  EXPECT_THAT(fiducial_refusal(""), HasSubstr("3"));
  std::string metres = "0,0,0,10,20,30\n0.05,0,0,10,70,30\n0,0.08,0,-70,20,30\n";
  EXPECT_THAT(fiducial_refusal(metres), HasSubstr("metres"));
  EXPECT_EQ(io::read_fiducials("/nonexistent").error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace brainshift::client
