// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/pose_file.hpp"

#include <gmock/gmock.h>

#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

class PoseFile : public testing::Test {
 protected:
  Result<RigidTransform> read(const std::string& text, const std::string& name = "p.txt") {
    return read_pose(folder_.write(name, text), "T_ras_camera");
  }
  void expect_refusals(std::initializer_list<test_support::BadInput> cases) {
    test_support::expect_refused([this](const std::string& text) { return read(text); }, cases);
  }
  test_support::TemporaryFolder folder_;
};

// 90 degrees about z, then a shift.
constexpr const char* kText =
    "# camera to patient\n0 -1 0 10.5\n1, 0, 0, -20\n\n0\t0 1 +3e1\n0 0 0 1\n";

TEST_F(PoseFile, TextAndYamlAgree) {
  const auto text = value_or_fail(read(kText));
  const auto yaml =
      value_or_fail(read("T_ras_camera: [0, -1, 0, 10.5, 1, 0, 0, -20, 0, 0, 1, 30,\n"
                         "               0, 0, 0, 1]\n",
                         "p.yaml"));
  EXPECT_TRUE(text.isApprox(yaml));
  EXPECT_TRUE((text * Vec3(1, 2, 3)).isApprox(Vec3(8.5, -19, 33)));
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
    const auto pose = read(text);
    ASSERT_TRUE(pose) << text << pose.error().message;
    EXPECT_LT((pose->matrix() - expected).cwiseAbs().maxCoeff(), 1e-12) << text;
  }
}

// kThreeDecimals: rounding to 0.866 and 0.5 leaves R^T R off by 4.4e-5, to 0.87 by 7e-3.
TEST_F(PoseFile, ThreeDecimalsAreMadeOrthonormalAndTwoAreRefused) {
  const auto pose = value_or_fail(read("0.866 -0.5 0 0\n0.5 0.866 0 0\n0 0 1 0\n0 0 0 1\n"));
  EXPECT_LT((pose.linear().transpose() * pose.linear() - Mat3::Identity()).norm(), 1e-14);
  expect_refusals(
      {{"0.87 -0.5 0 0\n0.5 0.87 0 0\n0 0 1 0\n0 0 0 1\n", "R^T R differs from I by 0.0069"}});
}

TEST_F(PoseFile, WhatIsNoRigidMotionIsRefused) {
  expect_refusals({{"2 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1",
                    "p.txt: T_ras_camera is no rigid motion: R^T R differs from I by 3"},
                   {"-1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1", "reflection"},
                   {"1 0 0 0\n0 1 0 0\n0 0 1 0\n5 0 0 1", "its last row is not 0 0 0 1"}});
  for (const char* number : {"nan", "-nan", "inf", "-inf"}) {
    expect_refusals({{std::string("1 0 0 ") + number + "\n0 1 0 0\n0 0 1 0\n0 0 0 1",
                      "T_ras_camera holds a value that is not a finite number"}});
  }
}

TEST_F(PoseFile, WhatIsWrittenIsReadBack) {
  RigidTransform T = RigidTransform::Identity();
  T.linear() = Eigen::AngleAxisd(2.5, Vec3(1, -2, 1).normalized()).toRotationMatrix();
  T.translation() = Vec3(-1e-9, 1234.5678901234567, -0.1);
  const auto path = folder_ / "w.txt";
  ASSERT_TRUE(write_pose(path, "T_ras_reference", T, {"a comment: 1 2 3", "another"}));
  const auto read = value_or_fail(read_pose(path, "T_ras_reference", 1e-12));
  EXPECT_LT((read.matrix() - T.matrix()).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_EQ(read.translation(), T.translation());
  EXPECT_EQ(write_pose(folder_ / "none" / "w.txt", "T", T).error().code, ErrorCode::kWriteFailed);
}

TEST_F(PoseFile, OtherTextsAreRefused) {
  expect_refusals(
      {{"1 0 0\n0 1 0\n0 0 1\n", "p.txt: T_ras_camera has 9 numbers: must have 16"},
       {"", "has 0 numbers"},
       {"# nothing", "has 0 numbers"},
       {"1 0 0 0\n0 one 0 0\n", "\"one\" is no number"},
       {"1 0 0 0\n0 1.0mm 0 0\n", "\"1.0mm\" is no number"},
       {"T_camera_ras: [1]\n", "\"T_camera_ras:\" is no number of a 4 x 4 matrix T_ras_camera"},
       {"T_ras_camera: [1, 2]\n", "has 2 numbers"}});
  EXPECT_EQ(read_pose(folder_ / "absent.txt", "T").error().code, ErrorCode::kNotFound);
}

TEST_F(PoseFile, TheCallerSaysHowRigidAPoseMustBe) {
  const auto path = folder_.write("t.txt", "0.866 -0.5 0 1  0.5 0.866 0 2  0 0 1 3  0 0 0 1");
  EXPECT_TRUE(read_pose(path, "T_ras_reference"));
  refusal_of(read_pose(path, "T_ras_camera", 1e-5));
}

}  // namespace
}  // namespace brainshift::io
