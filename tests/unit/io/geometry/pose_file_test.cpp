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

TEST_F(PoseFile, FourDecimalsAreMadeOrthonormal) {
  const auto pose = read("p.txt", "0.8660 -0.5 0 0\n0.5 0.8660 0 0\n0 0 1 0\n0 0 0 1\n");
  ASSERT_TRUE(pose) << pose.error().message;
  EXPECT_LT((pose->linear().transpose() * pose->linear() - Mat3::Identity()).norm(), 1e-14);
}

TEST_F(PoseFile, WhatIsNoRigidMotionIsRefused) {
  EXPECT_THAT(refusal("p.txt", "2 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1"),
              HasSubstr("p.txt: T_ras_camera is no rigid motion: R^T R differs from 1 by 3"));
  EXPECT_THAT(refusal("p.txt", "-1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1"), HasSubstr("mirror image"));
  EXPECT_THAT(refusal("p.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n5 0 0 1"),
              HasSubstr("its last row must be 0 0 0 1"));
  EXPECT_THAT(refusal("p.txt", "1 0 0 nan\n0 1 0 0\n0 0 1 0\n0 0 0 1"),
              HasSubstr("T_ras_camera has an entry that is not finite"));
}

TEST_F(PoseFile, OtherTextsAreRefused) {
  EXPECT_THAT(refusal("p.txt", "1 0 0\n0 1 0\n0 0 1\n"),
              HasSubstr("p.txt: T_ras_camera has 9 numbers: must have sixteen"));
  EXPECT_THAT(refusal("p.txt", ""), HasSubstr("has 0 numbers"));
  EXPECT_THAT(refusal("p.txt", "1 0 0 0\n0 one 0 0\n"), HasSubstr("line 2: \"one\" is no number"));
  EXPECT_THAT(refusal("p.yaml", "T_camera_ras: [1]\n"), HasSubstr("T_ras_camera: key is missing"));
  EXPECT_THAT(refusal("p.yml", "T_ras_camera: [1, 2]\n"), HasSubstr("has 2 numbers"));
  EXPECT_EQ(read_pose(temporary_.path() / "absent.txt", "T").error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace brainshift::io
