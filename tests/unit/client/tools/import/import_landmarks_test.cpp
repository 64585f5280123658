// SPDX-License-Identifier: GPL-3.0-or-later
// Landmarks of the toy patient (a box of 60 mm) become the surgery that was written into them.
#include "client/tools/import/import_landmarks.hpp"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cstdlib>
#include <numbers>

#include "common/io/recording/surgery_file.hpp"
#include "common/values/model_id.hpp"
#include "common/wire/convert.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/toy_journal.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::client {
namespace {

using test_support::TemporaryFolder;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

const std::vector<Vec3> kBefore = {Vec3(10, 10, 50), Vec3(50, 12, 45), Vec3(30, 50, 55),
                                   Vec3(25, 30, 20), Vec3(40, 35, 40)};

class ImportLandmarks : public testing::Test {
 protected:
  void SetUp() override {
    options.landmarks =
        write_pairs("pairs.csv", [](const Vec3& x) { return Vec3(x + Vec3(0, 1, -3)); });
    options.model = write_model(test_support::toy_patient());
    options.out = folder / "landmarks.surgery";
  }

  template <typename Motion>
  std::filesystem::path write_pairs(const std::string& name, const Motion& motion) const {
    std::string text = "label,x_before,y_before,z_before,x_during,y_during,z_during\n";
    for (std::size_t i = 0; i < kBefore.size(); ++i) {
      const Vec3 after = motion(kBefore[i]);
      text += "L" + std::to_string(i + 1);
      for (const Vec3& at : {kBefore[i], after}) {
        for (const double x : at) text += "," + std::to_string(x);
      }
      text += "\n";
    }
    return folder.write(name, text);
  }

  std::filesystem::path write_model(BrainModel model) const {
    model.case_id = "toy";
    model.model_id = content_hash(model);
    const auto path = folder / "toy.h5";
    test_support::write_toy_model(path, model);
    return path;
  }

  Observation made() const {
    const auto file = io::SurgeryFile::open(options.out).value();
    const auto records = file.records(io::RecordKind::kObservation).value();
    EXPECT_EQ(records.size(), 1U);
    return wire::decode_observation(records.at(0).payload).value();
  }

  std::string refusal() const {
    const std::string sentence = sentence_of(import_landmarks(options));
    EXPECT_FALSE(std::filesystem::exists(options.out)) << "something was left behind";
    return sentence;
  }

  TemporaryFolder folder;
  LandmarkOptions options;
};

TEST_F(ImportLandmarks, PairsBecomeOneObservation) {
  options.sd_mm = 0.8;
  value_or_fail(import_landmarks(options));
  const Observation observation = made();
  EXPECT_EQ(observation.case_id, "toy");
  EXPECT_EQ(observation.source, "landmarks");
  EXPECT_EQ(observation.frame, "ras");
  EXPECT_EQ(observation.sequence, 1U);
  const auto& pairs = std::get<LandmarkPairs>(observation.body);
  EXPECT_DOUBLE_EQ(pairs.sd_mm, 0.8);
  ASSERT_EQ(pairs.undeformed.cols(), 5);
  for (Eigen::Index i = 0; i < 5; ++i) {
    const Vec3 before = kBefore[static_cast<std::size_t>(i)];
    EXPECT_LT((pairs.undeformed.col(i) - before).norm(), 1e-6);
    EXPECT_LT((pairs.deformed.col(i) - before - Vec3(0, 1, -3)).norm(), 1e-6);
  }
  EXPECT_EQ(io::SurgeryFile::open(options.out).value().meta().scenario, "pairs");
}

TEST_F(ImportLandmarks, TheRigidPartIsToldAndKept) {
  const Vec3 centre(31, 27.4, 42);  // of kBefore
  const auto turned = [&](const Vec3& x) {
    return Vec3(centre +
                Eigen::AngleAxisd(6.0 * std::numbers::pi / 180.0, Vec3(1, 1, 0).normalized()) *
                    (x - centre) +
                Vec3(2, 0, 0));
  };
  options.landmarks = write_pairs("turned.csv", turned);
  const auto report = value_or_fail(import_landmarks(options));
  ASSERT_TRUE(report.rigid);
  EXPECT_NEAR(report.rigid->rotation_deg, 6.0, 1e-4);
  EXPECT_NEAR(report.rigid->translation_mm, 2.0, 1e-4);
  EXPECT_LT(report.rigid->residual_mm, 1e-5);
  EXPECT_THAT(report_lines(report),
              Contains(HasSubstr("rigid part: rotation 6.00 degrees, translation 2.00 mm")));
  const Observation observation = made();
  const auto& pairs = std::get<LandmarkPairs>(observation.body);
  EXPECT_LT((pairs.deformed.col(2) - turned(kBefore[2])).norm(), 1e-5);
}

TEST_F(ImportLandmarks, TwoListsArePairedByName) {
  const auto before = folder.write("b.csv", "a,10,10,50\nb,50,12,45\nc,30,50,55\nd,25,30,20\n");
  options.landmarks_moved = folder.write("d.csv", "e,1,1,1\nc,30,50,53\nb,50,12,44\na,10,10,49\n");
  options.landmarks = before;
  const auto report = value_or_fail(import_landmarks(options));
  EXPECT_EQ(report.pairs, 3);
  EXPECT_THAT(report.left_out, ElementsAre("d", "e"));
  EXPECT_NEAR(report.mean_mm, 4.0 / 3.0, 1e-12);
  EXPECT_NEAR(report.rms_mm, std::sqrt(2.0), 1e-12);
  EXPECT_EQ(report.largest, "landmark \"c\"");
  EXPECT_THAT(report_lines(report), Contains(HasSubstr("only one file has it: \"d\"")));
}

TEST_F(ImportLandmarks, LandmarksOnALineHaveNoRigidPart) {
  options.landmarks = folder.write("l.csv", "0,0,5,0,0,5\n0,0,15,0,0,14\n0,0,25,0,0,23\n");
  const auto report = value_or_fail(import_landmarks(options));
  EXPECT_FALSE(report.rigid);
  EXPECT_THAT(report_lines(report), Contains(AllOf(HasSubstr("no rigid part can be computed"),
                                                   HasSubstr("on one line"))));
}

TEST_F(ImportLandmarks, LandmarksBesideTheBrainAreToldAndFarOnesRefused) {
  options.landmarks =
      folder.write("out.csv", "a,10,10,50,10,10,49\nb,50,12,45,50,12,44\nc,30,30,66,30,30,65\n");
  const auto report = value_or_fail(import_landmarks(options));
  EXPECT_EQ(report.outside, 1);
  EXPECT_NEAR(report.farthest_outside_mm, 6.0, 1e-9);
  EXPECT_THAT(report_lines(report), Contains(HasSubstr("at most 6.0 mm (landmark \"c\")")));
  std::filesystem::remove(options.out);
  options.landmarks =
      folder.write("far.csv", "a,10,10,50,10,10,49\nb,50,12,45,50,12,44\nc,30,30,90,30,30,89\n");
  EXPECT_THAT(refusal(), AllOf(HasSubstr("far.csv: landmark \"c\" lies at (30.0, 30.0, 90.0)"),
                               HasSubstr("30 mm outside the brain of case toy")));
}

TEST_F(ImportLandmarks, ListsInDifferentFramesAreRefused) {
  options.landmarks =
      write_pairs("lps.csv", [](const Vec3& x) { return Vec3(-x.x(), -x.y(), x.z()); });
  EXPECT_THAT(refusal(), AllOf(HasSubstr("landmark \"L2\" moved 103 mm: must be within 60 mm"),
                               HasSubstr("RAS")));
}

TEST_F(ImportLandmarks, NamesWhatIsMissing) {
  const auto with = [&](auto change) {
    const LandmarkOptions keep = options;
    change(options);
    const std::string message = refusal();
    options = keep;
    return message;
  };
  using O = LandmarkOptions;
  EXPECT_THAT(with([](O& o) { o.landmarks.clear(); }), HasSubstr("--landmarks is required"));
  EXPECT_THAT(with([](O& o) { o.out.clear(); }), HasSubstr("--out is required"));
  EXPECT_THAT(with([](O& o) { o.model.clear(); }), HasSubstr("--case and --model"));
  EXPECT_THAT(with([](O& o) { o.case_file = "a.yaml"; }), HasSubstr("both given"));
  EXPECT_THAT(with([](O& o) { o.sd_mm = 0.0; }), HasSubstr("--sd-mm 0"));
  EXPECT_THAT(with([](O& o) { o.sd_mm = std::nan(""); }), HasSubstr("--sd-mm nan"));
  EXPECT_THAT(with([](O& o) { o.landmarks = "nowhere.tag"; }), HasSubstr("nowhere.tag"));
  EXPECT_THAT(with([](O& o) { o.landmarks_moved = "nowhere.csv"; }), HasSubstr(".csv"));
  EXPECT_THAT(with([](O& o) { o.model = "nowhere.h5"; }), HasSubstr("nowhere.h5"));
  options.landmarks = folder.write("two.csv", "1,2,3,1,2,3\n4,5,6,4,5,6\n");
  EXPECT_THAT(refusal(), HasSubstr("two.csv: 2 landmark pairs: at least 3"));
}

// RESECT, patient 4 (Xiao et al. 2017, doi:10.1002/mp.12268). The figures are those of the data's
// description, found with another program.
TEST_F(ImportLandmarks, RealLandmarksHaveTheRigidPartThatIsKnownOfThem) {
  const char* data = std::getenv("BRAINSHIFT_EXTERNAL_DATA");
  if (data == nullptr) GTEST_SKIP() << "BRAINSHIFT_EXTERNAL_DATA is not set";
  const auto resect = std::filesystem::path(data) / "resect_case4";
  // The patient's brain is not part of the data: a box around the landmarks stands for it.
  BrainModel model = test_support::toy_patient();
  for (Points* points : {&model.mesh.nodes, &model.skull.vertices, &model.tumour.vertices}) {
    points->colwise() += Vec3(10, -20, -50);
  }
  options.model = write_model(model);
  Points deformed[2];
  for (const int tag : {0, 1}) {
    options.landmarks = resect / (tag == 1 ? "Case4-MRI-beforeUS.tag" : "Case4-MRI-beforeUS.csv");
    options.out = folder / (tag == 1 ? "tag.surgery" : "csv.surgery");
    const auto report = value_or_fail(import_landmarks(options));
    EXPECT_EQ(report.pairs, 15);
    EXPECT_NEAR(report.mean_mm, 2.986, 5e-4);
    EXPECT_NEAR(report.rms_mm, 3.112, 5e-4);
    ASSERT_TRUE(report.rigid);
    EXPECT_NEAR(report.rigid->residual_mm, 1.164, 5e-4);
    EXPECT_NEAR(report.rigid->rotation_deg, 5.9, 0.05);
    const Observation observation = made();
    deformed[tag] = std::get<LandmarkPairs>(observation.body).deformed;
  }
  EXPECT_EQ(deformed[0], deformed[1]);
}

}  // namespace
}  // namespace brainshift::client
