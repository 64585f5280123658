// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/preview/preview.hpp"

#include <gmock/gmock.h>

#include <opencv2/imgcodecs.hpp>

#include "client/tools/pictures/canvas.hpp"
#include "common/io/files/file_access.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/client/tools/preview/box_case.hpp"

namespace brainshift::client {
namespace {

using test_support::TemporaryFolder;
using testing::HasSubstr;
using testing::SizeIs;

// Share of pixels of exactly this colour.
int count_colour(const cv::Mat& image, const cv::Scalar& colour) {
  int count = 0;
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const auto& p = image.at<cv::Vec3b>(y, x);
      count +=
          p == cv::Vec3b(static_cast<std::uint8_t>(colour[0]), static_cast<std::uint8_t>(colour[1]),
                         static_cast<std::uint8_t>(colour[2]));
    }
  }
  return count;
}

TEST(Preview, WritesPicturesAndTheFacts) {
  const TemporaryFolder folder;
  const auto summary = value_or_fail(write_preview(write_box_case(folder), folder / "out"));
  EXPECT_THAT(summary.files, SizeIs(4));
  for (const auto& file : summary.files) EXPECT_TRUE(std::filesystem::exists(file)) << file;
  const cv::Mat slices = cv::imread((folder / "out/slices-tumour.png").string());
  EXPECT_GT(count_colour(slices, palette::kOrange), 1000);   // tumour
  EXPECT_GT(count_colour(slices, palette::kSkyBlue), 1000);  // slaves
  EXPECT_GT(count_colour(slices, palette::kPurple), 1000);   // craniotomy
  EXPECT_THAT(io::read_file(folder / "out/preview.txt").value(), HasSubstr("case box"));
}

TEST(Preview, DrawsACaseThatCannotBePrepared) {
  const TemporaryFolder folder;
  BoxCase box;
  box.tumour = "[110, -10, 20]";  // 23 mm outside
  const auto summary = value_or_fail(write_preview(write_box_case(folder, box), folder / "out"));
  EXPECT_THAT(summary.problems, SizeIs(1));
  // The plane through the tumour's centre is widened until the tumour is in it.
  const cv::Mat slices = cv::imread((folder / "out/slices-tumour.png").string());
  EXPECT_GT(count_colour(slices, palette::kOrange), 1000);
  EXPECT_THAT(io::read_file(folder / "out/preview.txt").value(), HasSubstr("cannot be prepared"));
}

TEST(Preview, LeavesNothingBehindForACaseThatCannotBeRead) {
  const TemporaryFolder folder;
  const auto summary = write_preview(folder.write("bad.yaml", "case_id: [\n"), folder / "out");
  ASSERT_FALSE(summary);
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

}  // namespace
}  // namespace brainshift::client
