// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <sqlite3.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "client/tools/export/chosen_update.hpp"
#include "client/tools/export/export_surgery.hpp"
#include "common/io/fields/field_files.hpp"
#include "common/io/geometry/image_file.hpp"
#include "common/io/geometry/mesh_file.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/values/model_id.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/client/tools/export/small_export.hpp"

namespace brainshift::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

class ChooseUpdate : public SmallExport {
 protected:
  Result<ChosenUpdate> choose(const UpdateChoice& choice = {}) const {
    const auto file = value_or_fail(io::SurgeryFile::open(path));
    return choose_update(file, path, model.mesh.num_nodes(), choice);
  }
  void expect_refused(const UpdateChoice& choice, ErrorCode code, const std::string& says) const {
    EXPECT_THAT(refusal_of(choose(choice), code), HasSubstr(says));
  }
};

TEST_F(ChooseUpdate, TheLastUsableOneIsTheDefault) {
  write_updates({message(1, Quality::kGood), message(2, Quality::kCaution, 0.5),
                 message(3, Quality::kUnusable), message(4, Quality::kNotJudged)});
  const auto chosen = value_or_fail(choose());
  EXPECT_EQ(chosen.message.update.sequence, 2u);
  EXPECT_EQ(chosen.message.session_id, 41u);
  EXPECT_NEAR(chosen.time_s, 1.0, 1e-6);
  EXPECT_TRUE(chosen.message.update.estimate.displacement.isApprox(
      test_support::toy_displacement(model.mesh.nodes, 0.5), 1e-6));
}

TEST_F(ChooseUpdate, ANamedOneIsTaken) {
  write_updates({message(1, Quality::kGood), message(2, Quality::kGood)});
  EXPECT_EQ(choose({.sequence = 1})->message.update.sequence, 1u);
}

TEST_F(ChooseUpdate, AnUnusableOneNeedsToBeAllowed) {
  write_updates({message(1, Quality::kGood), message(2, Quality::kUnusable)});
  expect_refused({.sequence = 2}, ErrorCode::kInvalidArgument,
                 "update 2 is unusable (volume_lost): as the test wants it. --allow-unusable");
  EXPECT_EQ(choose({.sequence = 2, .allow_unusable = true})->message.update.sequence, 2u);
  expect_refused({.allow_unusable = true}, ErrorCode::kInvalidArgument, "needs --sequence N");
}

TEST_F(ChooseUpdate, OneThatNobodyJudgedOrAnIterateIsNotUsable) {
  auto iterate = message(2, Quality::kNotJudged);
  iterate.update.final = false;
  write_updates({message(1, Quality::kNotJudged), iterate});
  expect_refused({.sequence = 1}, ErrorCode::kInvalidArgument, "update 1 is not judged");
  expect_refused({.sequence = 2}, ErrorCode::kInvalidArgument, "update 2 is an iterate");
}

TEST_F(ChooseUpdate, WithoutAUsableOneTheLastIsTold) {
  write_updates({message(1, Quality::kNotJudged), message(2, Quality::kUnusable)});
  expect_refused({}, ErrorCode::kEmptySet,
                 "holds no usable update; the last of its 2, update 2, is unusable (volume_lost)");
}

TEST_F(ChooseUpdate, AFileOfObservationsSaysWhereFieldsComeFrom) {
  write_updates({});
  expect_refused({}, ErrorCode::kEmptySet, "holds no update: it was simulated or imported");
  expect_refused({.sequence = 1}, ErrorCode::kEmptySet, "Replay it to a brainshiftd");
}

TEST_F(ChooseUpdate, ANumberThatDoesNotOccurIsToldWithThoseThatDo) {
  write_updates({message(3, Quality::kGood), message(9, Quality::kGood)});
  expect_refused({.sequence = 4}, ErrorCode::kNotFound, "holds no update 4: has 3 to 9");
}

TEST_F(ChooseUpdate, AnUpdateThatIsAnErrorCarriesNoField) {
  auto failed = message(2, Quality::kGood);
  failed.error = Error{ErrorCode::kEmptySet, "no points"};
  write_updates({message(1, Quality::kGood), failed});
  EXPECT_EQ(choose()->message.update.sequence, 1u);
  expect_refused({.sequence = 2, .allow_unusable = true}, ErrorCode::kInvalidArgument,
                 "update 2 carries no field: no points");
}

TEST_F(ChooseUpdate, AFieldOfAnotherMeshIsRefused) {
  auto other = message(1, Quality::kGood);
  other.update.estimate.displacement.conservativeResize(3, 10);
  other.update.estimate.sd_mm.conservativeResize(10);
  other.update.estimate.known.conservativeResize(10);
  write_updates({other});
  expect_refused({}, ErrorCode::kUnreadable, "displacement of 10 nodes, the model has 64");
}

TEST_F(ChooseUpdate, ABrokenRecordIsNamed) {
  write_updates({message(1, Quality::kGood), message(2, Quality::kGood)});
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
  EXPECT_EQ(
      sqlite3_exec(db, "UPDATE record SET payload = x'01' WHERE id = 3", nullptr, nullptr, nullptr),
      SQLITE_OK);
  sqlite3_close(db);
  EXPECT_THAT(sentence_of(choose()), AllOf(StartsWith(path.string()), HasSubstr("record 3")));
}

namespace fs = std::filesystem;
using io::FieldDirection;
using nlohmann::json;
using test_support::content_of;
using testing::ElementsAre;
using testing::UnorderedElementsAre;

class ExportSurgery : public SmallExport {
 protected:
  void SetUp() override {
    write_updates({message(1, Quality::kGood, 0.5), message(2, Quality::kCaution),
                   message(3, Quality::kUnusable, 1.5)});
    options.surgery = path;
    options.model = folder / "m.h5";
    test_support::write_toy_model(options.model, model);
    options.out = folder / "out";
    options.direction = FieldDirection::kResampling;
    options.spacing_mm = 4.0;
  }
  // A volume around the toy patient; voxels (i, j, k) hold 100 + i.
  fs::path write_image(const std::string& name, const Vec3& origin = Vec3(-10, -10, -10)) const {
    io::ScalarVolume image;
    image.grid.dims = {30, 30, 30};
    image.grid.T_ras_voxel.linear() = Vec3(2.75, 2.75, 2.75).asDiagonal();
    image.grid.T_ras_voxel.translation() = origin;
    for (std::size_t i = 0; i < image.grid.num_voxels(); ++i) {
      image.values.push_back(100.0F + static_cast<float>(i % 30));
    }
    EXPECT_TRUE(io::write_nifti(folder / name, image));
    return folder / name;
  }
  std::vector<std::string> names(const fs::path& of) const {
    std::vector<std::string> found;
    for (const auto& entry : fs::directory_iterator(of)) {
      found.push_back(entry.path().filename().string());
    }
    return found;
  }
  void expect_refused(ErrorCode code, const std::string& says) const {
    const auto before = names(folder.path());
    const auto result = export_surgery(options);
    EXPECT_THAT(refusal_of(result, code),
                AllOf(HasSubstr(says), testing::Not(testing::HasSubstr("\n"))));
    EXPECT_THAT(names(folder.path()), testing::UnorderedElementsAreArray(before));
  }
  json manifest() const { return json::parse(content_of(options.out / "export.json")); }

  ExportOptions options;
};

TEST_F(ExportSurgery, TheFolderHoldsWhatTheManifestLists) {
  options.formats = parse_formats({"all"}).value();
  options.images = {write_image("t1.nii.gz")};
  const auto made = value_or_fail(export_surgery(options));
  EXPECT_THAT(names(options.out),
              UnorderedElementsAre("displacement-1007.nii.gz", "displacement-1006.nii.gz",
                                   "displacement.nrrd", "displacement.h5", "sd_mm.nii.gz",
                                   "known.nii.gz", "jacobian.nii.gz", "warped-t1.nii.gz",
                                   "tumour.vtp", "cortex.vtp", "series", "export.json"));
  EXPECT_THAT(names(options.out / "series"),
              UnorderedElementsAre("a.pvd", "a-000001.vtu", "a-000002.vtu"));
  const json read = manifest();
  EXPECT_EQ(read.at("sequence"), 2);
  EXPECT_EQ(read.at("session_id"), 41);
  EXPECT_EQ(read.at("quality").at("verdict"), "caution");
  EXPECT_EQ(read.at("direction"), "resampling");
  EXPECT_EQ(read.at("files").size(), 11u);
  for (const json& file : read.at("files")) {
    EXPECT_TRUE(fs::exists(options.out / file.at("file").get<std::string>())) << file;
    EXPECT_EQ(file.at("model_id"), model.model_id);
  }
  EXPECT_EQ(made.files.size(), 11u);
}

TEST_F(ExportSurgery, FormatsChooseFiles) {
  options.formats = {ExportFormat::kNrrd, ExportFormat::kSurfaces};
  ASSERT_TRUE(export_surgery(options));
  EXPECT_THAT(names(options.out),
              UnorderedElementsAre("displacement.nrrd", "tumour.vtp", "cortex.vtp", "export.json"));
}

TEST_F(ExportSurgery, VentriclesAndSeptaAreThereWhereTheModelHasThem) {
  BrainModel known = model;
  known.ventricle_wall = model.mesh.tets.topRows<3>().leftCols<2>();
  known.septa.triangles = model.mesh.tets.topRows<3>().rightCols<3>();
  known.model_id = content_hash(known);
  fs::remove(options.model);
  fs::remove(path);
  test_support::write_toy_model(options.model, known);
  test_support::write_toy_journal(path, known,
                                  {test_support::toy_update(known, 1, Quality::kGood, 0.5)});
  options.formats = {ExportFormat::kSurfaces};
  value_or_fail(export_surgery(options));
  EXPECT_THAT(names(options.out), UnorderedElementsAre("tumour.vtp", "cortex.vtp", "ventricles.vtp",
                                                       "septa.vtp", "export.json"));
  const auto septa = value_or_fail(io::read_surface(options.out / "septa.vtp"));
  EXPECT_EQ(septa.triangles.cols(), 3);
}

TEST_F(ExportSurgery, TheGridOfAnImageIsTaken) {
  options.like = write_image("like.nii");
  options.spacing_mm.reset();
  options.formats = {ExportFormat::kSd};
  const auto made = value_or_fail(export_surgery(options));
  const auto sd = value_or_fail(io::read_nifti(options.out / "sd_mm.nii.gz"));
  EXPECT_EQ(sd.dims, (std::array<int, 3>{30, 30, 30}));
  EXPECT_EQ(sd.T_ras_voxel.translation(), Vec3(-10, -10, -10));
  EXPECT_NEAR(*std::max_element(sd.values.begin(), sd.values.end()), 0.25, 1e-6);
  EXPECT_EQ(made.voxels_in_brain,
            static_cast<std::size_t>(std::count_if(sd.values.begin(), sd.values.end(),
                                                   [](float v) { return v > 0.0F; })));
}

TEST_F(ExportSurgery, WhatIsKnownIsAVolumeAndOfAnOlderJournalThereIsNone) {
  options.formats = {ExportFormat::kKnown};
  ASSERT_TRUE(export_surgery(options));
  const auto known = value_or_fail(io::read_nifti(options.out / "known.nii.gz"));
  EXPECT_NEAR(*std::max_element(known.values.begin(), known.values.end()), 0.6, 1e-6);
  EXPECT_EQ(manifest().at("files").at(0).at("units"), "1");
  auto before = message(1, Quality::kGood);
  before.update.estimate.known.resize(0);
  write_updates({before});
  options.out = folder / "before";
  ASSERT_TRUE(export_surgery(options));
  EXPECT_THAT(names(options.out), ElementsAre("export.json"));
}

TEST_F(ExportSurgery, AnImageIsWarpedThroughTheField) {
  options.images = {write_image("t1.nii")};
  options.like = options.images[0];
  options.spacing_mm.reset();
  options.formats = {ExportFormat::kSd};
  ASSERT_TRUE(export_surgery(options));
  const auto warped = value_or_fail(io::read_nifti(options.out / "warped-t1.nii.gz"));
  // In the middle of the brain, of an image that rises by 1 in 2.75 mm along x. The field is that
  // of nodes 20 mm apart, hence the tolerance.
  const Vec3 x = warped.T_ras_voxel * Vec3(15, 15, 15);
  Vec3 undeformed = x;
  for (int i = 0; i < 20; ++i) undeformed = x - Vec3(test_support::toy_displacement(undeformed));
  EXPECT_NEAR(warped.at(15, 15, 15), 100.0 + (undeformed[0] + 10.0) / 2.75, 0.03);
  EXPECT_GT(x[0] - undeformed[0], 1.0);
  EXPECT_NEAR(warped.at(0, 0, 0), 100.0, 0.2);
}

TEST_F(ExportSurgery, SurfacesAreDeformedAndReadBack) {
  options.formats = {ExportFormat::kSurfaces};
  ASSERT_TRUE(export_surgery(options));
  const auto tumour = value_or_fail(io::read_surface(options.out / "tumour.vtp"));
  EXPECT_EQ(tumour.num_vertices(), model.tumour.num_vertices());
  EXPECT_LT((tumour.vertices - model.tumour.vertices).row(2).maxCoeff(), -2.0);
}

TEST_F(ExportSurgery, TheTwoDirectionsAreOpposite) {
  options.formats = {ExportFormat::kItk};
  ASSERT_TRUE(export_surgery(options));
  options.direction = FieldDirection::kModeling;
  options.out = folder / "other";
  const auto made = value_or_fail(export_surgery(options));
  EXPECT_EQ(made.files.at(0).direction, "modeling");
  EXPECT_NE(content_of(folder / "out" / "displacement.h5"),
            content_of(folder / "other" / "displacement.h5"));
}

TEST_F(ExportSurgery, AnUnusableUpdateSaysSoInEveryNameAndHeader) {
  options.choice = {.sequence = 3};
  expect_refused(ErrorCode::kInvalidArgument, "update 3 is unusable (volume_lost)");
  options.choice.allow_unusable = true;
  value_or_fail(export_surgery(options));
  for (const std::string& name : names(options.out)) {
    EXPECT_THAT(name, testing::AnyOf(StartsWith("unusable-"), "export.json"));
  }
  EXPECT_THAT(content_of(options.out / "unusable-displacement.nrrd"),
              HasSubstr("brainshift note:=update 3, NOT USABLE: unusable\n"));
  EXPECT_EQ(manifest().at("quality").at("usable"), false);
  EXPECT_EQ(manifest().at("files").at(0).at("quality"), "unusable");
}

TEST_F(ExportSurgery, AFoldedFieldIsExportedForLookingAtOnly) {
  write_updates({message(1, Quality::kUnusable, -60.0)});
  options.choice = {.sequence = 1, .allow_unusable = true};
  expect_refused(ErrorCode::kInvalidArgument, "inside out");
  options.direction = FieldDirection::kModeling;
  ASSERT_TRUE(export_surgery(options));
  EXPECT_GT(manifest().at("volume_ratio").at("folded"), 0);
}

TEST_F(ExportSurgery, TheDirectionIsNeverImplied) {
  options.direction.reset();
  expect_refused(ErrorCode::kInvalidArgument,
                 "--direction is missing and is never implied: resampling warps images");
}

TEST_F(ExportSurgery, OptionsThatContradictEachOtherAreRefused) {
  options.like = write_image("like.nii");
  expect_refused(ErrorCode::kInvalidArgument, "--spacing-mm: not with --like");
  options.like.clear();
  options.images = {write_image("t1.nii"), folder / "elsewhere" / "t1.nii.gz"};
  expect_refused(ErrorCode::kInvalidArgument, "another image is called t1 too");
  options.images.pop_back();
  options.direction = FieldDirection::kModeling;
  expect_refused(ErrorCode::kInvalidArgument, "--image: needs --direction resampling");
}

TEST_F(ExportSurgery, AFolderWithFilesIsNotTouched) {
  fs::create_directory(options.out);
  std::ofstream(options.out / "mine.txt") << "mine";
  expect_refused(ErrorCode::kInvalidArgument, "out: is not empty");
  EXPECT_THAT(names(options.out), ElementsAre("mine.txt"));
  options.out = options.out / "mine.txt";
  expect_refused(ErrorCode::kInvalidArgument, "is no folder");
  options.out = "";
  expect_refused(ErrorCode::kInvalidArgument, "--out: must name a folder");
}

TEST_F(ExportSurgery, AnEmptyFolderOrADeepOneIsFilled) {
  options.formats = {ExportFormat::kSd};
  fs::create_directory(options.out);
  options.out += "/";
  ASSERT_TRUE(export_surgery(options));
  EXPECT_TRUE(fs::exists(folder / "out" / "export.json"));
  options.out = folder / "a" / "b" / "c";
  ASSERT_TRUE(export_surgery(options));
  EXPECT_TRUE(fs::exists(folder / "a" / "b" / "c" / "export.json"));
  EXPECT_THAT(names(folder / "a" / "b"), ElementsAre("c"));
}

TEST_F(ExportSurgery, AnotherPatientsModelIsRefused) {
  options.model = folder / "other.h5";
  test_support::write_toy_model(options.model, test_support::toy_model(4));
  expect_refused(ErrorCode::kInvalidArgument, "meta.model_id is \"" + model.model_id);
  options.model = folder / "none.h5";
  expect_refused(ErrorCode::kNotFound, "none.h5");
  options.model = path;
  expect_refused(ErrorCode::kUnreadable, "a.surgery");
}

TEST_F(ExportSurgery, AFileWithoutAUsableUpdateIsRefused) {
  write_updates({message(1, Quality::kUnusable)});
  expect_refused(ErrorCode::kEmptySet, "holds no usable update");
  options.surgery = folder / "none.surgery";
  expect_refused(ErrorCode::kNotFound, "none.surgery");
}

TEST_F(ExportSurgery, GridsThatAreNoneAreRefused) {
  options.spacing_mm = 0.2;
  expect_refused(ErrorCode::kInvalidArgument, "--spacing-mm: ");
  options.spacing_mm = -2.0;
  expect_refused(ErrorCode::kInvalidArgument, "--spacing-mm: ");
  options.spacing_mm.reset();
  options.like = folder / "none.nii";
  expect_refused(ErrorCode::kNotFound, "--like: ");
  options.like = folder.write("text.nii", "text");
  expect_refused(ErrorCode::kUnreadable, "--like: ");
  options.like = write_image("far.nii", Vec3(900, 0, 0));
  expect_refused(ErrorCode::kInvalidArgument, "far.nii: no voxel lies in the brain");
}

// sform_code and qform_code are bytes 252 to 255.
TEST_F(ExportSurgery, AnImageWithoutAnAffineIsRefused) {
  const fs::path image = write_image("bare.nii");
  std::string bytes = content_of(image);
  std::fill(bytes.begin() + 252, bytes.begin() + 256, '\0');
  folder.write("bare.nii", bytes);
  options.images = {image};
  expect_refused(ErrorCode::kUnreadable, "--image: ");
  options.images.clear();
  options.spacing_mm.reset();
  options.like = image;
  expect_refused(ErrorCode::kUnreadable, "bare.nii: has no affine");
}

TEST_F(ExportSurgery, AnImageElsewhereLeavesNothingBehind) {
  options.images = {write_image("far.nii", Vec3(900, 0, 0))};
  expect_refused(ErrorCode::kInvalidArgument, "far.nii: no voxel of the grid lies in the image");
}

}  // namespace
}  // namespace brainshift::client
