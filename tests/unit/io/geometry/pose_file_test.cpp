// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/pose_file.hpp"

#include <gmock/gmock.h>

#include <fstream>

#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using testing::HasSubstr;

class PoseFile : public testing::Test {
 protected:
  Result<RigidTransform> read(const std::string& name, const std::string& text) {
    std::ofstream(temporary_.path() / name) << text;
    return read_pose(temporary_.path() / name, "T_ras_camera");
  }
  std::string refusal(const std::string& name, const std::string& text) {
    const auto pose = read(name, text);
    return pose ? "no refusal" : pose.error().message;
  }
  test_support::TemporaryFolder temporary_;
};

// 90 degrees about z, then a shift.
constexpr const char* kText =
    "# camera to patient\n0 -1 0 10.5\n1, 0, 0, -20\n\n0\t0 1 +3e1\n0 0 0 1\n";

TEST_F(PoseFile, TextAndYamlAgree) {
  const auto text = read("p.txt", kText);
  const auto yaml = read("p.yaml",
                         "T_ras_camera: [0, -1, 0, 10.5, 1, 0, 0, -20, 0, 0, 1, 30,\n"
                         "               0, 0, 0, 1]\n");
  ASSERT_TRUE(text) << text.error().message;
  ASSERT_TRUE(yaml) << yaml.error().message;
  EXPECT_TRUE(text->isApprox(*yaml));
  EXPECT_TRUE((*text * Vec3(1, 2, 3)).isApprox(Vec3(8.5, -19, 33)));
}

TEST_F(PoseFile, TakesTextJsonAndYaml) {
  Eigen::Matrix4d expected;
  expected << 0, -1, 0, 10.5, 1, 0, 0, -20, 0, 0, 1, 0.5, 0, 0, 0, 1;
  for (const char* text :
       {"0 -1 0 10.5\n1 0 0 -20\n0 0 1 .5\n0 0 0 1\n",
        R"({"T_ras_camera": [[0, -1, 0, 10.5], [1, 0, 0, -2e1], [0,0,1,0.5], [0,0,0,1]]})",
        "T_ras_camera: [0, -1, 0, 10.5, 1, 0, 0, -20, 0, 0, 1, 0.5, 0, 0, 0, 1]\n",
        "T_ras_camera:\n  - [0, -1, 0, 10.5]\n  - [1, 0, 0, -20]\n  - [0, 0, 1, 0.5]\n"
        "  # the last row\n  - [0, 0, 0, 1]"}) {
    const auto pose = read("r", text);
    ASSERT_TRUE(pose) << text << pose.error().message;
    EXPECT_LT((pose->matrix() - expected).cwiseAbs().maxCoeff(), 1e-12) << text;
  }
}

// kThreeDecimals: rounding to 0.866 and 0.5 leaves R^T R off by 4.4e-5, to 0.87 by 7e-3.
TEST_F(PoseFile, ThreeDecimalsAreMadeOrthonormalAndTwoAreRefused) {
  const auto pose = read("p.txt", "0.866 -0.5 0 0\n0.5 0.866 0 0\n0 0 1 0\n0 0 0 1\n");
  ASSERT_TRUE(pose) << pose.error().message;
  EXPECT_LT((pose->linear().transpose() * pose->linear() - Mat3::Identity()).norm(), 1e-14);
  EXPECT_THAT(refusal("p.txt", "0.87 -0.5 0 0\n0.5 0.87 0 0\n0 0 1 0\n0 0 0 1\n"),
              HasSubstr("R^T R differs from I by 0.0069"));
}

TEST_F(PoseFile, WhatIsNoRigidMotionIsRefused) {
  EXPECT_THAT(refusal("p.txt", "2 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1"),
              HasSubstr("p.txt: T_ras_camera is no rigid motion: R^T R differs from I by 3"));
  EXPECT_THAT(refusal("p.txt", "-1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1"), HasSubstr("reflection"));
  EXPECT_THAT(refusal("p.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n5 0 0 1"),
              HasSubstr("its last row is not 0 0 0 1"));
  for (const char* number : {"nan", "-nan", "inf", "-inf"}) {
    EXPECT_THAT(refusal("p.txt", std::string("1 0 0 ") + number + "\n0 1 0 0\n0 0 1 0\n0 0 0 1"),
                HasSubstr("T_ras_camera holds a value that is not a finite number"))
        << number;
  }
}

TEST_F(PoseFile, WhatIsWrittenIsReadBack) {
  RigidTransform T = RigidTransform::Identity();
  T.linear() = Eigen::AngleAxisd(2.5, Vec3(1, -2, 1).normalized()).toRotationMatrix();
  T.translation() = Vec3(-1e-9, 1234.5678901234567, -0.1);
  const auto path = temporary_.path() / "w.txt";
  ASSERT_TRUE(write_pose(path, "T_ras_reference", T, {"a comment: 1 2 3", "another"}));
  const auto read = read_pose(path, "T_ras_reference", 1e-12);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_LT((read->matrix() - T.matrix()).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_EQ(read->translation(), T.translation());
  EXPECT_EQ(write_pose(temporary_.path() / "none" / "w.txt", "T", T).error().code,
            ErrorCode::kWriteFailed);
}

TEST_F(PoseFile, OtherTextsAreRefused) {
  EXPECT_THAT(refusal("p.txt", "1 0 0\n0 1 0\n0 0 1\n"),
              HasSubstr("p.txt: T_ras_camera has 9 numbers: must have 16"));
  EXPECT_THAT(refusal("p.txt", ""), HasSubstr("has 0 numbers"));
  EXPECT_THAT(refusal("p.txt", "# nothing"), HasSubstr("has 0 numbers"));
  EXPECT_THAT(refusal("p.txt", "1 0 0 0\n0 one 0 0\n"), HasSubstr("\"one\" is no number"));
  EXPECT_THAT(refusal("p.txt", "1 0 0 0\n0 1.0mm 0 0\n"), HasSubstr("\"1.0mm\" is no number"));
  EXPECT_THAT(refusal("p.yaml", "T_camera_ras: [1]\n"),
              HasSubstr("\"T_camera_ras:\" is no number of a 4 x 4 matrix T_ras_camera"));
  EXPECT_THAT(refusal("p.yml", "T_ras_camera: [1, 2]\n"), HasSubstr("has 2 numbers"));
  EXPECT_EQ(read_pose(temporary_.path() / "absent.txt", "T").error().code, ErrorCode::kNotFound);
}

TEST_F(PoseFile, TheCallerSaysHowRigidAPoseMustBe) {
  std::ofstream(temporary_.path() / "t.txt") << "0.866 -0.5 0 1  0.5 0.866 0 2  0 0 1 3  0 0 0 1";
  EXPECT_TRUE(read_pose(temporary_.path() / "t.txt", "T_ras_reference"));
  const auto strict = read_pose(temporary_.path() / "t.txt", "T_ras_camera", 1e-5);
  ASSERT_FALSE(strict);
  EXPECT_EQ(strict.error().code, ErrorCode::kUnreadable);
}

}  // namespace
}  // namespace brainshift::io
