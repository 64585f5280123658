// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/sensing/volume_picture.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "common/core/mesh.hpp"

namespace brainshift::test_support {
namespace {

constexpr int kZoom = 4;

cv::Mat slice_image(const std::vector<float>& values, const std::array<int, 3>& dims, int axis,
                    int slice) {
  const int a = axis == 0 ? 1 : 0, b = axis == 2 ? 1 : 2;  // columns, rows
  const int columns = dims[static_cast<std::size_t>(a)], rows = dims[static_cast<std::size_t>(b)];
  cv::Mat image(rows, columns, CV_8U);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      std::array<int, 3> at{};
      at[static_cast<std::size_t>(axis)] = slice;
      at[static_cast<std::size_t>(a)] = c;
      at[static_cast<std::size_t>(b)] = r;
      image.at<unsigned char>(r, c) =
          cv::saturate_cast<unsigned char>(values[grid_index(dims, at[0], at[1], at[2])]);
    }
  }
  cv::resize(image, image, cv::Size(), kZoom, kZoom, cv::INTER_NEAREST);
  return image;
}

cv::Mat titled(const cv::Mat& image, const std::string& title) {
  cv::Mat out(image.rows + 40, image.cols + 10, CV_8U, cv::Scalar(255));
  image.copyTo(out(cv::Rect(5, 30, image.cols, image.rows)));
  cv::putText(out, title, {8, 21}, cv::FONT_HERSHEY_SIMPLEX, 0.55, cv::Scalar(0), 1, cv::LINE_AA);
  return out;
}

}  // namespace

int fullest_slice(const std::vector<float>& weight, const std::array<int, 3>& dims, int axis) {
  std::vector<long> count(static_cast<std::size_t>(dims[static_cast<std::size_t>(axis)]), 0);
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i) {
        const std::array<int, 3> at{i, j, k};
        if (weight[grid_index(dims, i, j, k)] > 0.0F) {
          ++count[static_cast<std::size_t>(at[static_cast<std::size_t>(axis)])];
        }
      }
    }
  }
  return static_cast<int>(std::max_element(count.begin(), count.end()) - count.begin());
}

void write_slice_pair(const std::filesystem::path& path, const std::vector<float>& ours,
                      const std::vector<float>& theirs, const ultrasound::VolumeGrid& grid,
                      int slice, int axis) {
  const cv::Mat left = slice_image(ours, grid.dims, axis, slice);
  const cv::Mat right = slice_image(theirs, grid.dims, axis, slice);
  cv::Mat difference;
  cv::absdiff(left, right, difference);
  cv::Mat row;
  const std::vector<cv::Mat> parts = {titled(left, "brainshift"), titled(right, "PLUS"),
                                      titled(difference, "|difference|")};
  cv::hconcat(parts, row);
  cv::Mat sheet(row.rows + 40, row.cols, CV_8U, cv::Scalar(255));
  row.copyTo(sheet(cv::Rect(0, 0, row.cols, row.rows)));
  const int a = axis == 0 ? 1 : 0;
  const int bar = static_cast<int>(std::lround(10.0 / grid.spacing_mm[a] * kZoom));
  cv::line(sheet, {8, row.rows + 12}, {8 + bar, row.rows + 12}, cv::Scalar(0), 3);
  cv::putText(sheet, "10 mm", {16 + bar, row.rows + 18}, cv::FONT_HERSHEY_SIMPLEX, 0.5,
              cv::Scalar(0), 1, cv::LINE_AA);
  if (!cv::imwrite(path.string(), sheet))
    throw std::runtime_error(path.string() + ": cannot be written");
}

}  // namespace brainshift::test_support
