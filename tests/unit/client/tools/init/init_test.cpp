// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/init/init.hpp"

#include <gmock/gmock.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "client/tools/preview/case_view.hpp"
#include "common/io/config/config_file.hpp"
#include "common/io/fields/field_files.hpp"
#include "common/io/geometry/label_map_file.hpp"
#include "tests/support/dicom_files.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/io/dicom/dicom_bytes.hpp"

namespace brainshift::client {
namespace {

using test_support::TemporaryFolder;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// Value of a place, mm RAS, in voxels of 3 mm.
template <typename Value>
VoxelImage drawn(const Value& value) {
  VoxelImage image;
  image.dims = {70, 80, 80};
  image.T_ras_voxel.linear() *= 3.0;
  image.T_ras_voxel.translation() = Vec3(-105, -120, -130);
  for (int k = 0; k < 80; ++k) {
    for (int j = 0; j < 80; ++j) {
      for (int i = 0; i < 70; ++i) image.values.push_back(value(image.T_ras_voxel * Vec3(i, j, k)));
    }
  }
  return image;
}

// An ellipsoid of cerebrum with a brainstem below, and lesions on the right.
float label_at(const Vec3& x) {
  const Vec3 in = x.cwiseQuotient(Vec3(70, 85, 65));
  if (Vec3(x - Vec3(0, -20, 0)).head<2>().norm() < 15.0 && x.z() < 0.0 && x.z() > -90.0) return 16;
  return in.norm() < 1.0 ? 41.0F : 0.0F;
}
float lesion_at(const Vec3& x) {
  const double away = (x - Vec3(40, 0, 30)).norm();
  return away < 6.0 ? 1.0F : away < 9.0 ? 4.0F : away < 16.0 ? 2.0F : 0.0F;
}

class FirstCase : public testing::Test {
 protected:
  FirstCase() {
    put("t1.nii", drawn([](const Vec3& x) { return label_at(x) > 0.0F ? 100.0F : 20.0F; }));
    put("labels.nii", drawn(label_at));
    put("brain.nii", drawn([](const Vec3& x) { return label_at(x) > 0.0F ? 1.0F : 0.0F; }));
    put("tumour.nii", drawn(lesion_at));
    options.mri = folder / "t1.nii";
    options.labels = folder / "labels.nii";
    options.tumour = folder / "tumour.nii";
    options.position = "supine,left-30";
    options.out = folder / "case.yaml";
  }
  void put(const std::string& name, const VoxelImage& image) {
    ASSERT_TRUE(
        io::write_nifti(folder / name, {{image.dims, image.T_ras_voxel}, image.values, ""}));
  }
  std::string refusal() {
    return refusal_of(write_first_case(options), ErrorCode::kInvalidArgument);
  }
  CaseConfig written() {
    value_or_fail(write_first_case(options));
    return value_or_fail(io::read_case_config(options.out));
  }
  TemporaryFolder folder;
  InitOptions options;
};

TEST_F(FirstCase, FromLabelsCanBePreparedAndSaysWhereEachGuessComesFrom) {
  const CaseConfig config = written();
  EXPECT_EQ(config.case_id, "case");
  EXPECT_EQ(config.brain, folder / "case-brain.nii.gz");
  EXPECT_LT((config.brainstem.centre_mm - Vec3(0, -20, -85)).norm(), 4.0);
  EXPECT_GT(config.craniotomy.centre_mm.x(), 45.0);
  EXPECT_GT(config.craniotomy.centre_mm.z(), 25.0);
  EXPECT_LT((config.gravity_direction - Vec3(-0.5, -0.8660, 0)).norm(), 1e-3);
  EXPECT_THAT(std::get<TumourLabel>(config.tumour).labels, ElementsAre(1, 4));
  const std::string text = test_support::content_of(options.out);
  EXPECT_THAT(text, AllOf(HasSubstr("# GUESS: the lowest 8 mm of the brainstem in labels.nii"),
                          HasSubstr("all but 2, oedema"), HasSubstr("label 4 "),
                          HasSubstr("From --position supine,left-30")));
  const CaseView view = value_or_fail(view_case(options.out));
  EXPECT_THAT(view.problems, IsEmpty());
}

TEST_F(FirstCase, WhoseLabelsOrTumourDoNotServeIsSeenAllTheSame) {
  value_or_fail(write_first_case(options));
  const auto append = [this](const std::string& name, const std::string& more) {
    return folder.write(name, test_support::content_of(options.out) + more);
  };
  put("moved.nii", drawn([](const Vec3& x) { return label_at(x - Vec3(0, 30, 0)); }));
  const CaseView moved =
      value_or_fail(view_case(append("moved.yaml", "anatomy: {labels: moved.nii, septa: off}\n")));
  EXPECT_THAT(moved.problems, ElementsAre(HasSubstr("outside the mask of")));
  ASSERT_TRUE(moved.label_voxels);
  EXPECT_GT(moved.brain.num_vertices(), 0);
  EXPECT_GT(moved.tumour.num_vertices(), 0);
  put("tumour.nii", drawn([](const Vec3& x) {
        return lesion_at(x) > 0.0F && std::abs(x.z() - 30.0) < 1.5 ? 1.0F : 0.0F;
      }));
  const CaseView thin = value_or_fail(
      view_case(append("thin.yaml", "mesh: {generate: {edge_mm: 9, tumour_edge_mm: 5}}\n")));
  EXPECT_THAT(thin.problems, ElementsAre(HasSubstr("no voxel has this label")));
  EXPECT_GT(thin.brain.num_vertices(), 0) << "without a tumour to be fine about";
}

TEST_F(FirstCase, FromAMaskTakesTheLowestPartNearTheMiddle) {
  options.labels.clear();
  options.brain = folder / "brain.nii";
  const CaseConfig config = written();
  EXPECT_EQ(config.brain, options.brain);
  EXPECT_LT((config.brainstem.centre_mm - Vec3(0, -20, -85)).norm(), 4.0);
  EXPECT_THAT(test_support::content_of(options.out), HasSubstr("tonsils"));
}

TEST_F(FirstCase, WhatIsMissingIsToldAtOnceAndACaseIsNeverReplaced) {
  const InitOptions all = options;
  options = {};
  options.mri = all.mri;
  EXPECT_THAT(refusal(), HasSubstr("missing: --brain or --labels, --tumour, --position, --out"));
  options = all;
  folder.write("case.yaml", "mine");
  EXPECT_THAT(refusal(), HasSubstr("exists"));
  EXPECT_EQ(test_support::content_of(options.out), "mine");
}

TEST_F(FirstCase, SeveralLabelsMustBeChosenByNumberOrByNameOfTheirTable) {
  put("tumour.nii",
      drawn([](const Vec3& x) { return lesion_at(x) > 0.0F ? lesion_at(x) + 10.0F : 0.0F; }));
  EXPECT_THAT(refusal(), AllOf(HasSubstr("--tumour-label"), HasSubstr("11 ("), HasSubstr("14 (")));
  EXPECT_FALSE(std::filesystem::exists(options.out));
  options.tumour_label = "core";
  EXPECT_THAT(refusal(), AllOf(HasSubstr("\"core\""), HasSubstr("there is none")));
  folder.write("tumour.tsv", "index\tname\n11\tCore\n14\tRim\n");
  options.tumour_label = "nose";
  EXPECT_THAT(refusal(), HasSubstr("(\"Core\", \"Rim\")"));
  options.tumour_label = "core,14";
  EXPECT_THAT(std::get<TumourLabel>(written().tumour).labels, ElementsAre(11, 14));
}

TEST_F(FirstCase, TheBackgroundIsNoTumour) {
  options.tumour_label = "0";
  EXPECT_THAT(refusal(), HasSubstr("--tumour-label: 0: is the background"));
  options.tumour_label.clear();
  put("tumour.nii", drawn([](const Vec3& x) { return lesion_at(x) > 0.0F ? 0.0F : 1.0F; }));
  EXPECT_THAT(refusal(), HasSubstr("is it the background, or the brain?"));
  put("tumour.nii", drawn([](const Vec3& x) { return lesion_at(x) == 1.0F ? 1e30F : 0.0F; }));
  EXPECT_THAT(refusal(), HasSubstr("is no label map: it has the value 1e+30"));
}

TEST_F(FirstCase, ATumourOutsideTheBrainIsRefusedAndOneThatSticksOutIsDoubted) {
  const auto ball_at = [this](const Vec3& centre) {
    put("tumour.nii",
        drawn([&](const Vec3& x) { return (x - centre).norm() < 12.0 ? 1.0F : 0.0F; }));
  };
  ball_at(Vec3(85, 0, 0));  // the brain ends at 70
  EXPECT_THAT(refusal(),
              AllOf(HasSubstr("--tumour: "), HasSubstr("tumour.nii: 100 % of the tumour "
                                                       "lie outside the brain, up to 2")));
  EXPECT_FALSE(std::filesystem::exists(options.out));
  ball_at(Vec3(66, 0, 0));
  EXPECT_THAT(value_or_fail(write_first_case(options)).guesses,
              Contains(AllOf(HasSubstr("tumour: "), HasSubstr("LOOK AGAIN"),
                             HasSubstr("more than 3 mm are not prepared"))));
}

TEST_F(FirstCase, AVolumeThatIsThereIsNeverReplacedAndNothingIsLeftBehind) {
  const std::string mine = "my own mask";
  std::ofstream(folder / "case-brain.nii.gz") << mine;
  EXPECT_THAT(refusal(), HasSubstr("case-brain.nii.gz: exists; a volume is never replaced"));
  EXPECT_EQ(test_support::content_of(folder / "case-brain.nii.gz"), mine);
  EXPECT_FALSE(std::filesystem::exists(options.out));
}

TEST_F(FirstCase, ATumourWithinAnotherThatIsChosenIsOfTheWhole) {
  test_support::StructureSet set;
  for (const auto& [number, half] : {std::pair{0, 6.0}, {1, 12.0}}) {
    test_support::DrawnStructure one{number, number == 0 ? "GTV" : "CTV", {}};
    for (const double s : {27.0, 30.0, 33.0}) {
      one.contours.push_back({(Points(3, 4) << 40 - half, 40 + half, 40 + half, 40 - half, -half,
                               -half, half, half, s, s, s, s)
                                  .finished()});
    }
    set.structures.push_back(one);
  }
  test_support::write_structure_set(folder / "rs.dcm", set);
  options.tumour = folder / "rs.dcm";
  options.tumour_label = "GTV,CTV";
  const CaseConfig config = written();
  // Structure 0 has label 1; it lies within structure 1, whose label is 2.
  EXPECT_THAT(std::get<TumourLabel>(config.tumour).labels, ElementsAre(2));
}

TEST_F(FirstCase, LabelsThatAreNoWholeNumbersAreRefused) {
  VoxelImage labels = drawn(label_at);
  labels.values[labels.values.size() / 2] = 41.4F;
  put("labels.nii", labels);
  const std::string no_map = "labels.nii: is no label map: it has the value 41.4, no whole number";
  EXPECT_THAT(refusal(), AllOf(HasSubstr("--labels: "), HasSubstr(no_map)));
  folder.write("labels.tsv", "index\tname\n41\tRight-Cerebral-White-Matter\n16\tBrain-Stem\n");
  EXPECT_THAT(refusal(), HasSubstr(no_map));
}

// Ventricles that are as bright as white matter, because the map lies 30 mm beside the MRI.
TEST_F(FirstCase, AnMriIsNeitherLabelMapNorBrain) {
  // A head of 3,400 cc with the grey values of tissue.
  put("t1.nii", drawn([](const Vec3& x) {
        const double r = x.cwiseQuotient(Vec3(85, 100, 95)).norm();
        return r < 1.0 ? 100.0F + std::floor(400.0F * static_cast<float>(r)) : 0.0F;
      }));
  options.labels = folder / "t1.nii";
  EXPECT_THAT(refusal(), AllOf(HasSubstr("--labels: "), HasSubstr("t1.nii: is an image, not a "),
                               HasSubstr("more than 60 different values")));
  folder.write("t1.tsv", "index\tname\n200\tBrain-Stem\n");
  EXPECT_THAT(refusal(), HasSubstr("is an image, not a label map"));
  options.labels.clear();
  options.brain = folder / "t1.nii";
  EXPECT_THAT(refusal(), AllOf(HasSubstr("--brain: "), HasSubstr("t1.nii: is an image of the "),
                               HasSubstr("not a brain: 33")));
  EXPECT_FALSE(std::filesystem::exists(options.out));
}

TEST_F(FirstCase, ALabelMapThatDoesNotLieOnTheMriIsDoubted) {
  const auto ventricle = [](const Vec3& x) { return (x - Vec3(10, 0, 10)).norm() < 20.0; };
  const auto map = drawn([&](const Vec3& x) { return ventricle(x) ? 43.0F : label_at(x); });
  put("labels.nii", map);
  const auto doubts = [&](const Vec3& moved) {
    put("t1.nii", drawn([&](const Vec3& x) {
          return ventricle(x - moved) ? 30.0F : label_at(x - moved) > 0.0F ? 100.0F : 20.0F;
        }));
    std::filesystem::remove(folder / "case.yaml");
    std::filesystem::remove(folder / "case-brain.nii.gz");
    return value_or_fail(write_first_case(options)).guesses;
  };
  const auto doubt =
      HasSubstr("as bright in the ventricles of labels.nii as in its white matter (medians 100");
  EXPECT_THAT(doubts(Vec3::Zero()), testing::Not(testing::Contains(doubt)));
  EXPECT_THAT(doubts(Vec3(-30, 0, 0)), testing::Contains(doubt));
}

TEST_F(FirstCase, AwkwardNamesComeBackFromTheCase) {
  options.mri = folder / "t1: #1 'a'.nii", options.labels = folder / "la\nbels: [é].nii";
  std::filesystem::rename(folder / "t1.nii", options.mri);
  std::filesystem::rename(folder / "labels.nii", options.labels);
  const VoxelImage lesion = drawn(lesion_at);
  std::string bytes(lesion.values.begin(), lesion.values.end());
  options.tumour = folder.write(
      "tu\"mo\\ur.seg.nrrd",
      "NRRD0004\ntype: uint8\ndimension: 3\nspace: right-anterior-superior\nsizes: 70 80 80\n"
      "space directions: (3,0,0) (0,3,0) (0,0,3)\nspace origin: (-105,-120,-130)\n"
      "encoding: raw\nSegment0_Name:=Mass\nSegment0_LabelValue:=1\n"
      "Segment1_Name:=Rim: \"é\" #1\nSegment1_LabelValue:=4\n\n" +
          bytes);
  EXPECT_THAT(refusal(), HasSubstr("has 2 segments: name one of \"Mass\", \"Rim: \"é\" #1\" "
                                   "(--tumour-segment)"));
  options.tumour_segment = "Rim: \"é\" #1";
  options.out = folder / " odd: \"é\"\n#1 .yaml";
  const CaseConfig config = written();
  EXPECT_EQ(config.case_id, " odd: \"é\"\n#1 ");
  EXPECT_EQ(config.mri, options.mri);
  EXPECT_EQ(config.brain, folder / " odd: \"é\"\n#1 -brain.nii.gz");
  EXPECT_EQ(std::get<TumourLabel>(config.tumour).path, options.tumour);
  EXPECT_EQ(std::get<TumourLabel>(config.tumour).segment, options.tumour_segment);
  options.out = folder / "odd\xff.yaml";
  EXPECT_THAT(refusal(), HasSubstr("--out: \"odd?\": a case file cannot name this"));
}

TEST_F(FirstCase, ATumourIsNamedByTheOptionThatIsForItsFile) {
  options.tumour_label = "1", options.tumour_segment = "Mass";
  EXPECT_THAT(refusal(), HasSubstr("--tumour-label \"1\" and --tumour-segment \"Mass\": give one"));
  options.tumour_label.clear();
  EXPECT_THAT(refusal(), HasSubstr("only a .seg.nrrd file does"));
  options.tumour = folder.write("seg.dcm", io::Segmentation().set(1, 4).set(2, 4).bytes());
  EXPECT_THAT(refusal(), AllOf(HasSubstr("--tumour-segment: \"Mass\": is for a .seg.nrrd"),
                               HasSubstr("seg.dcm is DICOM")));
}

TEST_F(FirstCase, LabelsOfAnotherNumberingAreRefusedByFile) {
  options.labels = options.tumour;
  EXPECT_THAT(refusal(), AllOf(HasSubstr("tumour.nii"), HasSubstr("FreeSurfer's numbers")));
}

TEST_F(FirstCase, ATumourOfADicomSegmentationIsWrittenBesideTheCase) {
  options.tumour = folder.write("seg.dcm", io::Segmentation().set(1, 4).set(2, 4).bytes());
  EXPECT_THAT(refusal(), AllOf(HasSubstr("--tumour-label: 1 \"Tumour\", 2 \"Oedema\"")));
  options.tumour_label = "7";
  EXPECT_THAT(refusal(), HasSubstr("has no such segment"));
  options.tumour_label = "tumour";
  const auto tumour = std::get<TumourLabel>(written().tumour);
  EXPECT_THAT(tumour.labels, ElementsAre(1));
  EXPECT_EQ(tumour.path, folder / "case-tumour.nii.gz");
  const VoxelImage map = value_or_fail(io::read_volume(tumour.path));
  EXPECT_EQ(map.at(1, 1, 0), 1.0F);
  EXPECT_LT((map.T_ras_voxel * Vec3(1, 1, 0) - Vec3(4.5, -8, 10)).norm(), 1e-5);
}

TEST_F(FirstCase, ATumourOfADicomStructureSetIsFilledOnTheGridOfTheMri) {
  const VoxelImage lesion = drawn(lesion_at);
  test_support::StructureSet set;
  set.structures = {{5, "GTV", test_support::outlines(lesion, 1)},
                    {9, "Oedema", test_support::outlines(lesion, 2)},
                    {2, "Isocentre", {{Points::Zero(3, 1), "POINT"}}}};
  const auto write = [&] { test_support::write_structure_set(folder / "rs.dcm", set); };
  write();
  options.tumour = folder / "rs.dcm";
  EXPECT_THAT(refusal(), AllOf(HasSubstr("rs.dcm: has several structures; name the tumour's by "
                                         "--tumour-label: 5 \"GTV\" (0."),
                               HasSubstr("9 \"Oedema\" (1"),
                               HasSubstr("2 \"Isocentre\" (contour 1 is POINT)")));
  options.tumour_label = "7";
  EXPECT_THAT(refusal(), HasSubstr("rs.dcm has no such structure; it has 5 \"GTV\""));
  options.tumour_label = "isocentre";
  EXPECT_THAT(refusal(), HasSubstr("rs.dcm: structure 2 \"Isocentre\": contour 1 is POINT: closed "
                                   "planar contours are needed"));
  options.tumour_label = "gtv";
  const auto tumour = std::get<TumourLabel>(written().tumour);
  EXPECT_THAT(tumour.labels, ElementsAre(5));
  EXPECT_EQ(tumour.path, folder / "case-tumour.nii.gz");
  EXPECT_THAT(test_support::content_of(options.out),
              AllOf(HasSubstr("structure 5 \"GTV\", from "), HasSubstr("planes 3.00 mm apart")));
  const VoxelImage map = value_or_fail(io::read_volume(tumour.path));
  ASSERT_EQ(map.values.size(), lesion.values.size());
  for (std::size_t v = 0; v < map.values.size(); ++v)
    ASSERT_EQ(map.values[v], lesion.values[v] == 1.0F ? 5.0F : 0.0F) << v;
  options.out = folder / "again.yaml";
  set.structures[1].name = "gtv";
  write();
  EXPECT_THAT(refusal(), HasSubstr("has 2 of this name: give the number"));
}

TEST_F(FirstCase, AStructureSetOfAnotherFrameOfReferenceIsRefused) {
  std::filesystem::create_directory(folder / "series");
  test_support::write_series(folder / "series", value_or_fail(io::read_volume(options.mri)));
  options.mri = folder / "series", options.tumour = folder / "rs.dcm";
  test_support::StructureSet set;
  set.structures = {{1, "GTV", test_support::outlines(drawn(lesion_at), 1)}};
  set.frame_of_reference = "1.2.3.5";
  test_support::write_structure_set(options.tumour, set);
  EXPECT_THAT(refusal(),
              AllOf(HasSubstr("rs.dcm: structure 1 \"GTV\": was drawn in another frame of "
                              "reference"),
                    HasSubstr("(3006,0024) is \"1.2.3.5\", --mri has \"1.2.3.4\"")));
  set.frame_of_reference = "1.2.3.4", set.series = "1.2.77", set.other_frame = "1.2.3.5";
  test_support::write_structure_set(options.tumour, set);
  written();
  EXPECT_THAT(test_support::content_of(options.out),
              AllOf(HasSubstr("drawn on another series"), HasSubstr("(the only structure)")));
}

TEST(OpeningOver, LiesOnTheOutsideAndNotInAHollow) {
  const VoxelImage brain = drawn([](const Vec3& x) {
    const bool hollow = x.y() > 20.0 && std::abs(x.x()) < 12.0 && std::abs(x.z()) < 15.0;
    return !hollow && x.cwiseQuotient(Vec3(70, 85, 65)).norm() < 1.0 ? 1.0F : 0.0F;
  });
  const OpeningGuess guess = opening_over(brain, Vec3(5, 12, 0));
  EXPECT_GT(guess.centre.norm(), 50.0);
  EXPECT_GT(guess.outward.z(), -0.3);
  EXPECT_GT(opening_over(brain, Vec3(40, 0, 30)).centre.x(), 45.0);
}

// A label map of a real head.
TEST(FirstCaseOfARealHead, CanBePrepared) {
  const char* data = std::getenv("BRAINSHIFT_EXTERNAL_DATA");
  if (data == nullptr) GTEST_SKIP() << "BRAINSHIFT_EXTERNAL_DATA is not set";
  const TemporaryFolder folder;
  InitOptions options;
  options.mri = options.labels = std::filesystem::path(data) / "synthseg_labels/seg_01.nii.gz";
  options.tumour = options.labels;  // the right putamen stands for one
  options.tumour_label = "51";
  options.position = "supine,left-30";
  options.out = folder / "case.yaml";
  value_or_fail(write_first_case(options));
  const CaseView view = value_or_fail(view_case(options.out));
  EXPECT_THAT(view.problems, IsEmpty());
  EXPECT_GT(opening_of(view).value().normal.z(), -0.5);
}

}  // namespace
}  // namespace brainshift::client
