// SPDX-License-Identifier: GPL-3.0-or-later
// A virtual stylus touches fiducials of known place while its tracker is recorded: the registration
// is the one that the scene was made with.
#include "client/tools/import/register_patient.hpp"

#include <gmock/gmock.h>

#include <filesystem>

#include "common/core/random.hpp"
#include "common/io/geometry/pose_file.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/virtual_sweep.hpp"

namespace brainshift::client {
namespace {

using test_support::matrix_text;
using test_support::SequenceContent;
using test_support::TemporaryFolder;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

const std::vector<Vec3> kFiducials = {Vec3(0, 95, 0), Vec3(-70, 10, -20), Vec3(75, 5, -15),
                                      Vec3(10, 20, 110), Vec3(30, -90, 20)};
const std::vector<std::string> kNames = {"nasion", "left ear", "right ear", "vertex", "inion"};

// The poses of a tracked stylus whose tip rests for 2 s on each of these points, mm RAS.
struct VirtualStylus {
  std::vector<Vec3> rests = kFiducials;
  double noise_mm = 0.0;

  static RigidTransform T_ras_reference() {
    RigidTransform T = RigidTransform::Identity();
    T.linear() = Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized()).toRotationMatrix();
    T.translation() = Vec3(12, -40, 7);
    return T;
  }
  static RigidTransform T_stylus_tip() {
    RigidTransform T = RigidTransform::Identity();
    T.translation() = Vec3(-1, 2, 160);
    return T;
  }
  static std::string device_text() {
    return "<PlusConfiguration><CoordinateDefinitions><Transform From=\"StylusTip\" To=\"Stylus\" "
           "Matrix=\"" +
           matrix_text(T_stylus_tip().matrix()) +
           "\"/></CoordinateDefinitions></PlusConfiguration>";
  }

  SequenceContent content() const {
    SequenceContent content;
    content.fields.clear();
    Random random(3);
    const auto record = [&](const Vec3& ras) {
      const auto i = static_cast<double>(content.frames.size());
      // The head moves with its reference, and the stylus turns.
      RigidTransform T_tracker_reference = RigidTransform::Identity();
      T_tracker_reference.linear() =
          Eigen::AngleAxisd(0.4 + 1e-3 * i, Vec3(0, 1, 1).normalized()).toRotationMatrix();
      T_tracker_reference.translation() = Vec3(100 + 0.05 * i, -60, 1500);
      RigidTransform T_reference_tip = RigidTransform::Identity();
      T_reference_tip.linear() = Eigen::AngleAxisd(0.01 * i, Vec3::UnitX()).toRotationMatrix();
      T_reference_tip.translation() =
          T_ras_reference().inverse() *
          (ras + noise_mm * Vec3(random.normal(), random.normal(), random.normal()));
      const RigidTransform T_tracker_stylus =
          T_tracker_reference * T_reference_tip * T_stylus_tip().inverse();
      content.frames.push_back(
          {{"Timestamp", std::to_string(50.0 + 0.05 * i)},
           {"ImageStatus", "INVALID"},
           {"StylusToTrackerTransform", matrix_text(T_tracker_stylus.matrix())},
           {"StylusToTrackerTransformStatus", "OK"},
           {"ReferenceToTrackerTransform", matrix_text(T_tracker_reference.matrix())},
           {"ReferenceToTrackerTransformStatus", "OK"}});
    };
    Vec3 at = Vec3(200, 0, 0);
    for (const Vec3& to : rests) {
      for (int step = 1; step < 10; ++step) record(at + 0.1 * step * (to - at));
      for (int step = 0; step < 40; ++step) record(to);
      at = to;
    }
    return content;
  }
};

std::string fcsv() {
  std::string text = "# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n";
  for (std::size_t i = 0; i < kFiducials.size(); ++i) {
    const Vec3& at = kFiducials[i];
    text += std::to_string(i) + "," + std::to_string(-at.x()) + "," + std::to_string(-at.y()) +
            "," + std::to_string(at.z()) + ",0,0,0,1,1,1,0," + kNames[i] + ",,\n";
  }
  return text;
}

class RegisterPatient : public testing::Test {
 protected:
  void SetUp() override {
    record();
    options.device = folder.write("device.xml", VirtualStylus::device_text());
    options.ras = folder.write("fiducials.fcsv", fcsv());
    options.target = Vec3(46, -47, 9);
    options.out = folder / "T_ras_reference.txt";
  }
  void record() {
    options.recording = folder.write("s.mha", test_support::meta_text(stylus.content(), false));
  }
  // How far the registration is off at the target, in the file that was written.
  double error_mm() const {
    const auto T = value_or_fail(io::read_pose(options.out, "T_ras_reference"));
    const Vec3 reference = VirtualStylus::T_ras_reference().inverse() * *options.target;
    return (T * reference - *options.target).norm();
  }
  std::string refusal() const {
    const std::string sentence = sentence_of(register_patient(options));
    EXPECT_FALSE(std::filesystem::exists(options.out)) << "something was left behind";
    return sentence;
  }

  TemporaryFolder folder;
  VirtualStylus stylus;
  RegisterOptions options;
};

TEST_F(RegisterPatient, AStylusHeldStillGivesTheRegistration) {
  const auto report = value_or_fail(register_patient(options));
  EXPECT_EQ(report.poses, 245);
  EXPECT_EQ(report.poses_used, 245);
  EXPECT_THAT(report.held, SizeIs(5));
  EXPECT_LT(report.fiducials.fre_mm, 1e-5);  // coordinates with six decimals
  EXPECT_LT(error_mm(), 1e-5);
  const auto lines = report_lines(report);
  EXPECT_THAT(lines, Contains(HasSubstr("poses: 245 of 245 with a valid chain")));
  EXPECT_THAT(lines, Contains(HasSubstr("held still 5: ")));
  EXPECT_THAT(lines, Contains(AllOf(HasSubstr("residuals, mm: nasion 0.00"), HasSubstr("inion"))));
}

TEST_F(RegisterPatient, NoiseIsAveragedAndTheErrorsAreTold) {
  stylus.noise_mm = 0.2;
  stylus.rests[2] += Vec3(0, 3, 0);  // a marker that slipped
  record();
  const auto report = value_or_fail(register_patient(options));
  EXPECT_NEAR(report.held[0].spread_mm, 0.2 * std::sqrt(3.0), 0.08);
  EXPECT_EQ(report.fiducials.worst, 2);
  EXPECT_GT(report.fiducials.fre_mm, 0.5);
  EXPECT_GT(report.fiducials.tre_mm, 0.3);
  EXPECT_LT(error_mm(), 3.0 * report.fiducials.tre_mm);
  EXPECT_THAT(report_lines(report),
              Contains(AllOf(HasSubstr("at worst (right ear)"),
                             HasSubstr("expected error at (46.0, -47.0, 9.0) "))));
}

TEST_F(RegisterPatient, TheOrderMayBeFoundByShape) {
  std::swap(stylus.rests[0], stylus.rests[3]);
  stylus.rests.pop_back();  // one of the image's was not touched
  record();
  options.pairing = Pairing::kShape;
  const auto report = value_or_fail(register_patient(options));
  EXPECT_TRUE(report.fiducials.matched);
  EXPECT_THAT(report.names, ElementsAre("vertex", "left ear", "right ear", "nasion"));
  EXPECT_LT(error_mm(), 1e-5);
}

TEST_F(RegisterPatient, AHoldThatIsNoFiducialIsListedAndCanBeLeftOut) {
  stylus.rests.insert(stylus.rests.begin() + 2, Vec3(250, 100, -80));  // laid aside
  record();
  EXPECT_THAT(refusal(), AllOf(HasSubstr("6 fiducials were touched"), HasSubstr("holds 5"),
                               HasSubstr("3 at 5."), HasSubstr("choose with --holds")));
  options.holds = {1, 2, 4, 5, 6};
  const auto report = value_or_fail(register_patient(options));
  EXPECT_LT(error_mm(), 1e-5);
  EXPECT_THAT(report_lines(report),
              Contains(AllOf(HasSubstr("held still 3"), HasSubstr("not used"))));
}

TEST_F(RegisterPatient, ListsOfPointsArePairedByName) {
  std::string text = "name,x,y,z\n";
  for (const std::size_t i : {3U, 0U, 4U, 1U}) {
    const Vec3 at = VirtualStylus::T_ras_reference().inverse() * kFiducials[i];
    text += kNames[i] + "," + std::to_string(at.x()) + "," + std::to_string(at.y()) + "," +
            std::to_string(at.z()) + "\n";
  }
  options.recording.clear();
  options.fiducials = folder.write("touched.csv", text);
  const auto report = value_or_fail(register_patient(options));
  EXPECT_THAT(report.names, ElementsAre("vertex", "nasion", "inion", "left ear"));
  EXPECT_THAT(report.left_out, ElementsAre("right ear"));
  EXPECT_LT(error_mm(), 1e-5);
  options.out = folder / "again.txt";
  options.pairing = Pairing::kOrder;
  EXPECT_THAT(refusal(), HasSubstr("4 fiducials were touched"));
}

TEST_F(RegisterPatient, AListOfPairsNeedsNoOther) {
  std::string text;
  for (const Vec3& ras : kFiducials) {
    const Vec3 at = VirtualStylus::T_ras_reference().inverse() * ras;
    for (const double x : {at.x(), at.y(), at.z(), ras.x(), ras.y()})
      text += std::to_string(x) + ",";
    text += std::to_string(ras.z()) + "\n";
  }
  options.recording.clear();
  options.ras.clear();
  options.fiducials = folder.write("pairs.csv", text);
  value_or_fail(register_patient(options));
  EXPECT_LT(error_mm(), 1e-5);
}

TEST_F(RegisterPatient, FiducialsNearlyOnALineAreWarnedOf) {
  stylus.rests = {Vec3(0, 0, 0), Vec3(0, 50, 5), Vec3(0, 100, 0)};
  record();
  options.ras = folder.write("line.csv", "0,0,0\n0,50,5\n0,100,0\n");
  const auto report = value_or_fail(register_patient(options));
  const auto lines = report_lines(report);
  EXPECT_THAT(lines,
              Contains(HasSubstr("lie nearly on a line: a rotation about it is known 17 times")));
  EXPECT_THAT(lines, Contains(HasSubstr("three fiducials leave little")));
}

// Rows of points touched, changed as a user's list may be.
template <typename Change>
std::string touched_csv(const Change& change) {
  std::string text = "name,x,y,z\n";
  for (std::size_t i = 0; i < kFiducials.size(); ++i) {
    const Vec3 at = change(Vec3(VirtualStylus::T_ras_reference().inverse() * kFiducials[i]), i);
    text += kNames[i] + "," + std::to_string(at.x()) + "," + std::to_string(at.y()) + "," +
            std::to_string(at.z()) + "\n";
  }
  return text;
}

TEST_F(RegisterPatient, ListsThatNoHeadHasAreRefusedByTheirLikelyMistake) {
  options.recording.clear();
  const auto refused = [&](const auto& change) {
    options.fiducials = folder.write("touched.csv", touched_csv(change));
    return refusal();
  };
  const auto touched = [](std::size_t i) {
    return Vec3(VirtualStylus::T_ras_reference().inverse() * kFiducials[i]);
  };
  EXPECT_THAT(refused([&](const Vec3& x, std::size_t i) { return i < 2 ? touched(1 - i) : x; }),
              AllOf(HasSubstr("touched.csv and "), HasSubstr("fiducials.fcsv: fiducials: the best"),
                    HasSubstr("mm rms: must leave at most 10 mm; \"nasion\" and \"left ear\" "
                              "exchanged?")));
  EXPECT_THAT(refused([](const Vec3& x, std::size_t) { return Vec3(-x.x(), x.y(), x.z()); }),
              HasSubstr("at most 10 mm; with left and right exchanged?"));
  EXPECT_THAT(refused([](const Vec3& x, std::size_t i) { return i == 1 ? Vec3(1.5 * x) : x; }),
              HasSubstr("; are both lists of this head, mm, and in the same order?"));
}

TEST_F(RegisterPatient, APoorFitIsWarnedOf) {
  options.recording.clear();
  options.fiducials = folder.write("touched.csv", touched_csv([](const Vec3& x, std::size_t i) {
                                     return i == 1 ? Vec3(x + Vec3(0, 0, 18)) : x;
                                   }));
  const auto report = value_or_fail(register_patient(options));
  EXPECT_GT(report.fiducials.fre_mm, 5.0);
  EXPECT_THAT(report_lines(report),
              Contains(HasSubstr("note: a registration error above 5 mm rms is poor")));
}

TEST_F(RegisterPatient, ATargetOutsideOfTheHeadIsRefused) {
  options.target = Vec3(46, -47, 900);
  EXPECT_THAT(refusal(), AllOf(HasSubstr("--target (46.0, -47.0, 900.0) lies "),
                               HasSubstr("from the middle of the fiducials in the image"),
                               HasSubstr("must lie within 300 mm")));
  options.target = Vec3(0.046, -0.047, 0.009);
  EXPECT_THAT(refusal(), HasSubstr("--target (0.046, -0.047, 0.009) lies within 0.1 mm of the "
                                   "origin; in metres it would be (46.0, -47.0, 9.0) mm"));
}

TEST_F(RegisterPatient, PosesThatTheTrackerLostAreLeftOut) {
  SequenceContent content = stylus.content();
  for (std::size_t i = 20; i < 25; ++i)
    content.frames[i]["StylusToTrackerTransformStatus"] = "INVALID";
  options.recording = folder.write("s.mha", test_support::meta_text(content, false));
  const auto report = value_or_fail(register_patient(options));
  EXPECT_EQ(report.poses_used, 240);
  EXPECT_THAT(
      report_lines(report),
      Contains(HasSubstr("poses left out: 5 because StylusToTracker is invalid (first: pose 20)")));
  EXPECT_LT(error_mm(), 1e-5);
}

TEST_F(RegisterPatient, HoldsNeedTimes) {
  SequenceContent content = stylus.content();
  for (auto& frame : content.frames) frame["Timestamp"] = "7";
  options.recording = folder.write("s.mha", test_support::meta_text(content, false));
  EXPECT_THAT(refusal(), HasSubstr("s.mha: all 245 poses have the time 7 s"));
}

TEST_F(RegisterPatient, PointsThatNobodyPlacedAreNoFiducials) {
  options.recording.clear();
  std::string touched = "name,x,y,z\n", ras = "label,r,a,s,defined\n";
  for (std::size_t i = 0; i < kFiducials.size(); ++i) {
    const Vec3 at = VirtualStylus::T_ras_reference().inverse() * kFiducials[i];
    const Vec3 image = i == 3 ? Vec3::Zero() : kFiducials[i];
    const auto row = [&](const Vec3& x) {
      return kNames[i] + "," + std::to_string(x[0]) + "," + std::to_string(x[1]) + "," +
             std::to_string(x[2]);
    };
    touched += row(at) + "\n";
    ras += row(image) + (i == 3 ? ",0\n" : ",1\n");
  }
  options.fiducials = folder.write("touched.csv", touched);
  options.ras = folder.write("ras.csv", ras);
  EXPECT_EQ(value_or_fail(register_patient(options)).left_out, std::vector<std::string>{"vertex"});
  EXPECT_LT(error_mm(), 1e-5);
}

TEST_F(RegisterPatient, NamesWhatIsMissingOrTooMuch) {
  const auto with = [&](auto change) {
    const RegisterOptions keep = options;
    change(options);
    const std::string message = refusal();
    options = keep;
    return message;
  };
  using O = RegisterOptions;
  EXPECT_THAT(with([](O& o) { o.recording.clear(); }), HasSubstr("--recording and --fiducials is"));
  EXPECT_THAT(with([](O& o) { o.fiducials = "a.csv"; }), HasSubstr("both given"));
  EXPECT_THAT(with([](O& o) { o.ras.clear(); }), HasSubstr("--ras is required"));
  EXPECT_THAT(with([](O& o) { o.out.clear(); }), HasSubstr("--out is required"));
  EXPECT_THAT(with([](O& o) { o.target.reset(); }), HasSubstr("0 given"));
  EXPECT_THAT(with([](O& o) { o.model = "a.h5"; }), HasSubstr("2 given"));
  EXPECT_THAT(with([](O& o) { o.target = Vec3(0, std::nan(""), 0); }), HasSubstr("--target"));
  EXPECT_THAT(with([](O& o) {
                o.holds = {1, 9};
              }),
              HasSubstr("--holds 9: must be numbers from 1 to 5"));
  EXPECT_THAT(with([](O& o) { o.holds = {1, 1, 2}; }), HasSubstr("--holds 1"));
  EXPECT_THAT(with([](O& o) { o.hold.least_s = 0.0; }), HasSubstr("--still-s 0: must be"));
  EXPECT_THAT(with([](O& o) { o.hold.radius_mm = std::nan(""); }), HasSubstr("--still-mm nan"));
  EXPECT_THAT(with([](O& o) { o.hold.least_s = 30.0; }),
              HasSubstr("never stays within 1 mm for 30 s"));
  EXPECT_THAT(with([](O& o) { o.device.clear(); }), HasSubstr("s.mha: no chain from StylusTip"));
  EXPECT_THAT(with([](O& o) { o.tip_frame = "Needle"; }), HasSubstr("Needle"));
  EXPECT_THAT(with([](O& o) { o.pairing = Pairing::kName; }), HasSubstr("has no name"));
  EXPECT_THAT(with([](O& o) { o.ras = "nowhere.fcsv"; }), HasSubstr("nowhere.fcsv"));
  EXPECT_THAT(with([](O& o) { o.recording = "nowhere.mha"; }), HasSubstr("nowhere.mha"));
  EXPECT_THAT(with([](O& o) { o.device = "nowhere.xml"; }), HasSubstr("nowhere.xml"));
  EXPECT_THAT(with([](O& o) { o.target.reset(), o.model = "nowhere.h5"; }),
              HasSubstr("nowhere.h5"));
  stylus.rests.resize(2);
  record();
  options.ras = folder.write("two.csv", "0,95,0\n-70,10,-20\n");
  EXPECT_THAT(refusal(), HasSubstr("at least 3 needed"));
}

TEST_F(RegisterPatient, AnExistingFileIsLeftAlone) {
  folder.write("T_ras_reference.txt", "mine");
  EXPECT_THAT(refusal_of(register_patient(options), ErrorCode::kInvalidArgument),
              HasSubstr("exists already"));
}

}  // namespace
}  // namespace brainshift::client
