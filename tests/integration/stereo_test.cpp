// SPDX-License-Identifier: GPL-3.0-or-later
// `brainshift stereo` as a user runs it: boards and a patch drawn by known cameras, over the toy
// patient's craniotomy; and every bad input refused with one line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "common/io/config/calibration_file.hpp"
#include "common/io/geometry/mesh_file.hpp"
#include "common/io/model/model_file.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/values/observation.hpp"
#include "common/wire/convert.hpp"
#include "tests/integration/process.hpp"
#include "tests/integration/workspace.hpp"
#include "tests/support/stereo_scene.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::integration {
namespace {

using test_support::Eye;
using test_support::operating_rig;
using test_support::Patch;
using testing::HasSubstr;
using testing::SizeIs;
using testing::StartsWith;

std::string pgm(const stereo::GrayImage& image) {
  return "P5\n" + std::to_string(image.width) + " " + std::to_string(image.height) + "\n255\n" +
         std::string(image.pixels.begin(), image.pixels.end());
}

// The rig 250 mm above the middle of the toy patient's craniotomy, (30, 30, 60), looking down.
const char* const kPose = "1 0 0 30\n0 -1 0 30\n0 0 -1 310\n0 0 0 1\n";

Patch small_patch() {
  Patch patch;
  patch.radius_mm = 35.0;
  return patch;
}

// left.pgm, right.pgm, calibration.yaml and pose.txt.
void write_pair(const Workspace& files) {
  const StereoCalibration rig = operating_rig();
  files.write("left.pgm", pgm(render(rig, Eye::kLeft, small_patch(), 1)));
  files.write("right.pgm", pgm(render(rig, Eye::kRight, small_patch(), 2)));
  files.write("calibration.yaml", io::calibration_text(rig));
  files.write("pose.txt", kPose);
}

std::vector<std::string> reconstruct_command(const Workspace& files) {
  return {brainshift(),
          "stereo",
          "reconstruct",
          "--left",
          files.path("left.pgm"),
          "--right",
          files.path("right.pgm"),
          "--calibration",
          files.path("calibration.yaml"),
          "--pose",
          files.path("pose.txt"),
          "--out",
          files.path("out/cortex.ply")};
}

std::string write_model(const Workspace& files, const std::string& name, int cells = 5) {
  const BrainModel model = test_support::toy_patient(cells);
  CaseConfig config = test_support::toy_config();
  config.file = files.path("case.yaml");
  config.brain = files.path("mask.nii");  // a case names one; nobody reads it here
  const Status written = io::write_model(files.path(name), {config, model});
  EXPECT_TRUE(written) << written.error().message;
  return files.path(name);
}

std::vector<std::string> observe_command(const Workspace& files, const std::string& surface) {
  return {brainshift(),
          "stereo",
          "observe",
          "--surface",
          surface,
          "--model",
          files.path("model.h5"),
          "--sd-mm",
          "0.5",
          "--out",
          files.path("out/case.surgery")};
}

void expect_stereo_refused(const Finished& finished, const std::string& says) {
  EXPECT_EQ(finished.exit_status, 2);
  const auto told = lines(finished.err);
  ASSERT_THAT(told, SizeIs(1)) << finished.err;
  EXPECT_THAT(told[0], StartsWith("brainshift: "));
  EXPECT_THAT(told[0], HasSubstr(says));
}

std::vector<Observation> observations_of(const std::string& path) {
  const auto file = io::SurgeryFile::open(path);
  EXPECT_TRUE(file) << file.error().message;
  std::vector<Observation> observations;
  if (!file) return observations;
  const auto records = file->records(io::RecordKind::kObservation);
  EXPECT_TRUE(records);
  for (const io::SurgeryRecord& record : *records) {
    auto decoded = wire::decode_observation(record.payload);
    EXPECT_TRUE(decoded) << decoded.error().message;
    observations.push_back(std::move(*decoded));
    EXPECT_EQ(record.sequence, observations.back().sequence);
    EXPECT_EQ(record.recorded_ns, observations.back().acquired_ns);
  }
  return observations;
}

TEST(Stereo, PicturesBecomeObservationsOfASurgery) {
  const Workspace files;
  std::filesystem::create_directory(files.path("out"));
  write_pair(files);
  write_model(files, "model.h5");

  auto command = reconstruct_command(files);
  command.insert(command.end(), {"--disparity-png", files.path("out/disparity.png")});
  const Finished made = run(command);
  ASSERT_EQ(made.exit_status, 0) << made.err;
  EXPECT_THAT(made.out, HasSubstr("% of the pixels matched"));
  EXPECT_GT(std::filesystem::file_size(files.path("out/disparity.png")), 20000U);
  const auto surface = io::read_surface(files.path("out/cortex.ply"));
  ASSERT_TRUE(surface) << surface.error().message;
  double squared = 0.0;
  for (Eigen::Index i = 0; i < surface->vertices.cols(); ++i) {
    const Vec3 x = surface->vertices.col(i);
    const double depth = 310.0 - x.z();
    squared += std::pow(depth - patch_depth(small_patch(), x.x() - 30.0, 30.0 - x.y()), 2);
  }
  EXPECT_LT(std::sqrt(squared / surface->num_vertices()), 0.6);

  // A new surgery, and one more observation, of points only, later.
  const Finished first = run(observe_command(files, files.path("out/cortex.ply")));
  ASSERT_EQ(first.exit_status, 0) << first.err;
  EXPECT_THAT(first.out, StartsWith("observation 1 at 0 s: "));
  std::string points;
  for (int i = 0; i < 200; ++i)
    points += std::to_string(20 + i % 20) + " " + std::to_string(20 + i / 10) + " 57.5\n";
  auto later = observe_command(files, files.write("points.xyz", points));
  later.insert(later.end(), {"--time-s", "12.5", "--source", "scanner"});
  const Finished second = run(later);
  ASSERT_EQ(second.exit_status, 0) << second.err;
  EXPECT_THAT(second.out, StartsWith("observation 2 at 12.5 s: 200 points, 0 triangles"));

  const auto observations = observations_of(files.path("out/case.surgery"));
  ASSERT_THAT(observations, SizeIs(2));
  const auto& cortex = std::get<CorticalSurface>(observations[0].body);
  EXPECT_EQ(cortex.surface.vertices, surface->vertices);
  EXPECT_EQ(cortex.surface.triangles, surface->triangles);
  EXPECT_EQ(cortex.sd_mm, 0.5);
  EXPECT_EQ(observations[0].source, "stereopsis");
  EXPECT_EQ(observations[1].source, "scanner");
  EXPECT_EQ(observations[1].acquired_ns, 12'500'000'000);

  // Time goes forward, and a surgery belongs to one model.
  later = observe_command(files, files.path("points.xyz"));
  later.insert(later.end(), {"--time-s", "12.5"});
  expect_stereo_refused(run(later), "case.surgery: --time-s 12.5: must be above 12.5");
  write_model(files, "model.h5", 6);
  expect_stereo_refused(run(observe_command(files, files.path("points.xyz"))),
                        "case.surgery: model_id is \"");
  EXPECT_THAT(observations_of(files.path("out/case.surgery")), SizeIs(2));
  // Only the sources that a surgery has can be played by themselves.
  expect_stereo_refused(run({brainshift(), "replay", files.path("out/case.surgery"), "--sources",
                             "ius", "--report", files.path("r.json")}),
                        "holds no observation of source \"ius\"; it has: scanner, stereopsis");
}

TEST(Stereo, BoardsBecomeACalibration) {
  const Workspace files;
  const stereo::ChessBoard board{9, 6, 8.0};
  const StereoCalibration rig = operating_rig();
  for (int i = 0; i < 6; ++i) {
    const RigidTransform T = test_support::board_pose(i, board);
    const std::string number = std::to_string(i) + ".pgm";
    files.write("l" + number, pgm(render(rig, Eye::kLeft, board, T)));
    files.write("r" + number, pgm(render(rig, Eye::kRight, board, T)));
  }
  const auto command = [&](const std::string& left, const std::string& right,
                           const std::string& corners) {
    return std::vector<std::string>{
        brainshift(), "stereo", "calibrate",   "--left", left,    "--right",           right,
        "--board",    corners,  "--square-mm", "8",      "--out", files.path("c.yaml")};
  };
  expect_stereo_refused(run(command(files.path("r*.pgm"), files.path("l*.pgm"), "9x6")),
                        "left and right are swapped");
  expect_stereo_refused(run(command(files.path("l*.pgm"), files.path("r[0-4].pgm"), "9x6")),
                        "6 left and 5 right pictures: must be as many");
  expect_stereo_refused(run(command(files.path("l[0-3].pgm"), files.path("r[0-3].pgm"), "9x6")),
                        "found in 4 pairs: at least 5 are needed");
  expect_stereo_refused(run(command(files.path("l*.pgm"), files.path("r*.pgm"), "9by6")),
                        "--board 9by6");
  expect_stereo_refused(run(command(files.path("x*.pgm"), files.path("r*.pgm"), "9x6")),
                        "x*.pgm: no file of this name or pattern");
  EXPECT_FALSE(std::filesystem::exists(files.path("c.yaml")));
  const Finished made = run(command(files.path("l*.pgm"), files.path("r*.pgm"), "9x6"));
  ASSERT_EQ(made.exit_status, 0) << made.err;
  EXPECT_THAT(made.out, HasSubstr("6 pairs used, 0 without a whole board"));
  const auto calibration = io::read_calibration(files.path("c.yaml"));
  ASSERT_TRUE(calibration) << calibration.error().message;
  EXPECT_NEAR(right_camera_in_left(*calibration).norm(), right_camera_in_left(rig).norm(), 0.2);
}

struct BadPair {
  const char* name;
  std::function<void(const Workspace&)> spoil;
  std::string says;
};
void PrintTo(const BadPair& bad, std::ostream* stream) { *stream << bad.name; }
class BadStereoPair : public testing::TestWithParam<BadPair> {};

TEST_P(BadStereoPair, ExitsTwoWithOneLineAndLeavesNothingBehind) {
  const Workspace files;
  std::filesystem::create_directory(files.path("out"));
  write_pair(files);
  GetParam().spoil(files);
  expect_stereo_refused(run(reconstruct_command(files)), GetParam().says);
  EXPECT_TRUE(std::filesystem::is_empty(files.path("out")));
}

stereo::GrayImage blank(int width, int height) { return {width, height, 128}; }

INSTANTIATE_TEST_SUITE_P(
    Table, BadStereoPair,
    testing::Values(
        BadPair{"Swapped",
                [](const Workspace& f) {
                  std::filesystem::rename(f.path("left.pgm"), f.path("t.pgm"));
                  std::filesystem::rename(f.path("right.pgm"), f.path("left.pgm"));
                  std::filesystem::rename(f.path("t.pgm"), f.path("right.pgm"));
                },
                "left.pgm: left and right pictures are swapped"},
        BadPair{"NoTexture",
                [](const Workspace& f) {
                  f.write("left.pgm", pgm(blank(640, 480)));
                  f.write("right.pgm", pgm(blank(640, 480)));
                },
                "0.0 % of the pixels have a consistent match"},
        BadPair{"UnequalSizes",
                [](const Workspace& f) { f.write("right.pgm", pgm(blank(320, 240))); },
                "the right picture has 320 x 240 px: the calibration is for 640 x 480 px"},
        BadPair{"CalibrationOfAnotherSize",
                [](const Workspace& f) {
                  StereoCalibration rig = operating_rig();
                  rig.width_px = 800;
                  f.write("calibration.yaml", io::calibration_text(rig));
                },
                "the left picture has 640 x 480 px: the calibration is for 800 x 480 px"},
        BadPair{"CalibrationSwapped",
                [](const Workspace& f) {
                  StereoCalibration rig = operating_rig();
                  rig.T_right_left = rig.T_right_left.inverse();
                  f.write("calibration.yaml", io::calibration_text(rig));
                },
                "left and right are swapped"},
        BadPair{"PoseNotRigid",
                [](const Workspace& f) { f.write("pose.txt", "1 0 0 0 0 1 0 0 0 0 2 0 0 0 0 1"); },
                "pose.txt: T_ras_camera is no rigid motion"},
        BadPair{"PoseEmpty", [](const Workspace& f) { f.write("pose.txt", ""); },
                "pose.txt: T_ras_camera has 0 numbers"},
        BadPair{"PictureEmpty", [](const Workspace& f) { f.write("left.pgm", ""); },
                "left.pgm: is empty"},
        BadPair{"PictureNone", [](const Workspace& f) { f.write("right.pgm", "no picture"); },
                "right.pgm: is no picture that can be read"},
        BadPair{"PictureAbsent",
                [](const Workspace& f) { std::filesystem::remove(f.path("left.pgm")); },
                "left.pgm"},
        BadPair{"CalibrationEmpty", [](const Workspace& f) { f.write("calibration.yaml", ""); },
                "calibration.yaml: is not a YAML mapping"},
        BadPair{"CalibrationAbsent",
                [](const Workspace& f) { std::filesystem::remove(f.path("calibration.yaml")); },
                "calibration.yaml"}),
    [](const auto& row) { return std::string(row.param.name); });

TEST(BadSurface, ExitsTwoWithOneLineAndMakesNoSurgery) {
  const Workspace files;
  std::filesystem::create_directory(files.path("out"));
  write_model(files, "model.h5");
  const auto points = [&](double scale, double shift, int count = 200) {
    std::string text;
    for (int i = 0; i < count; ++i)
      text += std::to_string(scale * (20 + i % 20)) + " " + std::to_string(scale * (20 + i / 10)) +
              " " + std::to_string(scale * (57.5 + shift)) + "\n";
    return files.write("points.xyz", text);
  };
  const auto expect = [&](const std::string& surface, const std::string& says) {
    expect_stereo_refused(run(observe_command(files, surface)), says);
    EXPECT_TRUE(std::filesystem::is_empty(files.path("out"))) << says;
  };
  expect(points(0.001, 0.0), "metres?");
  expect(points(1.0, 200.0), "from the craniotomy's centre");
  expect(points(1.0, 0.0, 49), "has 49 points");
  expect(files.write("empty.ply", ""), "empty.ply: is not a PLY file");
  expect(files.path("absent.ply"), "absent.ply");
  auto command = observe_command(files, points(1.0, 0.0));
  command[8] = "-1";
  expect_stereo_refused(run(command), "--sd-mm -1: must be finite and > 0");
  command[8] = "0.5";
  command.insert(command.end(), {"--time-s", "-2"});
  expect_stereo_refused(run(command), "--time-s -2: must be between 0 and 1e+06");
}

TEST(StereoUsage, HelpTeachesAndMissingOptionsAreNamed) {
  for (const char* part : {"calibrate", "reconstruct", "observe"}) {
    const Finished help = run({brainshift(), "stereo", part, "--help"});
    EXPECT_EQ(help.exit_status, 0);
    EXPECT_THAT(help.out, HasSubstr(std::string("brainshift stereo ") + part));
    EXPECT_THAT(help.out, HasSubstr("Example"));
    expect_stereo_refused(run({brainshift(), "stereo", part}), "is required");
  }
}

}  // namespace
}  // namespace brainshift::integration
