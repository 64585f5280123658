// SPDX-License-Identifier: Apache-2.0
// One small message of every type, with signs, fractions and full-width texts in it.
#pragma once

#include <gmock/gmock.h>

#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "common/igtl/message.hpp"
#include "tests/support/results.hpp"

namespace brainshift::igtl::test_example {

// The content of a message alone.
template <typename T>
std::string content_of(const T& value) {
  std::string content;
  append_content(value, content);
  return content;
}

// The sentence of validate(); empty: nothing is wrong.
template <typename T>
std::string complaint(const T& value) {
  const Status status = validate(value);
  return status ? "" : status.error().message;
}

template <typename T>
void expect_round_trip(const T& value, Result<T> (*decode)(std::string_view)) {
  const auto decoded = value_or_fail(decode(content_of(value)));
  EXPECT_TRUE(decoded == value);
}

template <typename T>
void expect_refused(const Result<T>& decoded, const char* part) {
  EXPECT_THAT(refusal_of(decoded, ErrorCode::kProtocol), ::testing::HasSubstr(part));
}

inline constexpr std::uint16_t kVersions[] = {1, 2};

inline Envelope envelope(std::uint16_t version = 1) {
  Envelope envelope;
  envelope.version = version;
  envelope.device = "brainshift_u";
  envelope.timestamp = (std::uint64_t{1700000000} << 32) | 0x80000001u;
  envelope.message_id = 7;
  envelope.metadata = {{"sequence", "42"}, {"quality", "good"}, {"reason", ""}};
  return envelope;
}

// Oblique, anisotropic, flipped along j; even and odd sizes.
inline ImageGeometry geometry() {
  ImageGeometry geometry;
  geometry.dims = {4, 3, 2};
  geometry.steps << 0.6F, 1.2F, 0.0F, 0.8F, -0.9F, 0.0F, 0.0F, 0.0F, 2.5F;
  geometry.centre = {10.5F, -20.25F, 30.125F};
  return geometry;
}

template <typename T>
Image image(int components) {
  Image image;
  image.geometry = geometry();
  image.components = components;
  image.part = image.geometry.dims;
  std::vector<T> voxels(image.geometry.num_voxels() * static_cast<std::size_t>(components));
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    voxels[i] = static_cast<T>(static_cast<int>(3 * i) - (std::is_unsigned_v<T> ? 0 : 50));
  }
  image.voxels = std::move(voxels);
  return image;
}

inline Matrix34f matrix() {
  Matrix34f matrix;
  matrix << 0.0F, -1.0F, 0.0F, 12.5F, 1.0F, 0.0F, 0.0F, -7.75F, 0.0F, 0.0F, 1.0F, 1e-3F;
  return matrix;
}

inline TrackingData tracking_data() {
  return {{{"Probe", ToolType::k6d, matrix()},
           {"a name of 20 bytes..", ToolType::k3d, Matrix34f::Identity()}}};
}

// A tetrahedron with every kind of cell, and the attributes of points.
inline PolyData poly_data() {
  PolyData data;
  data.points.resize(3, 4);
  data.points << 0.0F, 1.0F, 0.0F, -0.5F, 0.0F, 0.0F, 2.0F, 0.25F, 0.0F, 0.0F, 0.0F, 3.0F;
  data.vertices.add({3});
  data.lines.add({0, 1, 2});
  data.lines.add({2, 3});
  data.polygons.add({0, 2, 1});
  data.polygons.add({0, 1, 2, 3});
  data.triangle_strips.add({0, 1, 2, 3});
  const auto values = [](int components) {
    Eigen::MatrixXf numbers(components, 4);
    for (Eigen::Index i = 0; i < numbers.size(); ++i) {
      numbers.data()[i] = 0.1F * static_cast<float>(i) - 1.0F;
    }
    return numbers;
  };
  data.attributes = {{"displacement_mm", AttributeKind::kVector, false, values(3)},
                     {"sd_mm", AttributeKind::kScalar, false, values(1)},
                     {"pair", AttributeKind::kScalar, false, values(2)},
                     {"normal", AttributeKind::kNormal, false, values(3)},
                     {"tensor", AttributeKind::kTensor, false, values(9)}};
  return data;
}

inline PointList point_list() {
  NamedPoint first{"Nasion", "Fiducial", {255, 0, 127, 254}, {1.5F, -2.5F, 3.25F}, 4.0F, "image"};
  NamedPoint second;
  second.name = std::string(64, 'n');
  second.group = std::string(32, 'g');
  second.owner = std::string(20, 'o');
  return {{first, second}};
}

inline Text text() { return {R"({"sequence": 42, "quality": "good"})", kUsAscii}; }
inline StatusReport status_report() {
  return {kStatusNotReady, -3, "stale", "no update for 2.5 s"};
}

using Named = std::pair<std::string, Content>;
inline std::vector<Named> contents() {
  return {{"image_float32x3", image<float>(3)},
          {"image_float32", image<float>(1)},
          {"image_uint8", image<std::uint8_t>(1)},
          {"transform", Transform{matrix()}},
          {"tracking_data", tracking_data()},
          {"poly_data", poly_data()},
          {"point_list", point_list()},
          {"text", text()},
          {"status_report", status_report()},
          {"status_request", StatusRequest{}},
          {"capability", Capability{{"IMAGE", "TWELVE_BYTES"}}},
          {"capability_request", CapabilityRequest{}}};
}

inline std::string encoded(const Envelope& envelope, const Content& content) {
  std::string bytes;
  const Status status = encode(envelope, content, bytes);
  return status ? bytes : "not encoded: " + status.error().message;
}

}  // namespace brainshift::igtl::test_example
