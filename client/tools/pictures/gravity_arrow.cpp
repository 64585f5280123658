// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/pictures/gravity_arrow.hpp"

#include "client/tools/pictures/canvas.hpp"

namespace brainshift::client {

void draw_gravity_arrow(cv::Mat& image, cv::Point2d along) {
  constexpr double kHalf_px = 44.0;
  constexpr double kLeastSeen = 0.1;
  const TextStyle style{.cap_px = 18.0,
                        .colour = palette::kWhite,
                        .align = Align::kCentre,
                        .bold = false,
                        .halo = true};
  const cv::Point2d centre(86.0, 100.0);
  draw_text(image, {static_cast<int>(centre.x), 34}, "gravity", style);
  if (cv::norm(along) < kLeastSeen) {
    draw_text(image, {static_cast<int>(centre.x), 66}, "along view", style);
    return;
  }
  const cv::Point2d half = kHalf_px * along;
  draw_arrow(image, centre - half, centre + half, {palette::kWhite, 5, 0.0}, 22.0, 3);
}

}  // namespace brainshift::client
