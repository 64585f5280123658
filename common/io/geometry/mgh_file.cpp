// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/mgh_file.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>

#include "common/io/files/binary_codec.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

constexpr std::size_t kHeaderBytes = 284;
constexpr int kMaxMghVoxelsAlong = 32767;
constexpr bool kSwapMgh = std::endian::native == std::endian::little;

struct CloseMgh {
  void operator()(gzFile_s* file) const { gzclose(file); }
};

// Reads whole pieces, so that a header that promises too much takes no memory for it.
bool append_bytes(gzFile_s* file, std::size_t size, std::string& bytes) {
  constexpr std::size_t kPieceBytes = std::size_t{1} << 24;
  while (size > 0) {
    const std::size_t piece = std::min(size, kPieceBytes), begin = bytes.size();
    bytes.resize(begin + piece);
    if (gzread(file, &bytes[begin], static_cast<unsigned>(piece)) != static_cast<int>(piece)) {
      return false;
    }
    size -= piece;
  }
  return true;
}

template <typename T>
T number_at(const std::string& bytes, std::size_t offset) {
  return load_number<T>(bytes.data() + offset, kSwapMgh);
}

template <typename T>
void fill_values(const std::string& bytes, VoxelImage& image) {
  for (std::size_t v = 0; v < image.num_voxels(); ++v) {
    image.values.push_back(static_cast<float>(number_at<T>(bytes, v * sizeof(T))));
  }
}

Result<VoxelImage> read_volume_of(gzFile_s* file) {
  std::string head;
  if (!append_bytes(file, kHeaderBytes, head) || number_at<std::int32_t>(head, 0) != 1) {
    return unreadable("is not a volume of FreeSurfer (.mgh, .mgz)");
  }
  VoxelImage image;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    image.dims[axis] = number_at<std::int32_t>(head, 4 + 4 * axis);
    if (image.dims[axis] < 1 || image.dims[axis] > kMaxMghVoxelsAlong) {
      return unreadable(fmt::format("has {} voxels along axis {}: must be 1 to {}",
                                    image.dims[axis], axis, kMaxMghVoxelsAlong));
    }
  }
  const auto frames = number_at<std::int32_t>(head, 16), type = number_at<std::int32_t>(head, 20);
  if (frames != 1) return unreadable(fmt::format("has {} frames: must be one volume", frames));
  if (type != 0 && type != 1 && type != 3 && type != 4) {
    return unreadable(
        fmt::format("type = {}: must be 0 (uint8), 1 (int32), 3 (float) or 4 (int16)", type));
  }
  if (number_at<std::int16_t>(head, 28) == 0) {
    return unreadable("goodRASFlag = 0: says nowhere where its voxels lie");
  }
  const auto real = [&](std::size_t i) {
    return static_cast<double>(number_at<float>(head, 30 + 4 * i));
  };
  for (int axis = 0; axis < 3; ++axis) {
    const auto at = static_cast<std::size_t>(3 + 3 * axis);
    image.T_ras_voxel.linear().col(axis) =
        real(static_cast<std::size_t>(axis)) * Vec3(real(at), real(at + 1), real(at + 2));
  }
  const Mat3 linear = image.T_ras_voxel.linear();
  const Vec3 middle = 0.5 * Vec3(image.dims[0], image.dims[1], image.dims[2]);
  image.T_ras_voxel.translation() = Vec3(real(12), real(13), real(14)) - linear * middle;
  const bool finite = image.T_ras_voxel.matrix().allFinite();
  if (!finite || !(std::abs(linear.determinant()) > 1e-6 * linear.colwise().norm().prod())) {
    return unreadable("its steps and directions are not finite or linearly dependent");
  }
  std::string bytes;
  const std::size_t width = type == 0 ? 1 : type == 4 ? 2 : 4;
  if (!append_bytes(file, image.num_voxels() * width, bytes)) {
    return unreadable("is truncated or damaged: voxels cannot be read");
  }
  image.values.reserve(image.num_voxels());
  if (type == 0) fill_values<std::uint8_t>(bytes, image);
  if (type == 1) fill_values<std::int32_t>(bytes, image);
  if (type == 3) fill_values<float>(bytes, image);
  if (type == 4) fill_values<std::int16_t>(bytes, image);
  return image;
}

}  // namespace

Result<VoxelImage> read_mgh(const std::filesystem::path& path) {
  if (Status regular = check_regular_file(path); !regular) return tl::unexpected(regular.error());
  const std::unique_ptr<gzFile_s, CloseMgh> file(gzopen(path.c_str(), "rb"));
  if (!file) return unreadable(path, "cannot be opened");
  auto image = read_volume_of(file.get());
  if (!image) return file_error(path, image.error());
  return image;
}

}  // namespace brainshift::io
