// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/fiducial_file.hpp"

#include <gmock/gmock.h>

#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using test_support::TemporaryFolder;
using testing::HasSubstr;

std::string fiducial_refusal(const std::string& text) {
  const TemporaryFolder folder;
  const auto path = folder.write("f.csv", text);
  const auto file = read_fiducials(path);
  if (file) return {};
  EXPECT_THAT(file.error().message, testing::StartsWith(path.string() + ": "));
  return file.error().message;
}

// Turned by 90 degrees about z and moved by (10, 20, 30); distances between them all differ.
constexpr const char* kPairs =
    "x,y,z,R,A,S\n0,0,0,10,20,30\n50,0,0,10,70,30\n0,80,0,-70,20,30  # behind the ear\n"
    "10,20,60,-10,30,90\n";

TEST(FiducialFile, PairsAreFitted) {
  const TemporaryFolder folder;
  const auto file = value_or_fail(read_fiducials(folder.write("f.csv", kPairs)));
  EXPECT_FALSE(file.matched);
  EXPECT_LT(file.fit.fre_mm, 1e-9);
  EXPECT_LT((file.fit.T_image_measured * Vec3(1, 0, 0) - Vec3(10, 21, 30)).norm(), 1e-9);
}

TEST(FiducialFile, TheOrderOfUnpairedPointsIsFound) {
  const TemporaryFolder folder;
  const auto file = value_or_fail(read_fiducials(
      folder.write("f.csv",
                   "ras,-10,30,90\nreference,0,0,0\nreference,50,0,0\nras,-70,20,30\nras,10,70,30\n"
                   "reference,0,80,0\nreference,10,20,60\nras,10,20,30\n")));
  EXPECT_TRUE(file.matched);
  EXPECT_LT((file.fit.T_image_measured * Vec3(1, 0, 0) - Vec3(10, 21, 30)).norm(), 1e-9);
}

TEST(FiducialFile, AHeadingOrdersTheColumns) {
  const TemporaryFolder folder;
  for (const char* text :
       {"x_ras,y_ras,z_ras,x_ref,y_ref,z_ref\n10,20,30,0,0,0\n10,70,30,50,0,0\n-70,20,30,0,80,0\n",
        "name,L,P,S,touched x,touched y,touched z,defined\na,-10,-20,30,0,0,0,1\n"
        "b,-10,-70,30,50,0,0,1\nlost,0,0,0,0,0,0,0\nc,70,-20,30,0,80,0,1\n",
        "z,y,x,List\n0,0,0,reference\n0,0,50,reference\n0,80,0,reference\n30,20,10,ras\n"
        "30,70,10,ras\n30,20,-70,ras\n"}) {
    const auto file = value_or_fail(read_fiducials(folder.write("f.csv", text)));
    EXPECT_LT((file.fit.T_image_measured * Vec3(1, 0, 0) - Vec3(10, 21, 30)).norm(), 1e-6) << text;
  }
}

TEST(FiducialFile, NamesWhatIsWrong) {
  EXPECT_THAT(fiducial_refusal("a,b,c,d,e,f\n1,2,3,4,5\n"),
              HasSubstr("line 1: \"a,b,c,d,e,f\" must name the columns x_ref"));
  EXPECT_THAT(fiducial_refusal("1,2,3,4,5\n"), HasSubstr("line 1: \"1,2,3,4,5\""));
  EXPECT_THAT(fiducial_refusal("1,2,3,4,5,6\nras,1,2,3\n"), HasSubstr("line 2"));
  EXPECT_THAT(fiducial_refusal("1,2,3,4,5,6\ntracker,1,2,3\n"), HasSubstr("line 2"));
  EXPECT_THAT(fiducial_refusal("1,2,3,nan,5,6\n1,2,3,nan,5,6\n"), HasSubstr("line 1"));
  EXPECT_THAT(fiducial_refusal(""), HasSubstr("3"));
  std::string metres = "0,0,0,10,20,30\n0.05,0,0,10,70,30\n0,0.08,0,-70,20,30\n";
  EXPECT_THAT(fiducial_refusal(metres), HasSubstr("metres"));
  EXPECT_EQ(read_fiducials("/nonexistent").error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace brainshift::io
