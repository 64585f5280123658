// SPDX-License-Identifier: GPL-3.0-or-later
// A virtual probe sees blobs that a virtual MRI has too, darker where they are bright there. The
// first registration is off; the second one must be where the scene was made.
#include "client/tools/import/register_ultrasound.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "client/tools/import/register_picture.hpp"
#include "common/io/fields/field_files.hpp"
#include "common/io/geometry/pose_file.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/virtual_sweep.hpp"
#include "tests/unit/registration/blob_image.hpp"

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;
using registration::test::Blobs;
using test_support::matrix_text;
using test_support::SequenceContent;
using test_support::TemporaryFolder;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

constexpr int kPixels = 40;
constexpr double kPixel_mm = 1.0;

RigidTransform turned(const Vec3& axis, double angle, const Vec3& translation) {
  RigidTransform T = RigidTransform::Identity();
  T.linear() = Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
  T.translation() = translation;
  return T;
}
const RigidTransform kTruth = turned(Vec3(1, 2, -1), 0.8, Vec3(12, -35, 50));  // T_ras_reference
const RigidTransform kCorner = turned(Vec3(-1, 1, 3), 1.1, Vec3(4, -6, 9));    // T_probe_corner

// Two fans of planes through the middle, at right angles.
struct VirtualProbe {
  std::uint64_t seen = 11;  // seed of the blobs that it sees; the MRI has those of 11
  double tilt = 0.5;        // of the outermost planes, rad
  int repeats = 1;
  double noise = 0.15;

  SequenceContent content() const {
    SequenceContent content;
    content.width = content.height = kPixels;
    const Blobs blobs(seen);
    Random random(5);
    for (const bool second : {false, true})
      for (int plane = 0; plane < 8; ++plane)
        for (int again = 0; again < repeats; ++again)
          add(content, blobs, random,
              turned(Vec3::UnitX(), tilt * (plane - 3.5) / 3.5, Vec3::Zero()),
              second && tilt > 0.0 ? turned(Vec3::UnitY(), 1.5708, Vec3::Zero())
                                   : RigidTransform::Identity());
    return content;
  }

 private:
  void add(SequenceContent& content, const Blobs& blobs, Random& random,
           const RigidTransform& tilted, const RigidTransform& sweep) const {
    const RigidTransform T_ras_corner =
        sweep * tilted *
        RigidTransform(Eigen::Translation3d(-0.5 * (kPixels - 1), -0.5 * (kPixels - 1), 0.0));
    for (int v = 0; v < kPixels; ++v)
      for (int u = 0; u < kPixels; ++u) {
        const double value = blobs(T_ras_corner * Vec3(kPixel_mm * u, kPixel_mm * v, 0));
        const double grey = (200.0 - 60.0 * value) * (1.0 + noise * random.normal());
        content.pixels += static_cast<char>(std::lround(std::clamp(grey, 1.0, 255.0)));
      }
    const auto i = static_cast<double>(content.frames.size());
    const RigidTransform T_tracker_reference =
        turned(Vec3(1, 0, 1), 0.5 + 0.01 * i, Vec3(-200 + i, 90, -1500));
    const RigidTransform T_tracker_probe =
        T_tracker_reference * kTruth.inverse() * T_ras_corner * kCorner.inverse();
    content.frames.push_back(
        {{"Timestamp", std::to_string(10.0 + 0.1 * i)},
         {"ImageStatus", "OK"},
         {"ProbeToTrackerTransform", matrix_text(T_tracker_probe.matrix())},
         {"ProbeToTrackerTransformStatus", "OK"},
         {"ReferenceToTrackerTransform", matrix_text(T_tracker_reference.matrix())},
         {"ReferenceToTrackerTransformStatus", "OK"}});
  }
};

class RegisterUltrasound : public testing::Test {
 protected:
  void SetUp() override {
    record(VirtualProbe().content());
    const AffineTransform T = AffineTransform(kCorner) * Eigen::Scaling(kPixel_mm);
    options.device = folder.write(
        "device.xml",
        "<PlusConfiguration><CoordinateDefinitions><Transform From=\"Image\" To=\"Probe\" "
        "Matrix=\"" +
            matrix_text(T.matrix()) + "\"/></CoordinateDefinitions></PlusConfiguration>");
    VoxelImage mri = registration::test::image_of(Blobs(11));
    put("mri.nii.gz", mri);
    std::size_t voxel = 0;
    for (int k = 0; k < mri.dims[2]; ++k)
      for (int j = 0; j < mri.dims[1]; ++j)
        for (int i = 0; i < mri.dims[0]; ++i)
          mri.values[voxel++] = (mri.T_ras_voxel * Vec3(i, j, k)).norm() < 40.0 ? 1.0F : 0.0F;
    put("brain.nii.gz", mri);
    options.mri = folder / "mri.nii.gz", options.brain = folder / "brain.nii.gz";
    const RigidTransform T_first = turned(Vec3(1, 1, 0), 0.05, Vec3(2.5, -2, 1.5)) * kTruth;
    options.registration = folder / "first.txt";
    ASSERT_TRUE(io::write_pose(options.registration, "T_ras_reference", T_first));
    options.target = Vec3(6, -4, 5);
    options.out = folder / "second.txt";
  }
  void put(const std::string& name, const VoxelImage& image) {
    ASSERT_TRUE(
        io::write_nifti(folder / name, {{image.dims, image.T_ras_voxel}, image.values, "test"}));
  }
  void record(const SequenceContent& content) {
    options.ultrasound = folder.write("us.mha", test_support::meta_text(content, false));
  }
  double error_mm() const {
    const auto T = value_or_fail(io::read_pose(options.out, "T_ras_reference"));
    return (T * (kTruth.inverse() * *options.target) - *options.target).norm();
  }
  std::string refusal() const {
    const std::string sentence = sentence_of(register_ultrasound(options));
    EXPECT_FALSE(fs::exists(options.out)) << "something was left behind";
    EXPECT_FALSE(fs::exists(folder / "second.png")) << "a picture was left behind";
    return sentence;
  }

  TemporaryFolder folder;
  UltrasoundRegisterOptions options;
};

TEST_F(RegisterUltrasound, AFirstRegistrationThatIsOffIsCorrected) {
  const auto report = value_or_fail(register_ultrasound(options));
  EXPECT_LT(error_mm(), 0.4);
  EXPECT_NEAR(report.moved_mm, 3.5, 1.0);
  EXPECT_LT(error_mm(), 3.0 * report.expected_mm);
  EXPECT_GT(report.expected_mm, 0.0);
  const auto lines = report_lines(report);
  EXPECT_THAT(lines, Contains("chain: ImageToProbe, ProbeToTracker, ReferenceToTracker, "
                              "ReferenceToRas"));
  EXPECT_THAT(lines, Contains("frames: 16 of 16 with a valid chain"));
  EXPECT_THAT(lines, Contains(AllOf(HasSubstr("moved: (6.0, -4.0, 5.0) by "), HasSubstr(" deg"))));
  EXPECT_THAT(lines, Contains(HasSubstr("agreement: 100 % of the starts")));
  EXPECT_THAT(lines, Contains(HasSubstr("residual: without an eighth of the frames")));
  EXPECT_THAT(lines, Contains(HasSubstr("expected error at (6.0, -4.0, 5.0) ")));
  EXPECT_THAT(test_support::content_of(options.out),
              AllOf(HasSubstr("# brainshift register --ultrasound: x_ras = "),
                    HasSubstr("# expected error at (6.0, -4.0, 5.0) ")));
  EXPECT_THAT(test_support::content_of(folder / "second.png"), HasSubstr("PNG"));
}

TEST_F(RegisterUltrasound, FramesThatAreLostOrRepeatedAreToldAndLeftOut) {
  VirtualProbe probe;
  probe.repeats = 3;
  SequenceContent content = probe.content();
  content.frames[0]["ProbeToTrackerTransformStatus"] = "INVALID";
  content.frames[7]["ImageStatus"] = "INVALID";
  record(content);
  options.picture = folder / "elsewhere.png";
  const auto report = value_or_fail(register_ultrasound(options));
  EXPECT_LT(error_mm(), 0.4);
  EXPECT_EQ(report.frames_valid, 46);
  EXPECT_EQ(report.frames_repeated, 30);
  const auto lines = report_lines(report);
  EXPECT_THAT(lines, Contains(HasSubstr("46 of 48 with a valid chain, 30 of them left out: they "
                                        "repeat the place")));
  EXPECT_THAT(lines, Contains(HasSubstr("frames left out: 1 because ProbeToTracker is invalid "
                                        "(first: frame 0)")));
  EXPECT_TRUE(fs::exists(folder / "elsewhere.png"));
  EXPECT_FALSE(fs::exists(folder / "second.png"));
}

TEST_F(RegisterUltrasound, AProbeThatIsHeldStillShowsTooLittle) {
  VirtualProbe probe;
  probe.tilt = 0.0;
  record(probe.content());
  EXPECT_THAT(refusal(), AllOf(HasSubstr("us.mha: shows too little"), HasSubstr("of one plane"),
                               HasSubstr("sweep or tilt the probe")));
}

TEST_F(RegisterUltrasound, TwoFramesThatCrossAreTooFew) {
  SequenceContent content = VirtualProbe().content();
  const auto bytes = static_cast<std::size_t>(kPixels) * kPixels;
  content.frames = {content.frames.front(), content.frames.back()};
  content.pixels =
      content.pixels.substr(0, bytes) + content.pixels.substr(content.pixels.size() - bytes);
  record(content);
  EXPECT_THAT(refusal(), HasSubstr("us.mha: has too few frames: 2 of 2 have a valid chain and a "
                                   "place of their own, 8 are needed"));
}

TEST_F(RegisterUltrasound, WhatTheMriDoesNotHaveIsRefused) {
  for (const std::uint64_t other : {99U, 98U, 97U}) {
    VirtualProbe probe;
    probe.seen = other;
    record(probe.content());
    EXPECT_THAT(refusal(), testing::AnyOf(HasSubstr("us.mha: the starts disagree"),
                                          HasSubstr("us.mha: shows too little"),
                                          HasSubstr("at the edge of the search")));
  }
}

TEST_F(RegisterUltrasound, NoiseAloneIsRefused) {
  VirtualProbe probe;
  SequenceContent content = probe.content();
  Random random(3);
  for (char& pixel : content.pixels) pixel = static_cast<char>(1 + random.index(255));
  record(content);
  EXPECT_THAT(refusal(), HasSubstr("us.mha: "));
}

TEST_F(RegisterUltrasound, NamesWhatIsMissingOrWrong) {
  const auto with = [&](auto change) {
    const UltrasoundRegisterOptions keep = options;
    change(options);
    const std::string message = refusal();
    options = keep;
    return message;
  };
  using O = UltrasoundRegisterOptions;
  EXPECT_THAT(with([](O& o) { o.mri.clear(); }), HasSubstr("--mri is required"));
  EXPECT_THAT(with([](O& o) { o.registration.clear(); }), HasSubstr("--registration is required"));
  EXPECT_THAT(with([](O& o) { o.out.clear(); }), HasSubstr("--out is required"));
  EXPECT_THAT(with([](O& o) { o.brain.clear(); }), HasSubstr("--target needs --brain"));
  EXPECT_THAT(with([](O& o) { o.target.reset(); }), HasSubstr("0 given"));
  EXPECT_THAT(with([](O& o) { o.model = "a.h5"; }), HasSubstr("2 given"));
  EXPECT_THAT(with([](O& o) { o.target = Vec3(0, 0, std::nan("")); }), HasSubstr("--target"));
  EXPECT_THAT(with([](O& o) { o.latency_ms = 2000.0; }), HasSubstr("--latency-ms 2000"));
  EXPECT_THAT(with([](O& o) { o.max_age_ms = -1.0; }), HasSubstr("--max-age-ms -1"));
  EXPECT_THAT(with([](O& o) { o.device.clear(); }), HasSubstr("us.mha: no chain from Image"));
  EXPECT_THAT(with([](O& o) { o.image_frame = "Picture"; }), HasSubstr("Picture"));
  EXPECT_THAT(with([](O& o) { o.mri = "nowhere.nii"; }), HasSubstr("nowhere.nii"));
  EXPECT_THAT(with([](O& o) { o.ultrasound = "nowhere.mha"; }), HasSubstr("nowhere.mha"));
  EXPECT_THAT(with([](O& o) { o.registration = "nowhere.txt"; }), HasSubstr("nowhere.txt"));
  EXPECT_THAT(with([](O& o) { o.brain = "nowhere.nii"; }), HasSubstr("nowhere.nii"));
  const fs::path far = folder / "far.txt";
  ASSERT_TRUE(io::write_pose(far, "T_ras_reference",
                             RigidTransform(Eigen::Translation3d(300, 0, 0)) * kTruth));
  EXPECT_THAT(with([&](O& o) { o.registration = far; }),
              HasSubstr("us.mha: image registration: 0 % of the samples lie inside the MRI"));
  VoxelImage other = registration::test::image_of(Blobs(11));
  std::fill(other.values.begin(), other.values.end(), 0.0F);
  other.values.front() = 1.0F;
  put("other.nii.gz", other);
  const Vec3 its_voxel = other.T_ras_voxel.translation();
  EXPECT_THAT(with([&](O& o) { o.brain = folder / "other.nii.gz", o.target = its_voxel; }),
              AllOf(HasSubstr("0 % of the samples lie inside the brain: at least"),
                    HasSubstr("and --brain " + (folder / "other.nii.gz").string())));
  EXPECT_THAT(
      with([](O& o) { o.target = Vec3(6, -4, 100); }),
      AllOf(HasSubstr("--target (6.0, -4.0, 100.0) lies 6"), HasSubstr("mm from the brain in"),
            HasSubstr("which reaches from ("), HasSubstr("must lie within 30 mm")));
  EXPECT_THAT(with([](O& o) { o.target = Vec3(0.006, -0.004, 0.005); }),
              HasSubstr("in metres it would be (6.0, -4.0, 5.0) mm"));
  SequenceContent content = VirtualProbe().content();
  for (auto& frame : content.frames) frame["ProbeToTrackerTransformStatus"] = "INVALID";
  record(content);
  EXPECT_THAT(refusal(), HasSubstr("none of 16 frames has a valid chain; ProbeToTracker is "
                                   "invalid (16 frames)"));
}

TEST_F(RegisterUltrasound, WhatIsThereIsLeftAlone) {
  folder.write("second.png", "mine");
  EXPECT_THAT(refusal_of(register_ultrasound(options), ErrorCode::kInvalidArgument),
              AllOf(HasSubstr("second.png"), HasSubstr("exists already")));
  EXPECT_FALSE(fs::exists(options.out));
  EXPECT_EQ(test_support::content_of(folder / "second.png"), "mine");
}

TEST(CrossingFrames, AreTheNearestToTheTargetThatCross) {
  tracking::Recording recording;
  recording.width = recording.height = 11;
  recording.time_s = {0, 1, 2, 3};
  const auto plane = [](const Vec3& axis, double angle, const Vec3& corner) {
    return AffineTransform(turned(axis, angle, corner));
  };
  ultrasound::ImagePoses poses = {plane(Vec3::UnitX(), 0.0, Vec3(-5, -5, 3)),
                                  plane(Vec3::UnitX(), 0.0, Vec3(-5, -5, 1)), std::nullopt,
                                  plane(Vec3::UnitX(), 1.5708, Vec3(-5, 4, -5))};
  const CrossingFrames both = crossing_frames(recording, poses, Vec3::Zero());
  EXPECT_EQ(both.first, 1);
  EXPECT_EQ(both.second, 3);
  poses[3].reset();
  EXPECT_FALSE(crossing_frames(recording, poses, Vec3::Zero()).second);
}

}  // namespace
}  // namespace brainshift::client
