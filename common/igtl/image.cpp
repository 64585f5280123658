// SPDX-License-Identifier: Apache-2.0
#include "common/igtl/image.hpp"

#include <algorithm>
#include <cstring>

#include "common/core/mesh.hpp"
#include "common/igtl/bytes.hpp"

namespace brainshift::igtl {
namespace {

constexpr std::size_t kImageHeaderBytes = 72;
constexpr std::uint16_t kImageVersion = 1;
constexpr int kMaxDim = 65535;
constexpr int kMaxComponents = 255;
enum Endian : std::uint8_t { kBig = 1, kLittle = 2 };

template <typename T>
constexpr std::uint8_t scalar_type() {
  if constexpr (std::is_same_v<T, std::int8_t>) return 2;
  if constexpr (std::is_same_v<T, std::uint8_t>) return 3;
  if constexpr (std::is_same_v<T, std::int16_t>) return 4;
  if constexpr (std::is_same_v<T, std::uint16_t>) return 5;
  if constexpr (std::is_same_v<T, std::int32_t>) return 6;
  if constexpr (std::is_same_v<T, std::uint32_t>) return 7;
  if constexpr (std::is_same_v<T, float>) return 10;
  if constexpr (std::is_same_v<T, double>) return 11;
}

template <std::size_t Bytes>
void reverse_each(char* bytes, std::size_t numbers) {
  for (std::size_t i = 0; i < numbers; ++i)
    std::reverse(bytes + i * Bytes, bytes + (i + 1) * Bytes);
}

template <typename T>
void append_little_endian(std::span<const T> numbers, std::string& out) {
  const std::size_t begin = out.size();
  out.append(reinterpret_cast<const char*>(numbers.data()), numbers.size_bytes());
  if constexpr (std::endian::native == std::endian::big) {
    reverse_each<sizeof(T)>(out.data() + begin, numbers.size());
  }
}

void append_vector(const Eigen::Vector3f& vector, std::string& out) {
  for (const float coordinate : vector) append_number(out, coordinate);
}

void append_sizes(const std::array<int, 3>& sizes, std::string& out) {
  for (const int size : sizes) append_number(out, static_cast<std::uint16_t>(size));
}

void append_image_header(const ImageGeometry& geometry, int components, std::uint8_t scalar,
                         const std::array<int, 3>& offset, const std::array<int, 3>& part,
                         std::string& out) {
  append_number(out, kImageVersion);
  append_number(out, static_cast<std::uint8_t>(components));
  append_number(out, scalar);
  append_number(out, static_cast<std::uint8_t>(kLittle));
  append_number(out, static_cast<std::uint8_t>(geometry.coordinates));
  append_sizes(geometry.dims, out);
  for (int axis = 0; axis < 3; ++axis) append_vector(geometry.steps.col(axis), out);
  append_vector(geometry.centre, out);
  append_sizes(offset, out);
  append_sizes(part, out);
}

Status validate_image(const ImageGeometry& geometry) {
  for (const int dim : geometry.dims) {
    if (dim < 1 || dim > kMaxDim) {
      return invalid("dims hold " + std::to_string(dim) + ", must be 1 to 65535");
    }
  }
  if (!geometry.steps.allFinite() || !geometry.centre.allFinite()) {
    return fail(ErrorCode::kNotFinite, "a step or the centre is not finite");
  }
  // The step across a single slice does not matter; some senders leave it zero.
  Mat3 directions = Mat3::Zero();
  Mat3 gram = Mat3::Identity();
  for (int axis = 0; axis < 3; ++axis) {
    if (geometry.dims[static_cast<std::size_t>(axis)] == 1) continue;
    directions.col(axis) = geometry.steps.col(axis).cast<double>().normalized();
    gram(axis, axis) = 0.0;
  }
  gram += directions.transpose() * directions;
  // sin^2 of the angle between them; single precision does not tell smaller angles from none.
  if (!(gram.determinant() > 1e-12)) return invalid("two steps are parallel, or one is zero");
  return {};
}

Status validate_part(const ImageGeometry& geometry, int components,
                     const std::array<int, 3>& offset, const std::array<int, 3>& part,
                     std::uint64_t numbers) {
  if (Status status = validate_image(geometry); !status) return status;
  if (components < 1 || components > kMaxComponents) {
    return invalid(std::to_string(components) + " components, must be 1 to 255");
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (offset[axis] < 0 || part[axis] < 1 || part[axis] > geometry.dims[axis] - offset[axis]) {
      return invalid("part of " + std::to_string(part[axis]) + " voxels from voxel " +
                     std::to_string(offset[axis]) + " on, the volume has " +
                     std::to_string(geometry.dims[axis]));
    }
  }
  const std::uint64_t expected = grid_size(part) * static_cast<std::uint64_t>(components);
  if (numbers != expected) {
    return invalid(std::to_string(numbers) + " numbers, must be " + std::to_string(expected));
  }
  return {};
}

std::array<int, 3> take_sizes(ByteReader& reader) {
  std::array<int, 3> sizes{};
  for (int& size : sizes) size = reader.number<std::uint16_t>();
  return sizes;
}

Eigen::Vector3f take_vector(ByteReader& reader) {
  Eigen::Vector3f vector;
  for (float& coordinate : vector) coordinate = reader.real();
  return vector;
}

// Precondition: bytes hold a multiple of sizeof(T).
template <typename T>
Voxels take_voxels(std::string_view bytes, Endian endian) {
  std::vector<T> numbers(bytes.size() / sizeof(T));
  if (numbers.empty()) return numbers;
  std::memcpy(numbers.data(), bytes.data(), bytes.size());
  if ((endian == kLittle) != (std::endian::native == std::endian::little)) {
    reverse_each<sizeof(T)>(reinterpret_cast<char*>(numbers.data()), numbers.size());
  }
  return numbers;
}

// Calls take<T>() for the type that the number stands for. False: none.
template <typename Take>
bool with_type(std::uint8_t scalar, const Take& take) {
  switch (scalar) {
    case scalar_type<std::int8_t>(): take.template operator()<std::int8_t>(); return true;
    case scalar_type<std::uint8_t>(): take.template operator()<std::uint8_t>(); return true;
    case scalar_type<std::int16_t>(): take.template operator()<std::int16_t>(); return true;
    case scalar_type<std::uint16_t>(): take.template operator()<std::uint16_t>(); return true;
    case scalar_type<std::int32_t>(): take.template operator()<std::int32_t>(); return true;
    case scalar_type<std::uint32_t>(): take.template operator()<std::uint32_t>(); return true;
    case scalar_type<float>(): take.template operator()<float>(); return true;
    case scalar_type<double>(): take.template operator()<double>(); return true;
    default: return false;
  }
}

}  // namespace

std::size_t ImageGeometry::num_voxels() const { return grid_size(dims); }

AffineTransform ImageGeometry::T_ras_voxel() const {
  const Vec3 middle = 0.5 * Vec3(dims[0] - 1, dims[1] - 1, dims[2] - 1);
  AffineTransform T = AffineTransform::Identity();
  T.linear() = steps.cast<double>();
  T.translation() = centre.cast<double>() - T.linear() * middle;
  if (coordinates == Coordinates::kLps) T = AffineTransform(Eigen::Scaling(-1.0, -1.0, 1.0)) * T;
  return T;
}

ImageGeometry image_geometry(const std::array<int, 3>& dims, const AffineTransform& T_ras_voxel) {
  ImageGeometry geometry;
  geometry.dims = dims;
  geometry.steps = T_ras_voxel.linear().cast<float>();
  const Vec3 middle = 0.5 * Vec3(dims[0] - 1, dims[1] - 1, dims[2] - 1);
  geometry.centre = (T_ras_voxel * middle).cast<float>();
  return geometry;
}

Status validate(const Image& image) {
  const std::uint64_t numbers =
      std::visit([](const auto& voxels) { return std::uint64_t{voxels.size()}; }, image.voxels);
  return validate_part(image.geometry, image.components, image.offset, image.part, numbers);
}

Status validate(const ImageView& image) {
  const std::uint64_t numbers =
      std::visit([](const auto& voxels) { return std::uint64_t{voxels.size()}; }, image.voxels);
  return validate_part(image.geometry, image.components, {0, 0, 0}, image.geometry.dims, numbers);
}

void append_content(const Image& image, std::string& out) {
  std::visit(
      [&]<typename T>(const std::vector<T>& voxels) {
        append_image_header(image.geometry, image.components, scalar_type<T>(), image.offset,
                            image.part, out);
        append_little_endian(std::span<const T>(voxels), out);
      },
      image.voxels);
}

void append_content(const ImageView& image, std::string& out) {
  std::visit(
      [&]<typename T>(std::span<const T> voxels) {
        append_image_header(image.geometry, image.components, scalar_type<T>(), {0, 0, 0},
                            image.geometry.dims, out);
        append_little_endian(voxels, out);
      },
      image.voxels);
}

Result<Image> decode_image(std::string_view content) {
  if (content.size() < kImageHeaderBytes)
    return wrong_size(content, "at least ", kImageHeaderBytes);
  ByteReader reader(content);
  if (const auto version = reader.number<std::uint16_t>(); version != kImageVersion) {
    return malformed("version " + std::to_string(version) + ", must be 1");
  }
  Image image;
  image.components = reader.number<std::uint8_t>();
  const auto scalar = reader.number<std::uint8_t>();
  const auto endian = reader.number<std::uint8_t>();
  const auto coordinates = reader.number<std::uint8_t>();
  if (endian != kBig && endian != kLittle) {
    return malformed("endian " + std::to_string(endian) + ", must be 1 or 2");
  }
  if (coordinates != 1 && coordinates != 2) {
    return malformed("coordinates " + std::to_string(coordinates) + ", must be 1 or 2");
  }
  image.geometry.coordinates = static_cast<Coordinates>(coordinates);
  image.geometry.dims = take_sizes(reader);
  for (int axis = 0; axis < 3; ++axis) image.geometry.steps.col(axis) = take_vector(reader);
  image.geometry.centre = take_vector(reader);
  image.offset = take_sizes(reader);
  image.part = take_sizes(reader);

  Status status;
  const bool known = with_type(scalar, [&]<typename T>() {
    // In bytes first: what is no multiple of sizeof(T) cannot be the right number.
    const std::string_view bytes = reader.rest();
    // At most 65535^3 * 255 * 8 < 2^59: no overflow.
    const std::uint64_t expected =
        grid_size(image.part) * static_cast<std::uint64_t>(image.components) * sizeof(T);
    if (bytes.size() != expected) {
      status = malformed(std::to_string(bytes.size()) + " bytes of voxels, must be " +
                         std::to_string(expected));
      return;
    }
    status = validate_part(image.geometry, image.components, image.offset, image.part,
                           bytes.size() / sizeof(T));
    if (status) image.voxels = take_voxels<T>(bytes, static_cast<Endian>(endian));
  });
  if (!known) {
    return malformed("scalar type " + std::to_string(scalar) + ", must be 2 to 7, 10 or 11");
  }
  if (!status) return malformed(status.error().message);
  return image;
}

}  // namespace brainshift::igtl
