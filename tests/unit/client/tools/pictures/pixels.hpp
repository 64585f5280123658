// SPDX-License-Identifier: GPL-3.0-or-later
// What tests ask of a picture: where it has ink, and how much of a colour.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "client/tools/pictures/canvas.hpp"

namespace brainshift::client {

inline cv::Rect whole(const cv::Mat& image) { return {0, 0, image.cols, image.rows}; }

// Bounding box of the pixels that fulfil `wanted`; empty if none does.
template <typename Wanted>
cv::Rect box_of(const cv::Mat& image, const cv::Rect& within, const Wanted& wanted) {
  cv::Rect box;
  for (int y = within.y; y < within.y + within.height; ++y) {
    for (int x = within.x; x < within.x + within.width; ++x) {
      if (wanted(image.at<cv::Vec3b>(y, x))) box |= cv::Rect(x, y, 1, 1);
    }
  }
  return box;
}

inline cv::Vec3b pixel_of(const cv::Scalar& colour) {
  return {cv::saturate_cast<std::uint8_t>(colour[0]), cv::saturate_cast<std::uint8_t>(colour[1]),
          cv::saturate_cast<std::uint8_t>(colour[2])};
}

// Of the pixels that are not white.
inline cv::Rect inked(const cv::Mat& image) {
  return box_of(image, whole(image),
                [](const cv::Vec3b& pixel) { return pixel != pixel_of(palette::kWhite); });
}

// Of the pixels of exactly this colour; the rims of smoothed lines are not.
inline cv::Rect box_of_colour(const cv::Mat& image, const cv::Scalar& colour,
                              const cv::Rect& within) {
  return box_of(image, within, [&](const cv::Vec3b& pixel) { return pixel == pixel_of(colour); });
}

inline int count_colour(const cv::Mat& image, const cv::Scalar& colour, const cv::Rect& within) {
  int count = 0;
  box_of(image, within, [&](const cv::Vec3b& pixel) {
    count += pixel == pixel_of(colour) ? 1 : 0;
    return false;
  });
  return count;
}

}  // namespace brainshift::client
