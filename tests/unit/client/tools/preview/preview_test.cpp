// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/preview/preview.hpp"

#include <gmock/gmock.h>

#include <opencv2/imgcodecs.hpp>

#include "common/io/fields/field_files.hpp"
#include "common/io/files/file_access.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/client/tools/pictures/pixels.hpp"
#include "tests/unit/client/tools/preview/box_case.hpp"

namespace brainshift::client {
namespace {

using test_support::TemporaryFolder;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

TEST(Preview, WritesPicturesAndTheFacts) {
  const TemporaryFolder folder;
  const auto summary = value_or_fail(write_preview(write_box_case(folder), folder / "out"));
  EXPECT_THAT(summary.files, SizeIs(4));
  for (const auto& file : summary.files) EXPECT_TRUE(std::filesystem::exists(file)) << file;
  const cv::Mat slices = cv::imread((folder / "out/slices-tumour.png").string());
  EXPECT_GT(count_colour(slices, palette::kOrange, whole(slices)), 1000);   // tumour
  EXPECT_GT(count_colour(slices, palette::kSkyBlue, whole(slices)), 1000);  // slaves
  EXPECT_GT(count_colour(slices, palette::kPurple, whole(slices)), 1000);   // craniotomy
  EXPECT_THAT(io::read_file(folder / "out/preview.txt").value(), HasSubstr("case box"));
}

TEST(Preview, LegendsNameOnlyWhatIsInThePicture) {
  const TemporaryFolder folder;
  const auto aside = write_box_case(folder, {.brainstem = "[0, 56.25, -75]", .stem_radius_mm = 12});
  value_or_fail(write_preview(aside, folder / "out"));
  const cv::Mat slices = cv::imread((folder / "out/slices-tumour.png").string());
  EXPECT_EQ(count_colour(slices, palette::kYellow, whole(slices)), 0);
  const cv::Mat surface = cv::imread((folder / "out/surface.png").string());
  EXPECT_EQ(count_colour(surface, palette::kYellow, whole(surface)), 0) << "below the head";
}

TEST(Preview, DrawsACaseThatCannotBePrepared) {
  const TemporaryFolder folder;
  const auto outside = write_box_case(folder, {.tumour = "[110, -10, 20]"});  // by 23 mm
  const auto summary = value_or_fail(write_preview(outside, folder / "out"));
  EXPECT_THAT(summary.problems, SizeIs(1));
  // The plane through the tumour's centre is widened until the tumour is in it.
  const cv::Mat slices = cv::imread((folder / "out/slices-tumour.png").string());
  EXPECT_GT(count_colour(slices, palette::kOrange, whole(slices)), 1000);
  EXPECT_THAT(io::read_file(folder / "out/preview.txt").value(), HasSubstr("cannot be prepared"));
}

// A sheet of one layer of voxels of 1 mm, 24 x 24 mm about (40, -10, 20).
void write_sheet(const std::filesystem::path& path) {
  VoxelImage sheet;
  sheet.dims = {40, 40, 9};
  sheet.T_ras_voxel.translation() = Vec3(20, -30, 16);
  for (int k = 0; k < 9; ++k) {
    for (int j = 0; j < 40; ++j) {
      for (int i = 0; i < 40; ++i) {
        const bool in = k == 4 && std::abs(i - 20) <= 12 && std::abs(j - 20) <= 12;
        sheet.values.push_back(in ? 1.0F : 0.0F);
      }
    }
  }
  ASSERT_TRUE(io::write_nifti(path, {{sheet.dims, sheet.T_ras_voxel}, sheet.values, ""}));
}

TEST(Preview, DrawsTheVoxelsOfATumourThatIsTooThin) {
  const TemporaryFolder folder;
  write_sheet(folder / "thin.nii");
  const auto thin = write_box_case(folder, {.tumour_volume = "thin.nii"});
  const auto summary = value_or_fail(write_preview(thin, folder / "out"));
  EXPECT_THAT(summary.problems, ElementsAre(HasSubstr("too thin")));
  EXPECT_THAT(summary.facts, Contains(HasSubstr("tumour: 0.62 cc of voxels at right 40, posterior "
                                                "10, superior 20 mm")));
  const cv::Mat slices = cv::imread((folder / "out/slices-tumour.png").string());
  EXPECT_GT(count_colour(slices, palette::kOrange, whole(slices)), 1000);
  EXPECT_GT(count_colour(slices, palette::kSkyBlue, whole(slices)), 1000);
}

TEST(Preview, DrawsWhatCanBeReadBesideAFileThatCannotAndNoPictureOfAnEarlierRun) {
  const TemporaryFolder folder;
  value_or_fail(write_preview(write_box_case(folder), folder / "out"));
  const auto missing = write_box_case(folder, {.tumour_volume = "nowhere.nii"});
  const auto summary = value_or_fail(write_preview(missing, folder / "out"));
  EXPECT_THAT(summary.problems, ElementsAre(HasSubstr("nowhere.nii")));
  EXPECT_FALSE(std::filesystem::exists(folder / "out/slices-tumour.png"));
  const cv::Mat slices = cv::imread((folder / "out/slices-middle.png").string());
  EXPECT_GT(count_colour(slices, palette::kSkyBlue, whole(slices)), 1000);
}

TEST(Preview, LeavesNothingBehindForACaseThatCannotBeRead) {
  const TemporaryFolder folder;
  const auto summary = write_preview(folder.write("bad.yaml", "case_id: [\n"), folder / "out");
  ASSERT_FALSE(summary);
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
  value_or_fail(write_preview(write_box_case(folder), folder / "out"));
  folder.write("out/own.png", "");
  ASSERT_FALSE(write_preview(folder / "bad.yaml", folder / "out"));
  for (const auto& file : std::filesystem::directory_iterator(folder / "out")) {
    EXPECT_EQ(file.path().filename(), "own.png") << "a picture of another case";
  }
}

}  // namespace
}  // namespace brainshift::client
