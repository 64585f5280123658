// SPDX-License-Identifier: Apache-2.0
// The oracle: libopenigtlink 1.11 of Debian 12, which knows header version 1. From the same values
// it packs the same bytes, and decoding its bytes gives the values back.
#include <gtest/gtest.h>
#include <igtlCapabilityMessage.h>
#include <igtlImageMessage.h>
#include <igtlPointMessage.h>
#include <igtlPolyDataMessage.h>
#include <igtlStatusMessage.h>
#include <igtlStringMessage.h>
#include <igtlTrackingDataMessage.h>
#include <igtlTransformMessage.h>
#include <igtl_util.h>

#include <cstring>

#include "common/igtl/message.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/igtl/examples.hpp"

namespace lib = ::igtl;

// The library does not free what its CapabilityMessage packed; the address sanitizer asks here.
extern "C" const char* __lsan_default_suppressions() { return "leak:igtl_capability_alloc_info"; }

namespace brainshift::igtl {
namespace {

using namespace test_example;

std::string packed(lib::MessageBase& message, const Envelope& envelope = test_example::envelope()) {
  message.SetDeviceName(envelope.device.c_str());
  message.SetTimeStamp(static_cast<unsigned int>(envelope.timestamp >> 32),
                       static_cast<unsigned int>(envelope.timestamp & 0xffffffffu));
  message.Pack();
  return {static_cast<const char*>(message.GetPackPointer()),
          static_cast<std::size_t>(message.GetPackSize())};
}

// The first difference instead of two pages of bytes; in the body, if there is one.
std::string difference(const std::string& ours, const std::string& theirs) {
  if (ours == theirs) return "";
  const auto first = [&](std::size_t from) {
    while (from < std::min(ours.size(), theirs.size()) && ours[from] == theirs[from]) ++from;
    return from;
  };
  const std::size_t at = first(kHeaderBytes);
  const std::size_t shown = at < ours.size() ? at : first(0);
  return "byte " + std::to_string(shown) + " of " + std::to_string(ours.size()) + " and " +
         std::to_string(theirs.size());
}

void expect_same(const Content& content, const std::string& theirs) {
  EXPECT_EQ(difference(encoded(envelope(), content), theirs), "") << type_of(content);
  const auto decoded = value_or_fail(decode(theirs));
  EXPECT_TRUE(decoded.content == content) << type_of(content);
  EXPECT_EQ(decoded.envelope.device, envelope().device);
  EXPECT_EQ(decoded.envelope.timestamp, envelope().timestamp);
  EXPECT_EQ(decoded.envelope.version, 1);
}

void expect_same(const Content& content, lib::MessageBase& message) {
  expect_same(content, packed(message));
}

lib::Matrix4x4* to_library(const Matrix34f& from, lib::Matrix4x4& to) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) to[row][column] = from(row, column);
  }
  for (int column = 0; column < 4; ++column) to[3][column] = column == 3 ? 1.0F : 0.0F;
  return &to;
}

// The library holds unit normals and spacings, and multiplies them when it packs. Steps along the
// axes with power-of-two lengths survive that without rounding.
ImageGeometry exact_geometry() {
  ImageGeometry geometry = test_example::geometry();
  geometry.steps << 0.0F, -2.0F, 0.0F, 0.5F, 0.0F, 0.0F, 0.0F, 0.0F, 4.0F;
  return geometry;
}

lib::ImageMessage::Pointer library_image(const ImageGeometry& geometry, int components, int type,
                                         const void* voxels, std::size_t bytes,
                                         std::array<int, 3> offset, std::array<int, 3> part) {
  auto message = lib::ImageMessage::New();
  std::array<int, 3> dims = geometry.dims;
  float spacing[3];
  lib::Matrix4x4 matrix;
  lib::IdentityMatrix(matrix);
  for (int axis = 0; axis < 3; ++axis) {
    spacing[axis] = geometry.steps.col(axis).norm();
    for (int row = 0; row < 3; ++row) {
      matrix[row][axis] = geometry.steps(row, axis) / spacing[axis];
      matrix[row][3] = geometry.centre[row];
    }
  }
  message->SetDimensions(dims.data());
  message->SetSubVolume(part.data(), offset.data());
  message->SetNumComponents(components);
  message->SetScalarType(type);
  message->SetSpacing(spacing);
  message->SetMatrix(matrix);
  message->SetCoordinateSystem(static_cast<int>(geometry.coordinates));
  message->SetEndian(lib::ImageMessage::ENDIAN_LITTLE);  // its default is big, on every machine
  message->AllocateScalars();
  std::memcpy(message->GetScalarPointer(), voxels, bytes);
  return message;
}

template <typename T>
class LibraryImage : public ::testing::Test {};

template <typename T>
constexpr int kLibraryType = 0;
template <>
constexpr int kLibraryType<std::int8_t> = lib::ImageMessage::TYPE_INT8;
template <>
constexpr int kLibraryType<std::uint8_t> = lib::ImageMessage::TYPE_UINT8;
template <>
constexpr int kLibraryType<std::int16_t> = lib::ImageMessage::TYPE_INT16;
template <>
constexpr int kLibraryType<std::uint16_t> = lib::ImageMessage::TYPE_UINT16;
template <>
constexpr int kLibraryType<std::int32_t> = lib::ImageMessage::TYPE_INT32;
template <>
constexpr int kLibraryType<std::uint32_t> = lib::ImageMessage::TYPE_UINT32;
template <>
constexpr int kLibraryType<float> = lib::ImageMessage::TYPE_FLOAT32;
template <>
constexpr int kLibraryType<double> = lib::ImageMessage::TYPE_FLOAT64;

using LibraryScalarTypes = ::testing::Types<std::int8_t, std::uint8_t, std::int16_t, std::uint16_t,
                                            std::int32_t, std::uint32_t, float, double>;
TYPED_TEST_SUITE(LibraryImage, LibraryScalarTypes);

TYPED_TEST(LibraryImage, ScalarAndVectorVolumesAreTheSameBytes) {
  for (const int components : {1, 3}) {
    for (const auto coordinates : {Coordinates::kRas, Coordinates::kLps}) {
      Image ours = image<TypeParam>(components);
      ours.geometry = exact_geometry();
      ours.geometry.coordinates = coordinates;
      const auto& voxels = std::get<std::vector<TypeParam>>(ours.voxels);
      const auto theirs =
          library_image(ours.geometry, components, kLibraryType<TypeParam>, voxels.data(),
                        voxels.size() * sizeof(TypeParam), ours.offset, ours.part);
      expect_same(ours, *theirs);
    }
  }
}

TEST(Library, APartOfAVolumeIsTheSameBytes) {
  Image ours;
  ours.geometry = exact_geometry();
  ours.offset = {1, 2, 0};
  ours.part = {3, 1, 2};
  ours.voxels = std::vector<std::int16_t>{-1, 2, -3, 4, -5, 600};
  expect_same(ours, *library_image(ours.geometry, 1, lib::ImageMessage::TYPE_INT16,
                                   std::get<std::vector<std::int16_t>>(ours.voxels).data(), 12,
                                   ours.offset, ours.part));
}

TEST(Library, ObliqueGeometryAgreesToSinglePrecision) {
  const ImageGeometry geometry = test_example::geometry();
  const std::vector<std::uint8_t> voxels(geometry.num_voxels());
  const auto decoded = value_or_fail(
      decode(packed(*library_image(geometry, 1, lib::ImageMessage::TYPE_UINT8, voxels.data(),
                                   voxels.size(), {0, 0, 0}, geometry.dims))));
  const auto& theirs = std::get<Image>(decoded.content).geometry;
  EXPECT_LT((theirs.steps - geometry.steps).cwiseAbs().maxCoeff(), 1e-6F);
  EXPECT_EQ(theirs.centre, geometry.centre);
}

TEST(Library, TransformIsTheSameBytes) {
  auto message = lib::TransformMessage::New();
  lib::Matrix4x4 matrix;
  message->SetMatrix(*to_library(test_example::matrix(), matrix));
  expect_same(Transform{test_example::matrix()}, *message);
}

TEST(Library, TrackingDataIsTheSameBytes) {
  auto message = lib::TrackingDataMessage::New();
  const TrackingData data = tracking_data();
  for (const TrackedTool& tool : data.tools) {
    auto element = lib::TrackingDataElement::New();
    lib::Matrix4x4 matrix;
    element->SetName(tool.name.c_str());
    element->SetType(static_cast<igtlUint8>(tool.type));
    element->SetMatrix(*to_library(tool.matrix, matrix));
    message->AddTrackingDataElement(element);
  }
  // The library leaves the reserved bytes as it finds them in memory (3.1 writes zeros).
  std::string theirs = packed(*message);
  for (std::size_t tool = 0; tool < data.tools.size(); ++tool) {
    theirs[kHeaderBytes + 70 * tool + 21] = '\0';
  }
  auto* body = reinterpret_cast<unsigned char*>(theirs.data()) + kHeaderBytes;
  std::uint64_t crc = ::crc64(nullptr, 0, 0);
  crc = ::crc64(body, theirs.size() - kHeaderBytes, crc);
  for (int i = 0; i < 8; ++i) theirs[50 + i] = static_cast<char>(crc >> (56 - 8 * i));
  expect_same(data, theirs);
}

lib::PolyDataCellArray::Pointer library_cells(const Cells& cells) {
  auto array = lib::PolyDataCellArray::New();
  std::vector<igtlUint32> numbers = cells.numbers;
  for (std::size_t at = 0; at < numbers.size(); at += numbers[at] + 1) {
    array->AddCell(static_cast<int>(numbers[at]), numbers.data() + at + 1);
  }
  return array;
}

lib::PolyDataMessage::Pointer library_poly_data(const PolyData& data) {
  auto message = lib::PolyDataMessage::New();
  auto points = lib::PolyDataPointArray::New();
  for (Eigen::Index i = 0; i < data.points.cols(); ++i) {
    points->AddPoint(data.points(0, i), data.points(1, i), data.points(2, i));
  }
  message->SetPoints(points);
  message->SetVertices(library_cells(data.vertices));
  message->SetLines(library_cells(data.lines));
  message->SetPolygons(library_cells(data.polygons));
  message->SetTriangleStrips(library_cells(data.triangle_strips));
  for (const Attribute& attribute : data.attributes) {
    auto theirs = lib::PolyDataAttribute::New();
    Eigen::MatrixXf values = attribute.values;
    theirs->SetType(static_cast<int>(attribute.kind), static_cast<int>(values.rows()));
    theirs->SetSize(static_cast<igtlUint32>(values.cols()));
    theirs->SetName(attribute.name.c_str());
    theirs->SetData(values.data());
    message->AddAttribute(theirs);
  }
  return message;
}

TEST(Library, PolyDataIsTheSameBytes) { expect_same(poly_data(), *library_poly_data(poly_data())); }

TEST(Library, ASurfaceWithDisplacementsIsTheSameBytes) {
  PolyData surface;
  surface.points = poly_data().points;
  surface.polygons.add({0, 2, 1});
  surface.polygons.add({0, 1, 3});
  // 22 and 16 bytes of names: with and without the padding.
  surface.attributes = {poly_data().attributes[0], poly_data().attributes[1]};
  expect_same(surface, *library_poly_data(surface));
  surface.attributes.pop_back();
  expect_same(surface, *library_poly_data(surface));
  surface.attributes[0].name.pop_back();
  expect_same(surface, *library_poly_data(surface));
}

TEST(Library, PointsAreTheSameBytes) {
  auto message = lib::PointMessage::New();
  for (const NamedPoint& point : point_list().points) {
    auto element = lib::PointElement::New();
    element->SetName(point.name.c_str());
    element->SetGroupName(point.group.c_str());
    element->SetRGBA(point.rgba[0], point.rgba[1], point.rgba[2], point.rgba[3]);
    element->SetPosition(point.position[0], point.position[1], point.position[2]);
    element->SetRadius(point.diameter);
    element->SetOwner(point.owner.c_str());
    message->AddPointElement(element);
  }
  expect_same(point_list(), *message);
}

TEST(Library, TextIsTheSameBytes) {
  for (const Text& ours :
       {text(), Text{}, Text{"\xc3\xa4", kUtf8}, Text{std::string(65535, 'x')}}) {
    auto message = lib::StringMessage::New();
    message->SetString(ours.text.c_str());
    message->SetEncoding(ours.encoding);
    expect_same(ours, *message);
  }
}

TEST(Library, StatusIsTheSameBytes) {
  for (const StatusReport& ours : {status_report(), StatusReport{}}) {
    auto message = lib::StatusMessage::New();
    message->SetCode(ours.code);
    message->SetSubCode(ours.subcode);
    message->SetErrorName(ours.error_name.c_str());
    message->SetStatusString(ours.text.c_str());
    expect_same(ours, *message);
  }
}

TEST(Library, ARequestForTheStatusIsTheSameBytes) {
  expect_same(StatusRequest{}, *lib::GetStatusMessage::New());
}

TEST(Library, CapabilityIsTheSameBytes) {
  auto message = lib::CapabilityMessage::New();
  message->SetTypes({"IMAGE", "TWELVE_BYTES"});
  expect_same(Capability{{"IMAGE", "TWELVE_BYTES"}}, *message);
  expect_same(CapabilityRequest{}, *lib::GetCapabilityMessage::New());
}

TEST(Library, ADeviceNameOfFullWidthIsTheSameBytes) {
  Envelope full = envelope();
  full.device = "twenty bytes of name";
  auto message = lib::GetStatusMessage::New();
  EXPECT_EQ(difference(encoded(full, StatusRequest{}), packed(*message, full)), "");
}

}  // namespace
}  // namespace brainshift::igtl
