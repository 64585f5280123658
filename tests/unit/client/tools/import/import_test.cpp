// SPDX-License-Identifier: GPL-3.0-or-later
// A virtual sweep over an ellipsoid of known place, imported: the points must lie on its surface.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "client/tools/import/import.hpp"
#include "client/tools/import/import_case.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/wire/convert.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/toy_journal.hpp"
#include "tests/support/virtual_sweep.hpp"

namespace brainshift::client {
namespace {

using test_support::TemporaryFolder;
using testing::HasSubstr;

TEST(ImportCase, APreparedModelSaysWhoseItIs) {
  const TemporaryFolder folder;
  const BrainModel model = test_support::toy_model(5);
  test_support::write_toy_model(folder / "toy.h5", model);
  const auto known = value_or_fail(load_import_case({}, folder / "toy.h5"));
  EXPECT_LT((known.tumour_centroid() - Vec3(30, 30, 40)).norm(), 0.1);
  const io::SurgeryMeta meta = known.meta("a sweep", "a test");
  EXPECT_EQ(meta.case_id, "toy");
  EXPECT_EQ(meta.model_id, model.model_id);
  EXPECT_EQ(meta.case_file, (folder / "toy.yaml").string());
  EXPECT_EQ(meta.scenario, "a sweep");
  EXPECT_EQ(meta.software, "a test");
}

TEST(ImportCase, ExactlyOneOfTheTwoIsGiven) {
  EXPECT_TRUE(check_one_case("a.yaml", {}));
  EXPECT_TRUE(check_one_case({}, "a.h5"));
  EXPECT_THAT(check_one_case({}, {}).error().message, HasSubstr("none given"));
  EXPECT_THAT(check_one_case("a.yaml", "a.h5").error().message, HasSubstr("both given"));
}

TEST(ImportCase, WhatIsMissingIsNamed) {
  EXPECT_EQ(load_import_case({}, "nowhere.h5").error().code, ErrorCode::kNotFound);
  EXPECT_THAT(sentence_of(load_import_case("nowhere.yaml", {})), HasSubstr("nowhere.yaml"));
}

using test_support::SequenceContent;
using test_support::VirtualSweep;
using testing::AllOf;

// The toy patient's tumour is a ball at (30, 30, 40); the ellipsoid lies there, a little moved.
VirtualSweep sweep_at_tumour() {
  VirtualSweep sweep;
  sweep.centre_mm = Vec3(32, 29, 41);
  return sweep;
}

class Import : public testing::Test {
 protected:
  void SetUp() override {
    options.recording = write("sweep.igs.mha", test_support::meta_text(content, true));
    options.device = write("device.xml", sweep.device_text());
    options.contours = write_contours("contours.csv");
    options.registration =
        write("registration.txt", test_support::matrix_text(sweep.T_ras_reference().matrix()));
    options.model = write_model();
    options.out = folder / "sweep.surgery";
  }

  std::filesystem::path write(const std::string& name, const std::string& text) {
    return folder.write(name, text);
  }

  std::filesystem::path write_contours(const std::string& name) {
    std::string text = "frame,u_px,v_px\n";
    for (int frame = 0; frame < sweep.frames; ++frame) {
      const auto contour = sweep.section(frame);
      for (Eigen::Index i = 0; i < contour.points_px.cols(); ++i) {
        text += std::to_string(frame) + "," + std::to_string(contour.points_px(0, i)) + "," +
                std::to_string(contour.points_px(1, i)) + "\n";
      }
    }
    return write(name, text);
  }

  std::filesystem::path write_model() {
    const BrainModel model = test_support::toy_model(5);
    model_id = model.model_id;
    const auto path = folder / "toy.h5";
    test_support::write_toy_model(path, model);
    return path;
  }

  // The observations of the surgery file that was made.
  std::vector<Observation> observations() const {
    const auto file = io::SurgeryFile::open(options.out).value();
    std::vector<Observation> result;
    const auto records = file.records(io::RecordKind::kObservation).value();
    for (const auto& record : records) {
      result.push_back(wire::decode_observation(record.payload).value());
    }
    return result;
  }

  std::vector<double> distances(const Observation& observation) const {
    const Points& points = std::get<TumourBoundary>(observation.body).points;
    std::vector<double> result;
    for (Eigen::Index i = 0; i < points.cols(); ++i)
      result.push_back(sweep.distance_mm(points.col(i)));
    std::sort(result.begin(), result.end());
    return result;
  }

  std::string refusal() {
    const auto report = import_recording(options);
    EXPECT_FALSE(std::filesystem::exists(options.out)) << "something was left behind";
    return report ? std::string() : report.error().message;
  }

  TemporaryFolder folder;
  VirtualSweep sweep = sweep_at_tumour();
  SequenceContent content = sweep.content();
  ImportOptions options;
  std::string model_id;
};

TEST_F(Import, PutsTracedContoursOntoTheSurface) {
  const auto report = value_or_fail(import_recording(options));
  EXPECT_EQ(report.frames, 21);
  EXPECT_EQ(report.frames_used, 21);
  EXPECT_TRUE(report.notes.empty());
  const auto made = observations();
  ASSERT_EQ(made.size(), 1U);
  EXPECT_EQ(made[0].case_id, "toy");
  EXPECT_EQ(made[0].source, "ius");
  EXPECT_EQ(made[0].frame, "ras");
  EXPECT_EQ(made[0].sequence, 1U);
  EXPECT_DOUBLE_EQ(std::get<TumourBoundary>(made[0].body).sd_mm, 0.5);
  const auto mm = distances(made[0]);
  ASSERT_GT(mm.size(), 2000U);
  EXPECT_LT(mm.back(), 0.01);  // chords of 720 corners
  const auto file = io::SurgeryFile::open(options.out).value();
  EXPECT_EQ(file.meta().model_id, model_id);
  EXPECT_EQ(file.meta().case_id, "toy");
  EXPECT_EQ(report.sweeps[0].points, static_cast<Eigen::Index>(mm.size()));
  EXPECT_NEAR(report.sweeps[0].tumour_distance_mm, Vec3(2, -1, 1).norm(), 1.0);
}

TEST_F(Import, TracesFromASeedWithinAPixel) {
  sweep.speckle = 0.2;
  content = sweep.content();
  for (const bool nrrd : {false, true}) {
    options.out = folder / (nrrd ? "b.surgery" : "a.surgery");
    options.recording = nrrd ? write("s.seq.nrrd", test_support::nrrd_text(content, true))
                             : write("s.igs.mha", test_support::meta_text(content, false));
    options.contours.clear();
    options.seeds = write("seeds.csv", "10,89.5,79.5\n");
    const auto report = value_or_fail(import_recording(options));
    EXPECT_THAT(report.notes[0], HasSubstr("bright lesion traced on frames 0 to 20"));
    const auto mm = distances(observations().at(0));
    ASSERT_GT(mm.size(), 2000U);
    // A pixel is 0.2 x 0.25 mm.
    EXPECT_LT(mm[mm.size() / 2], 0.25);
    EXPECT_LT(mm[mm.size() * 95 / 100], 0.5);
  }
}

TEST_F(Import, FramesThatLostTheProbeAreLeftOutAndCounted) {
  content.frames[3]["ProbeToTrackerTransformStatus"] = "INVALID";
  content.frames[4]["ImageStatus"] = "INVALID";
  content.frames[9]["ProbeToTrackerTransform"] = "2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1";
  options.recording = write("s.mha", test_support::meta_text(content, true));
  const auto report = value_or_fail(import_recording(options));
  EXPECT_EQ(report.frames_used, 18);
  ASSERT_EQ(report.dropped.size(), 2U);
  EXPECT_EQ(report.dropped[0].reason, "ProbeToTracker is invalid");
  EXPECT_EQ(report.dropped[0].count, 2);
  EXPECT_EQ(report.dropped[0].first_frame, 3);
  EXPECT_THAT(report.notes, testing::ElementsAre(AllOf(
                                HasSubstr("ProbeToTrackerTransform is not usable on 1 frames"),
                                HasSubstr("Seq_Frame0009_ProbeToTrackerTransform"))));
  EXPECT_LT(distances(observations().at(0)).back(), 0.01);
}

// The probe's clock: images are stamped 40 ms after they were seen.
TEST_F(Import, LatencyIsTakenBackByInterpolation) {
  // Images stamped late: frame i shows what was seen at the sweep's
  // time i - 0.4, between two poses.
  VirtualSweep fine = sweep;
  fine.frames = 201;  // ten poses per frame of the recording
  const SequenceContent poses = fine.content();
  std::string text = "frame,u_px,v_px\n";
  SequenceContent late = content;
  for (int i = 0; i < 21; ++i) {
    for (const char* name : {"ProbeToTrackerTransform", "ReferenceToTrackerTransform"}) {
      late.frames[static_cast<std::size_t>(i)][name] =
          poses.frames[static_cast<std::size_t>(10 * i)].at(name);
    }
    if (i == 0) continue;
    const auto contour = fine.section(10 * i - 4);
    for (Eigen::Index k = 0; k < contour.points_px.cols(); ++k) {
      text += std::to_string(i) + "," + std::to_string(contour.points_px(0, k)) + "," +
              std::to_string(contour.points_px(1, k)) + "\n";
    }
  }
  options.recording = write("late.mha", test_support::meta_text(late, true));
  options.contours = write("late.csv", text);
  options.latency_ms = 40.0;
  ASSERT_TRUE(import_recording(options));
  const double with = distances(observations().at(0)).back();
  std::filesystem::remove(options.out);
  options.latency_ms = 0.0;
  ASSERT_TRUE(import_recording(options));
  const double without = distances(observations().at(0)).back();
  EXPECT_LT(with, 0.02);
  EXPECT_GT(without, 0.2);
}

TEST_F(Import, TimeGapsSplitSweeps) {
  for (std::size_t i = 8; i < 21; ++i) {
    content.frames[i]["Timestamp"] = std::to_string(1000.0 + 0.1 * static_cast<double>(i) + 5.0);
  }
  options.recording = write("s.mha", test_support::meta_text(content, true));
  options.sweep_gap_s = 2.0;
  const auto report = value_or_fail(import_recording(options));
  const auto made = observations();
  ASSERT_EQ(made.size(), 2U);
  EXPECT_EQ(made[1].sequence, 2U);
  EXPECT_NEAR(static_cast<double>(made[0].acquired_ns), 0.7e9, 1e3);
  EXPECT_NEAR(static_cast<double>(made[1].acquired_ns), 7.0e9, 1e3);
  EXPECT_EQ(report.sweeps[0].last_frame, 7);
  EXPECT_EQ(report.sweeps[1].first_frame, 8);
}

// Fiducials on the head, touched without error: the same surgery as
// from the matrix they belong to.
TEST_F(Import, FiducialsGiveTheRegistrationAndItsErrorAtTheTumour) {
  ASSERT_TRUE(import_recording(options));
  const Points from_matrix = std::get<TumourBoundary>(observations().front().body).points;
  std::string text;
  for (const Vec3& ras : {Vec3(0, 0, 0), Vec3(60, 5, 0), Vec3(0, 60, 10), Vec3(50, 55, 60)}) {
    const Vec3 reference = sweep.T_ras_reference().inverse() * ras;
    for (const double x : {reference.x(), reference.y(), reference.z(), ras.x(), ras.y()}) {
      text += std::to_string(x) + ",";
    }
    text += std::to_string(ras.z()) + "\n";
  }
  options.fiducials = write("fiducials.csv", text);
  options.registration.clear();
  options.out = folder / "again.surgery";
  const auto report = value_or_fail(import_recording(options));
  const Points points = std::get<TumourBoundary>(observations().front().body).points;
  EXPECT_LT((points - from_matrix).cwiseAbs().maxCoeff(), 1e-4);
  ASSERT_TRUE(report.fiducials.has_value());
  EXPECT_EQ(report.fiducials->count, 4);
  EXPECT_LT(report.fiducials->tre_mm, 1e-4);
  EXPECT_THAT(report_lines(report), testing::Contains(HasSubstr("fiducials: 4, registration")));
}

TEST_F(Import, AFarBoundaryIsRefusedWithItsDistance) {
  RigidTransform far = sweep.T_ras_reference();
  far.translation().x() += 250.0;
  options.registration = write("far.txt", test_support::matrix_text(far.matrix()));
  EXPECT_THAT(refusal(), AllOf(HasSubstr("lies 252 mm from the tumour of case toy"),
                               HasSubstr("within 100 mm")));
}

TEST_F(Import, MetresAreNamed) {
  VirtualSweep metres = sweep;
  std::string device = metres.device_text();
  AffineTransform T = metres.T_probe_image();
  T.matrix().topRows<3>() *= 1e-3;
  const std::string matrix = test_support::matrix_text(metres.T_probe_image().matrix());
  device.replace(device.find(matrix), matrix.size(), test_support::matrix_text(T.matrix()));
  options.device = write("metres.xml", device);
  EXPECT_THAT(refusal(),
              AllOf(HasSubstr("a pixel of frame 0 is 0.0002 mm wide"), HasSubstr("metres")));
}

TEST_F(Import, TrackingInMetresIsNoted) {
  for (auto& frame : content.frames) {
    for (const char* name : {"ProbeToTrackerTransform", "ReferenceToTrackerTransform"}) {
      std::istringstream in(frame[name]);
      Eigen::Matrix4d matrix;
      for (int i = 0; i < 16; ++i) in >> matrix(i / 4, i % 4);
      matrix.topRightCorner<3, 1>() *= 1e-3;
      frame[name] = test_support::matrix_text(matrix);
    }
  }
  options.recording = write("metres.mha", test_support::meta_text(content, true));
  const auto report = value_or_fail(import_recording(options));
  EXPECT_THAT(report.notes,
              testing::Contains(HasSubstr("ProbeToTracker is never farther than 1.54")));
}

TEST_F(Import, NamesWhatIsMissing) {
  const auto with = [&](auto change) {
    const ImportOptions keep = options;
    change(options);
    const std::string message = refusal();
    options = keep;
    return message;
  };
  using O = ImportOptions;
  EXPECT_THAT(with([](O& o) { o.recording.clear(); }), HasSubstr("--recording is required"));
  EXPECT_THAT(with([](O& o) { o.registration.clear(); }),
              HasSubstr("--registration and --fiducials"));
  EXPECT_THAT(with([](O& o) { o.contours.clear(); }),
              HasSubstr("exactly one of --contours and --seeds"));
  EXPECT_THAT(with([](O& o) { o.seeds = o.contours; }), HasSubstr("both given"));
  EXPECT_THAT(with([](O& o) { o.model.clear(); }), HasSubstr("exactly one of --case and --model"));
  EXPECT_THAT(with([](O& o) { o.sd_mm = 0.0; }), HasSubstr("--sd-mm 0"));
  EXPECT_THAT(with([](O& o) { o.latency_ms = 5000.0; }), HasSubstr("--latency-ms 5000"));
  EXPECT_THAT(with([](O& o) { o.max_age_ms = -1.0; }), HasSubstr("--max-age-ms -1"));
  EXPECT_THAT(with([](O& o) { o.sweep_gap_s = std::nan(""); }), HasSubstr("--sweeps nan"));
  EXPECT_THAT(with([](O& o) { o.device.clear(); }), HasSubstr("no chain from Image to Ras"));
  EXPECT_THAT(with([](O& o) { o.reference_frame = "Patient"; }),
              HasSubstr("no chain from Image to Ras"));
  EXPECT_THAT(with([](O& o) { o.model = o.device; }), HasSubstr("device.xml"));
  options.contours = write("beyond.csv", "21,1,1\n21,2,1\n21,2,2\n");
  EXPECT_THAT(refusal(), HasSubstr("contour on frame 21: the recording has frames 0 to 20"));
  options.contours = write("timed.csv", "time_s,u_px,v_px\n10.5,1,1\n10.5,2,1\n10.5,2,2\n");
  EXPECT_THAT(refusal(), HasSubstr("time_s names live images"));
  options.contours = write("outside.csv", "10,1,1\n10,180,1\n10,1,3\n");
  EXPECT_THAT(
      refusal(),
      HasSubstr("contour on frame 10: 180 1 px lies outside the image of 180 x 160 pixels"));
  options.contours = write("tiny.csv", "10,1,1\n10,3,1\n10,1,3\n");
  EXPECT_THAT(refusal(), HasSubstr("the boundary of frames 10 to 10 spans 0."));
  options.contours.clear();
  options.seeds = write("seed.csv", "10,5,5\n");
  EXPECT_THAT(refusal(), HasSubstr("no boundary found on frame 10"));
}

TEST_F(Import, WhenEveryContourIsLostItSaysWhy) {
  for (auto& frame : content.frames) frame["ReferenceToTrackerTransformStatus"] = "INVALID";
  options.recording = write("s.mha", test_support::meta_text(content, true));
  EXPECT_THAT(refusal(), HasSubstr("ReferenceToTracker is invalid (21 frames, first 0)"));
}

TEST_F(Import, NeverOverwritesASurgery) {
  std::ofstream(options.out) << "kept";
  refusal_of(import_recording(options), ErrorCode::kInvalidArgument);
  EXPECT_EQ(test_support::content_of(options.out), "kept");
}

TEST_F(Import, ReportTellsChainFramesAndPoints) {
  content.frames[3]["ProbeToTrackerTransformStatus"] = "INVALID";
  options.recording = write("s.mha", test_support::meta_text(content, true));
  const auto report = value_or_fail(import_recording(options));
  const std::string text = testing::PrintToString(report_lines(report));
  for (const char* part :
       {"chain: ImageToProbe, ProbeToTracker, ReferenceToTracker, ReferenceToRas",
        "frames: 20 of 21 with a valid chain",
        "frames left out: 1 because ProbeToTracker is invalid", "contours left out: 1 because",
        "sweep 1: frames 0 to 20, 20 contours"}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
}

}  // namespace
}  // namespace brainshift::client
