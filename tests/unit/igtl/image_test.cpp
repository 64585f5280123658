// SPDX-License-Identifier: Apache-2.0
#include "common/igtl/image.hpp"

#include <gmock/gmock.h>

#include <limits>

#include "tests/support/results.hpp"
#include "tests/unit/igtl/examples.hpp"

namespace brainshift::igtl {
namespace {

using test_example::complaint;
using test_example::content_of;
using test_example::expect_round_trip;
using test_example::image;
using ::testing::HasSubstr;
using namespace std::string_literals;

void expect_image_refused(const std::string& content, const char* part) {
  test_example::expect_refused(decode_image(content), part);
}

std::string with(std::size_t at, const std::string& bytes) {
  return content_of(image<float>(3)).replace(at, bytes.size(), bytes);
}

template <typename T>
class ImageOf : public ::testing::Test {};
using ScalarTypes = ::testing::Types<std::int8_t, std::uint8_t, std::int16_t, std::uint16_t,
                                     std::int32_t, std::uint32_t, float, double>;
TYPED_TEST_SUITE(ImageOf, ScalarTypes);

TYPED_TEST(ImageOf, DecodeReturnsWhatWasEncoded) {
  for (const int components : {1, 3, 255}) {
    expect_round_trip(image<TypeParam>(components), decode_image);
  }
}

TYPED_TEST(ImageOf, ExtremeNumbersSurvive) {
  using Limits = std::numeric_limits<TypeParam>;
  Image ours = image<TypeParam>(1);
  auto& voxels = std::get<std::vector<TypeParam>>(ours.voxels);
  voxels[0] = Limits::lowest();
  voxels[1] = Limits::max();
  voxels[2] = Limits::min();
  if (Limits::has_infinity) voxels[3] = -Limits::infinity();
  expect_round_trip(ours, decode_image);
}

TYPED_TEST(ImageOf, BigEndianVoxelsAreTheSameNumbers) {
  const Image ours = image<TypeParam>(3);
  std::string content = content_of(ours);
  content[4] = 1;
  for (std::size_t at = 72; at < content.size(); at += sizeof(TypeParam)) {
    std::reverse(content.begin() + static_cast<std::ptrdiff_t>(at),
                 content.begin() + static_cast<std::ptrdiff_t>(at + sizeof(TypeParam)));
  }
  const auto decoded = value_or_fail(decode_image(content));
  EXPECT_TRUE(decoded == ours);
}

TEST(Image, AViewIsTheSameBytesAsAnImage) {
  for (const int components : {1, 3}) {
    const Image floats = image<float>(components);
    const Image bytes = image<std::uint8_t>(components);
    std::string out;
    append_content(ImageView{floats.geometry, components,
                             std::span<const float>(std::get<std::vector<float>>(floats.voxels))},
                   out);
    EXPECT_EQ(out, content_of(floats));
    out.clear();
    append_content(
        ImageView{bytes.geometry, components,
                  std::span<const std::uint8_t>(std::get<std::vector<std::uint8_t>>(bytes.voxels))},
        out);
    EXPECT_EQ(out, content_of(bytes));
  }
}

TEST(Image, APartOfAVolumeSurvives) {
  Image ours = image<std::int16_t>(1);
  ours.offset = {1, 2, 0};
  ours.part = {3, 1, 2};
  ours.voxels = std::vector<std::int16_t>{1, 2, 3, 4, 5, 6};
  EXPECT_FALSE(ours.is_whole());
  expect_round_trip(ours, decode_image);
}

// Along an axis of n voxels the first centre lies (n - 1) / 2 steps before the middle.
TEST(Image, TheOriginIsTheCentreOfTheVolumeForEvenAndOddSizes) {
  for (const std::array<int, 3>& dims :
       {std::array{4, 3, 2}, std::array{5, 5, 5}, std::array{1, 1, 1}}) {
    ImageGeometry geometry = test_example::geometry();
    geometry.dims = dims;
    const AffineTransform T = geometry.T_ras_voxel();
    const Vec3 last(dims[0] - 1, dims[1] - 1, dims[2] - 1);
    const Vec3 mean = 0.5 * (T * Vec3::Zero() + T * last);
    EXPECT_LT((mean - geometry.centre.cast<double>()).norm(), 1e-12);
    EXPECT_EQ(T.linear(), geometry.steps.cast<double>());
  }
}

TEST(Image, LpsIsTurnedIntoRas) {
  ImageGeometry ras = test_example::geometry();
  ImageGeometry lps = ras;
  lps.coordinates = Coordinates::kLps;
  lps.steps.topRows<2>() *= -1.0F;
  lps.centre.head<2>() *= -1.0F;
  EXPECT_TRUE(lps.T_ras_voxel().isApprox(ras.T_ras_voxel(), 1e-14));
}

TEST(Image, GeometryOfATransformGivesTheTransformBack) {
  AffineTransform T = AffineTransform::Identity();
  T.linear() << 0.0, -2.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0, -4.0;
  T.translation() << -30.5, 12.25, 41.0;
  for (const std::array<int, 3>& dims : {std::array{4, 3, 2}, std::array{1, 7, 100}}) {
    const ImageGeometry geometry = image_geometry(dims, T);
    EXPECT_EQ(geometry.dims, dims);
    EXPECT_TRUE(geometry.T_ras_voxel().isApprox(T, 1e-14));
  }
}

TEST(Image, WhatFitsNoImageIsRefused) {
  expect_image_refused("", "0 bytes");
  expect_image_refused(with(0, "\0\2"s), "version 2");
  expect_image_refused(with(2, "\0"s), "bytes of voxels");
  expect_image_refused(with(3, "\1"), "scalar type 1");
  expect_image_refused(with(3, "\x0c"), "scalar type 12");
  expect_image_refused(with(4, "\0"s), "endian 0");
  expect_image_refused(with(4, "\3"), "endian 3");
  expect_image_refused(with(5, "\0"s), "coordinates 0");
  expect_image_refused(with(5, "\3"), "coordinates 3");
  expect_image_refused(with(6, "\0\0"s), "dims hold 0");
  expect_image_refused(with(6, "\0\3"s), "the volume has 3");
  expect_image_refused(with(12, "\x7f\x80\0\0"s), "not finite");
  expect_image_refused(with(48, "\x7f\xc0\0\0"s), "not finite");
  expect_image_refused(with(60, "\0\1"s), "part of 4 voxels from voxel 1 on");
  expect_image_refused(with(60, "\xff\xff"), "from voxel 65535 on");
  expect_image_refused(content_of(image<float>(3)) + '\0', "289 bytes of voxels, must be 288");
}

TEST(Image, ASizeThatNoMachineHoldsIsRefusedByTheContentsSize) {
  const std::string huge(6, '\xff');
  expect_image_refused(with(2, "\xff").replace(6, 6, huge).replace(66, 6, huge),
                       "288 bytes of voxels, must be");
}

TEST(Image, EveryTruncationIsRefused) {
  const std::string content = content_of(image<float>(3));
  for (std::size_t size = 0; size < content.size(); ++size) {
    EXPECT_FALSE(decode_image(content.substr(0, size))) << size;
  }
}

TEST(Image, ValidateNamesWhatIsWrong) {
  const auto changed = [](const auto& change) {
    Image ours = image<float>(3);
    change(ours);
    return complaint(ours);
  };
  EXPECT_EQ(changed([](Image&) {}), "");
  EXPECT_EQ(changed([](Image& i) { i.components = 256; }), "256 components, must be 1 to 255");
  EXPECT_EQ(changed([](Image& i) { i.geometry.dims[1] = 65536; }),
            "dims hold 65536, must be 1 to 65535");
  EXPECT_THAT(changed([](Image& i) { i.offset[2] = -1; }), HasSubstr("from voxel -1 on"));
  EXPECT_THAT(changed([](Image& i) { i.part[0] = 0; }), HasSubstr("part of 0 voxels"));
  EXPECT_EQ(changed([](Image& i) { i.voxels = std::vector<float>(71); }), "71 numbers, must be 72");
  for (const float factor : {-3.0F, 0.0F}) {
    EXPECT_EQ(
        changed([factor](Image& i) { i.geometry.steps.col(1) = factor * i.geometry.steps.col(0); }),
        "two steps are parallel, or one is zero");
  }
  EXPECT_THAT(
      changed([](Image& i) { i.geometry.centre[1] = std::numeric_limits<float>::infinity(); }),
      HasSubstr("not finite"));
}

TEST(Image, TheStepAcrossASingleSliceMayBeZero) {
  Image slice = image<std::uint8_t>(1);
  slice.geometry.dims[2] = slice.part[2] = 1;
  slice.voxels = std::vector<std::uint8_t>(12);
  slice.geometry.steps.col(2).setZero();
  EXPECT_EQ(complaint(slice), "");
  slice.geometry.steps.col(1).setZero();
  EXPECT_EQ(complaint(slice), "two steps are parallel, or one is zero");
}

}  // namespace
}  // namespace brainshift::igtl
