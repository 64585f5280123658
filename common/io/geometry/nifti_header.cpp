// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/nifti_header.hpp"

#include <fmt/format.h>
#include <nifti2_io.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

struct Free {
  void operator()(char* text) const { std::free(text); }
};

// deflate cannot do better than about 1032:1, so a header that promises more than this lies.
constexpr double kLargestExpansion = 1040.0;
constexpr std::size_t kNifti1Bytes = 348;
constexpr std::size_t kNifti2Bytes = 540;
constexpr int kMostVoxelsAlong = 32767;

// Byte offsets of nifti1.h and nifti2.h.
struct Layout {
  std::size_t dim, datatype, vox_offset;
};
constexpr Layout kNifti1 = {40, 70, 108};
constexpr Layout kNifti2 = {16, 12, 168};

// What is looked at, in this machine's byte order.
struct PackedHeader {
  bool single_file = false;  // voxels lie behind the header, else in a second file
  std::size_t bytes = 0;     // of the header
  std::array<std::int64_t, 8> dim{};
  int datatype = 0;
  double vox_offset = 0.0;
};

template <typename T>
T field(std::string_view bytes, std::size_t offset, bool swapped) {
  std::array<char, sizeof(T)> raw{};
  bytes.copy(raw.data(), sizeof(T), offset);
  if (swapped) std::reverse(raw.begin(), raw.end());
  T value;
  std::memcpy(&value, raw.data(), sizeof(T));
  return value;
}

template <typename Dim, typename Offset>
void fill(PackedHeader& header, std::string_view bytes, const Layout& layout, bool swapped) {
  for (std::size_t i = 0; i < header.dim.size(); ++i) {
    header.dim[i] = field<Dim>(bytes, layout.dim + i * sizeof(Dim), swapped);
  }
  header.datatype = field<std::int16_t>(bytes, layout.datatype, swapped);
  header.vox_offset = static_cast<double>(field<Offset>(bytes, layout.vox_offset, swapped));
}

// The bytes of the largest header, or all that there are.
std::string first_bytes(const fs::path& path) {
  znzFile file = znzopen(path.c_str(), "rb", nifti_is_gzfile(path.c_str()));
  if (znz_isnull(file)) return {};
  std::string bytes(kNifti2Bytes, '\0');
  bytes.resize(std::min(bytes.size(), znzread(bytes.data(), 1, bytes.size(), file)));
  znzclose(file);
  return bytes;
}

// None: no NIfTI header. An ANALYZE 7.5 header has no magic, and no affine.
std::optional<PackedHeader> parse(std::string_view bytes) {
  const auto has_magic = [&](std::size_t offset, std::string_view magic) {
    return bytes.substr(offset, magic.size()) == magic;
  };
  if (bytes.size() < kNifti1Bytes) return std::nullopt;
  PackedHeader header;
  for (const bool swapped : {false, true}) {
    const auto size = static_cast<std::size_t>(field<std::uint32_t>(bytes, 0, swapped));
    header.bytes = size;
    using namespace std::string_view_literals;
    if (size == kNifti1Bytes && (has_magic(344, "n+1\0"sv) || has_magic(344, "ni1\0"sv))) {
      header.single_file = bytes[345] == '+';
      fill<std::int16_t, float>(header, bytes, kNifti1, swapped);
      return header;
    }
    if (size == kNifti2Bytes && bytes.size() == kNifti2Bytes &&
        (has_magic(4, "n+2\0\r\n\032\n"sv) || has_magic(4, "ni2\0\r\n\032\n"sv))) {
      header.single_file = bytes[5] == '+';
      fill<std::int64_t, std::int64_t>(header, bytes, kNifti2, swapped);
      return header;
    }
  }
  return std::nullopt;
}

// Each of the following: what is wrong, or nothing.

std::string check_dimensions(const PackedHeader& header) {
  const std::int64_t dimensions = header.dim[0];
  for (std::size_t axis = 1; axis <= 3; ++axis) {
    if (dimensions < 3 || dimensions > 7 || header.dim[axis] < 1) {
      return fmt::format("is not a 3-D image ({} dimensions)", dimensions);
    }
    if (header.dim[axis] > kMostVoxelsAlong) {
      return fmt::format("dimension {} has {} voxels: must be at most {}", axis, header.dim[axis],
                         kMostVoxelsAlong);
    }
  }
  for (std::size_t axis = 4; axis <= static_cast<std::size_t>(dimensions); ++axis) {
    if (header.dim[axis] > 1) {
      return fmt::format("dimension {} has {} entries: only one volume can be read", axis,
                         header.dim[axis]);
    }
  }
  return {};
}

std::string check_datatype(const PackedHeader& header) {
  switch (header.datatype) {
    case DT_UINT8:
    case DT_INT8:
    case DT_UINT16:
    case DT_INT16:
    case DT_UINT32:
    case DT_INT32:
    case DT_UINT64:
    case DT_INT64:
    case DT_FLOAT32:
    case DT_FLOAT64:
    case DT_FLOAT128: return {};
    default:
      return fmt::format("voxel type {} ({}) is not supported: must be integer or real",
                         nifti_datatype_string(header.datatype), header.datatype);
  }
}

std::string check_offset(const PackedHeader& header) {
  // libnifti keeps it as an int.
  constexpr double kMost = std::numeric_limits<int>::max();
  const double least = header.single_file ? static_cast<double>(header.bytes) : 0.0;
  const double offset = header.vox_offset;
  const bool whole = offset == std::floor(offset);  // false for NaN
  if (offset == 0.0 || (whole && offset >= least && offset <= kMost)) return {};
  return fmt::format("vox_offset is {}: must be a whole number, {} to {:.0f}", offset, least,
                     kMost);
}

}  // namespace

Status check_nifti_header(const fs::path& path) {
  const std::unique_ptr<char, Free> header_file(nifti_findhdrname(path.c_str()));
  const auto header = header_file ? parse(first_bytes(header_file.get())) : std::nullopt;
  if (!header) return file_error(ErrorCode::kUnreadable, path, "is not a NIfTI image");
  for (const auto check : {check_dimensions, check_datatype, check_offset}) {
    if (const std::string problem = check(*header); !problem.empty()) {
      return file_error(ErrorCode::kUnreadable, path, problem);
    }
  }
  const double most = header->single_file ? largest_content(header_file.get()) : header->vox_offset;
  if (header->vox_offset > most) {
    return file_error(
        ErrorCode::kUnreadable, path,
        fmt::format("vox_offset is {}: beyond the end of the file", header->vox_offset));
  }
  return {};
}

double largest_content(const fs::path& path) {
  const auto size = static_cast<double>(fs::file_size(path));
  return nifti_is_gzfile(path.c_str()) != 0 ? size * kLargestExpansion : size;
}

}  // namespace brainshift::io
