// SPDX-License-Identifier: GPL-3.0-or-later
// `brainshift import` as a user runs it: a recorded sweep becomes a surgery that the daemon
// answers, and bad input exits 2 with one line that names what is wrong and leaves nothing behind.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/integration/process.hpp"
#include "tests/integration/workspace.hpp"
#include "tests/support/virtual_sweep.hpp"

namespace brainshift::integration {
namespace {

using test_support::SequenceContent;
using test_support::VirtualSweep;
using testing::HasSubstr;
using testing::SizeIs;
using testing::StartsWith;

// The coarse case's tumour, 2 mm lower.
VirtualSweep sweep_of_case() {
  VirtualSweep sweep;
  sweep.centre_mm = Vec3(46.0, -47.0, 7.0);
  sweep.semi_axes_mm = Vec3(16.0, 13.5, 12.146617);
  sweep.travel_mm = 18.0;
  sweep.width = 240, sweep.height = 200;
  return sweep;
}

class ImportCommand : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(head_is_installed()) << "Debian's mricron-data is not installed";
    std::string text = "frame,u_px,v_px\n";
    for (int frame = 0; frame < sweep.frames; ++frame) {
      const auto contour = sweep.section(frame, 90);
      for (Eigen::Index i = 0; i < contour.points_px.cols(); ++i) {
        std::ostringstream row;
        row << frame << ',' << contour.points_px(0, i) << ',' << contour.points_px(1, i) << '\n';
        text += row.str();
      }
    }
    arguments = {
        {"--recording", files.write("sweep.igs.mha", test_support::meta_text(content, true))},
        {"--device", files.write("device.xml", sweep.device_text())},
        {"--contours", files.write("contours.csv", text)},
        {"--registration", files.write("registration.txt", test_support::matrix_text(
                                                               sweep.T_ras_reference().matrix()))},
        {"--case", coarse_case()},
        {"--out", files.path("sweep.surgery")}};
  }

  Finished import() const {
    std::vector<std::string> argv = {brainshift(), "import"};
    for (const auto& [option, value] : arguments) {
      if (value.empty()) continue;
      argv.push_back(option);
      argv.push_back(value);
    }
    return run(argv);
  }

  std::string prepared_model() const {
    const auto model = files.path("model.h5");
    const Finished prepared =
        run({brainshiftd(), "prepare", "--case", coarse_case(), "--out", model});
    EXPECT_EQ(prepared.exit_status, 0) << prepared.err;
    return model;
  }

  // Replays the surgery to a daemon with this model: every observation is answered once, under the
  // name of what was recorded.
  void expect_answered(const std::string& model, const std::string& surgery,
                       const std::string& recorded) const {
    const Background daemon(
        {brainshiftd(), "serve", "--config",
         files.write("daemon.yaml", "endpoint: tcp://127.0.0.1:*\n"), "--model", model},
        files.path("daemon.log"));
    ASSERT_THAT(daemon.first_line(), StartsWith("listening on "));
    const Finished replayed =
        run({brainshift(), "replay", files.path(surgery + ".surgery"), "--endpoint",
             daemon.first_line().substr(std::string("listening on ").size()), "--report",
             files.path("r.json")});
    ASSERT_EQ(replayed.exit_status, 0) << replayed.err;
    std::ifstream stream(files.path("r.json"));
    const auto report = nlohmann::json::parse(stream);
    ASSERT_EQ(report.size(), 2U);
    for (const auto& one : report) {
      EXPECT_EQ(one.at("updates"), 1);
      EXPECT_EQ(one.at("scenario"), std::filesystem::path(recorded).stem().string());
    }
  }

  void expect_refused(const std::string& says) const {
    SCOPED_TRACE(says);
    const Finished finished = import();
    EXPECT_EQ(finished.exit_status, 2);
    EXPECT_EQ(finished.out, "");
    const auto told = lines(finished.err);
    ASSERT_THAT(told, SizeIs(1)) << finished.err;
    EXPECT_THAT(told[0], StartsWith("brainshift: "));
    EXPECT_THAT(told[0], HasSubstr(says));
    for (const char* suffix : {"", "-wal", "-shm"}) {
      EXPECT_FALSE(std::filesystem::exists(files.path("sweep.surgery") + suffix));
    }
  }

  Workspace files;
  VirtualSweep sweep = sweep_of_case();
  SequenceContent content = sweep.content();
  std::map<std::string, std::string> arguments;
};

TEST_F(ImportCommand, MakesASurgeryThatTheDaemonAnswers) {
  const auto model = prepared_model();
  arguments["--case"] = "";
  arguments["--model"] = model;
  const Finished imported = import();
  ASSERT_EQ(imported.exit_status, 0) << imported.err;
  EXPECT_THAT(imported.out, HasSubstr("frames: 21 of 21 with a valid chain"));
  EXPECT_THAT(imported.out, HasSubstr("sweep 1: frames 0 to 20, 21 contours"));
  expect_answered(model, "sweep", "sweep.igs.mha");
}

TEST_F(ImportCommand, LandmarksMakeASurgeryThatTheDaemonAnswers) {
  const auto model = prepared_model();
  const auto before = files.write("before.fcsv",
                                  "# CoordinateSystem = LPS\n1,-30,45,20,0,0,0,1,1,1,0,a,,\n"
                                  "2,-50,40,30,0,0,0,1,1,1,0,b,,\n3,-45,60,0,0,0,0,1,1,1,0,c,,\n"
                                  "4,-40,20,10,0,0,0,1,1,1,0,d,,\n");
  const auto during =
      files.write("during.mrk.json", R"({"markups": [{"type": "Fiducial", "coordinateSystem": "RAS",
      "controlPoints": [{"label": "d", "position": [40, -20, 9]},
                        {"label": "c", "position": [45, -60, -2]},
                        {"label": "b", "position": [50, -41, 27]},
                        {"label": "a", "position": [30, -45, 18]}]}]})");
  const Finished imported =
      run({brainshift(), "import", "--landmarks", before, "--landmarks-moved", during, "--model",
           model, "--out", files.path("landmarks.surgery")});
  ASSERT_EQ(imported.exit_status, 0) << imported.err;
  EXPECT_THAT(imported.out, HasSubstr("landmarks: 4 pairs, moved 2.04 mm on average"));
  EXPECT_THAT(imported.out, HasSubstr("rigid part: rotation"));
  expect_answered(model, "landmarks", "before.fcsv");
}

// The registration of a stylus that was held still on four fiducials is as good as the one that
// the scene was made with.
TEST_F(ImportCommand, ARegistrationFromAStylusGivesTheSameSweep) {
  const auto model = prepared_model();
  SequenceContent stylus;
  stylus.fields.clear();
  std::string ras = "name,x,y,z\n";
  const RigidTransform T_reference_ras = sweep.T_ras_reference().inverse();
  for (const Vec3& at : {Vec3(0, 95, 0), Vec3(-70, 10, -20), Vec3(75, 5, -15), Vec3(10, 20, 90)}) {
    std::ostringstream row;
    row << "f," << at.x() << ',' << at.y() << ',' << at.z() << '\n';
    ras += row.str();
    for (int pose = 0; pose < 30; ++pose) {
      RigidTransform T_reference_tip = RigidTransform::Identity();
      T_reference_tip.translation() = T_reference_ras * at;
      stylus.frames.push_back(
          {{"Timestamp", std::to_string(0.05 * static_cast<double>(stylus.frames.size()))},
           {"StylusTipToReferenceTransform", test_support::matrix_text(T_reference_tip.matrix())},
           {"StylusTipToReferenceTransformStatus", "OK"}});
    }
  }
  const auto out = files.path("T_ras_reference.txt");
  const Finished registered =
      run({brainshift(), "register", "--recording",
           files.write("stylus.igs.mha", test_support::meta_text(stylus, false)), "--ras",
           files.write("ras.csv", ras), "--pair", "order", "--model", model, "--out", out});
  ASSERT_EQ(registered.exit_status, 0) << registered.err;
  EXPECT_THAT(registered.out, HasSubstr("held still 4: "));
  EXPECT_THAT(registered.out, HasSubstr("expected error at the tumour 0.00 mm rms"));
  arguments["--case"] = "";
  arguments["--model"] = model;
  const Finished expected = import();
  ASSERT_EQ(expected.exit_status, 0) << expected.err;
  arguments["--registration"] = out;
  arguments["--out"] = files.path("again.surgery");
  const Finished again = import();
  ASSERT_EQ(again.exit_status, 0) << again.err;
  EXPECT_EQ(again.out, expected.out);
}

TEST_F(ImportCommand, BadOptionsExitTwoWithOneLine) {
  const auto with = [&](const std::string& option, const std::string& value,
                        const std::string& says) {
    const auto keep = arguments;
    arguments[option] = value;
    expect_refused(says);
    arguments = keep;
  };
  with("--recording", "", "--recording is required");
  with("--recording", files.path("none.mha"), "none.mha");
  with("--recording", files.write("bad.mha", "nonsense"), "bad.mha");
  with("--device", files.write("bad.xml", "<a>"), "bad.xml");
  with("--device", "", "no chain from Image to Ras");
  with("--contours", files.write("bad.csv", "1,2\n"), "bad.csv: line 1");
  with("--seeds", files.write("s.csv", "1,2,3\n"), "exactly one of --contours and --seeds");
  with("--registration", files.write("bad.txt", "1 2 3"), "T_ras_reference has 3 numbers");
  with("--case", files.path("none.yaml"), "none.yaml");
  with("--sd-mm", "-1", "--sd-mm -1");
  with("--latency-ms", "soon", "--latency-ms");
  with("--orientation-of-mars", "MF", "--orientation-of-mars");
  with("--image", "Picture", "no chain from Picture to Ras");
}

TEST_F(ImportCommand, BadRecordingsExitTwoNamingFrameAndField) {
  const auto with = [&](auto change, const std::string& says) {
    SequenceContent bad = content;
    change(bad);
    arguments["--recording"] = files.write("bad.mha", test_support::meta_text(bad, true));
    expect_refused(says);
  };
  with([](SequenceContent& bad) { bad.frames[5].erase("Timestamp"); },
       "frame 5: Seq_Frame0005_Timestamp is missing");
  with([](SequenceContent& bad) { bad.frames[5]["Timestamp"] = "1.0"; },
       "the clock runs backwards");
  with([](SequenceContent& bad) { bad.frames[7]["ProbeToTrackerTransform"] = "1 2 3"; },
       "frame 7: Seq_Frame0007_ProbeToTrackerTransform is not 16 numbers");
  with([](SequenceContent& bad) { bad.pixels.resize(1000); }, "pixels");
  with([](SequenceContent& bad) { bad.fields.clear(); }, "UltrasoundImageOrientation is missing");
  with(
      [](SequenceContent& bad) {
        for (auto& frame : bad.frames) frame["ProbeToTrackerTransformStatus"] = "INVALID";
      },
      "ProbeToTracker is invalid (21 frames, first 0)");
}

TEST_F(ImportCommand, AFarBoundaryExitsTwoWithTheDistance) {
  RigidTransform far = sweep.T_ras_reference();
  far.translation().z() += 300.0;
  arguments["--registration"] = files.write("far.txt", test_support::matrix_text(far.matrix()));
  expect_refused("mm from the tumour of case colin27-coarse");
}

TEST_F(ImportCommand, HelpTeaches) {
  const Finished help = run({brainshift(), "import", "--help"});
  EXPECT_EQ(help.exit_status, 0);
  for (const char* part :
       {"Example:", "--recording", "--registration", "--seeds", "brainshift replay"}) {
    EXPECT_THAT(help.out, HasSubstr(part));
  }
}

}  // namespace
}  // namespace brainshift::integration
