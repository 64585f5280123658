// SPDX-License-Identifier: GPL-3.0-or-later
// `brainshift export` as a user runs it, on a journal of the toy patient: the files that it leaves,
// and every bad input refused with one line and no folder.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/io/fields/field_files.hpp"
#include "common/io/geometry/image_file.hpp"
#include "common/io/geometry/mesh_file.hpp"
#include "tests/integration/process.hpp"
#include "tests/integration/workspace.hpp"
#include "tests/support/toy_journal.hpp"

namespace brainshift::integration {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using testing::StartsWith;

class ExportCommand : public testing::Test {
 protected:
  void SetUp() override {
    const BrainModel model = test_support::toy_model();
    test_support::write_toy_model(files.path("m.h5"), model);
    test_support::write_toy_journal(files.path("a.surgery"), model,
                                    {test_support::toy_update(model, 1, Quality::kGood, 0.5),
                                     test_support::toy_update(model, 2, Quality::kCaution),
                                     test_support::toy_update(model, 3, Quality::kUnusable)});
    write_image("mri.nii.gz", true);
  }

  // Oblique, anisotropic and flipped, 75 mm wide, around the patient.
  void write_image(const std::string& name, bool flipped) const {
    io::ScalarVolume image;
    image.grid.dims = {60, 50, 38};
    Mat3 axes = Eigen::AngleAxisd(0.2, Vec3(1, 2, 3).normalized()).toRotationMatrix();
    if (flipped) axes.col(0) *= -1.0;
    image.grid.T_ras_voxel.linear() = axes * Vec3(1.25, 1.5, 2.0).asDiagonal();
    image.grid.T_ras_voxel.translation() =
        Vec3::Constant(30.0) - image.grid.T_ras_voxel.linear() * Vec3(30, 25, 19);
    for (std::size_t i = 0; i < image.grid.num_voxels(); ++i) {
      image.values.push_back(static_cast<float>(i % 251));
    }
    ASSERT_TRUE(io::write_nifti(files.path(name), image));
  }

  std::vector<std::string> command(const std::vector<std::string>& more) const {
    std::vector<std::string> argv = {brainshift(),     "export",           files.path("a.surgery"),
                                     "--model",        files.path("m.h5"), "--out",
                                     files.path("out")};
    argv.insert(argv.end(), more.begin(), more.end());
    return argv;
  }
  void expect_refused(const std::vector<std::string>& more, const std::string& says) const {
    SCOPED_TRACE(says);
    const Finished finished = run(command(more));
    EXPECT_EQ(finished.exit_status, 2);
    EXPECT_EQ(finished.out, "");
    const auto told = lines(finished.err);
    ASSERT_THAT(told, SizeIs(1)) << finished.err;
    EXPECT_THAT(told[0], AllOf(StartsWith("brainshift: "), HasSubstr(says)));
    EXPECT_FALSE(fs::exists(files.path("out")));
    for (const auto& entry : fs::directory_iterator(files.folder())) {
      EXPECT_THAT(entry.path().filename().string(), Not(HasSubstr("partial")));
    }
  }

  Workspace files;
};

TEST_F(ExportCommand, WarpsTheMriOntoItsOwnGrid) {
  const std::string mri = files.path("mri.nii.gz");
  const Finished finished =
      run(command({"--direction", "resampling", "--like", mri, "--image", mri}));
  ASSERT_EQ(finished.exit_status, 0) << finished.err;
  EXPECT_THAT(finished.err, IsEmpty());
  EXPECT_THAT(finished.out, AllOf(HasSubstr("update 2, quality caution, direction resampling"),
                                  HasSubstr("60 x 50 x 38 voxels of 1.25 x 1.5 x 2 mm"),
                                  HasSubstr("warped-mri.nii.gz")));
  const auto warped = io::read_nifti(files.path("out/warped-mri.nii.gz"));
  const auto image = io::read_nifti(mri);
  ASSERT_TRUE(warped && image);
  EXPECT_EQ(warped->dims, image->dims);
  EXPECT_TRUE(warped->T_ras_voxel.isApprox(image->T_ras_voxel, 1e-6));
  std::ifstream stream(files.path("out/export.json"));
  const json manifest = json::parse(stream);
  EXPECT_EQ(manifest.at("files").size(), 9u);
  for (const json& file : manifest.at("files")) {
    EXPECT_TRUE(fs::exists(files.path("out/" + file.at("file").get<std::string>()))) << file;
  }
}

TEST_F(ExportCommand, ModelingAroundTheBrainWithTheSeries) {
  const Finished finished = run(command({"--direction", "modeling", "--sequence", "1",
                                         "--spacing-mm", "3", "--formats", "nrrd,series"}));
  ASSERT_EQ(finished.exit_status, 0) << finished.err;
  EXPECT_THAT(finished.out, HasSubstr("update 1, quality good, direction modeling"));
  EXPECT_TRUE(fs::exists(files.path("out/displacement.nrrd")));
  EXPECT_TRUE(fs::exists(files.path("out/series/a.pvd")));
  EXPECT_TRUE(io::read_vtu(files.path("out/series/a-000002.vtu")));
  EXPECT_FALSE(fs::exists(files.path("out/displacement.h5")));
}

TEST_F(ExportCommand, AnUnusableUpdateOnlyWhenItIsAllowed) {
  expect_refused({"--direction", "modeling", "--sequence", "3"}, "update 3 is unusable");
  const Finished finished =
      run(command({"--direction", "modeling", "--sequence", "3", "--allow-unusable"}));
  ASSERT_EQ(finished.exit_status, 0) << finished.err;
  EXPECT_TRUE(fs::exists(files.path("out/unusable-displacement.h5")));
}

TEST_F(ExportCommand, BadInputIsRefusedWithOneLine) {
  expect_refused({}, "--direction is missing and is never implied");
  expect_refused({"--direction", "both"}, "\"both\": must be resampling or modeling");
  const std::vector<std::string> good = {"--direction", "resampling"};
  const auto with = [&](std::initializer_list<std::string> more) {
    std::vector<std::string> all = good;
    all.insert(all.end(), more);
    return all;
  };
  expect_refused(with({"--sequence", "9"}), "holds no update 9: has 1 to 3");
  expect_refused(with({"--allow-unusable"}), "needs --sequence N");
  expect_refused(with({"--spacing-mm", "0.2"}), "--spacing-mm");
  expect_refused(with({"--spacing-mm", "nan"}), "--spacing-mm");
  expect_refused(with({"--like", files.path("none.nii")}), "none.nii");
  expect_refused(with({"--like", files.path("a.surgery")}), "a.surgery");
  expect_refused(with({"--image", files.write("text.nii.gz", "text")}), "text.nii.gz");
  expect_refused(with({"--model", files.path("a.surgery")}), "--model");
}

TEST_F(ExportCommand, WhatExistsIsNotTouched) {
  fs::create_directory(files.path("out"));
  files.write("out/mine.txt", "mine");
  const Finished finished = run(command({"--direction", "modeling"}));
  EXPECT_EQ(finished.exit_status, 2);
  EXPECT_THAT(lines(finished.err), SizeIs(1));
  EXPECT_THAT(finished.err, HasSubstr("--out: " + files.path("out") + ": is not empty"));
  EXPECT_TRUE(fs::exists(files.path("out/mine.txt")));
}

}  // namespace
}  // namespace brainshift::integration
