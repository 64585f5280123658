// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/tracking/recording.hpp"

#include <cstdint>
#include <cstring>

namespace brainshift::tracking {
namespace {

template <typename T>
void copy_values(std::string_view bytes, Eigen::MatrixXf& values) {
  const char* from = bytes.data();
  for (Eigen::Index v = 0; v < values.rows(); ++v) {
    for (Eigen::Index u = 0; u < values.cols(); ++u, from += sizeof(T)) {
      T value{};
      std::memcpy(&value, from, sizeof(T));
      values(v, u) = static_cast<float>(value);
    }
  }
}

}  // namespace

int bytes_per_pixel(PixelType type) { return type == PixelType::kUint8 ? 1 : 2; }

std::string_view Recording::frame_bytes(int frame) const {
  const std::size_t size = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                           static_cast<std::size_t>(bytes_per_pixel(pixel_type));
  return std::string_view(pixels).substr(static_cast<std::size_t>(frame) * size, size);
}

Eigen::MatrixXf Recording::frame_values(int frame) const {
  Eigen::MatrixXf values(height, width);
  const std::string_view bytes = frame_bytes(frame);
  switch (pixel_type) {
    case PixelType::kUint8: copy_values<std::uint8_t>(bytes, values); break;
    case PixelType::kInt16: copy_values<std::int16_t>(bytes, values); break;
    case PixelType::kUint16: copy_values<std::uint16_t>(bytes, values); break;
  }
  return values;
}

}  // namespace brainshift::tracking
