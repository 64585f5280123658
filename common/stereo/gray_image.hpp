// SPDX-License-Identifier: GPL-3.0-or-later
// A picture of one grey level per pixel, 0 to 255, and maps of one number per pixel. Pixels are
// stored row by row; in pixel (x, y), x points to the right and y down.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace brainshift::stereo {

template <typename T>
struct PixelMap {
  int width = 0, height = 0;
  std::vector<T> pixels;

  PixelMap() = default;
  PixelMap(int w, int h, T value = T{})
      : width(w),
        height(h),
        pixels(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), value) {}
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x);
  }
  const T& at(int x, int y) const { return pixels[index(x, y)]; }
  T& at(int x, int y) { return pixels[index(x, y)]; }
  bool empty() const { return pixels.empty(); }
};

using GrayImage = PixelMap<std::uint8_t>;

}  // namespace brainshift::stereo
