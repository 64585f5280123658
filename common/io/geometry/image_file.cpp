// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/image_file.hpp"

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
#include <string_view>

#include "common/io/files/binary_codec.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

// ---- voxels as numbers ----

using Converter = void (*)(const void* data, double slope, double intercept,
                           std::vector<float>& values);

template <typename T>
void convert(const void* data, double slope, double intercept, std::vector<float>& values) {
  const auto* bytes = static_cast<const unsigned char*>(data);
  for (std::size_t i = 0; i < values.size(); ++i) {
    T value;
    std::memcpy(&value, bytes + i * sizeof(T), sizeof(T));
    values[i] = static_cast<float>(static_cast<double>(value) * slope + intercept);
  }
}

// Null for a type that is neither integer nor real.
Converter converter_of(int datatype) {
  switch (datatype) {
    case DT_UINT8: return convert<std::uint8_t>;
    case DT_INT8: return convert<std::int8_t>;
    case DT_UINT16: return convert<std::uint16_t>;
    case DT_INT16: return convert<std::int16_t>;
    case DT_UINT32: return convert<std::uint32_t>;
    case DT_INT32: return convert<std::int32_t>;
    case DT_UINT64: return convert<std::uint64_t>;
    case DT_INT64: return convert<std::int64_t>;
    case DT_FLOAT32: return convert<float>;
    case DT_FLOAT64: return convert<double>;
    case DT_FLOAT128: return convert<long double>;
    default: return nullptr;
  }
}

// ---- the header, checked before libnifti sees the file ----
//
// libnifti prints complaints of its own to stderr, takes an impossible place of the voxels for
// another one, and trusts the sizes of what lies before it. With a file that passes it does none of
// that.

struct Free {
  void operator()(char* text) const { std::free(text); }
};

// deflate cannot do better than about 1032:1, so a header that promises more than this lies.
constexpr double kLargestExpansion = 1040.0;
constexpr std::size_t kNifti1Bytes = 348;
constexpr std::size_t kNifti2Bytes = 540;
constexpr int kMaxVoxelsAlong = 32767;

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

// Precondition: `bytes` hold the whole header.
template <typename Dim, typename Offset>
void fill(PackedHeader& header, std::string_view bytes, const Layout& layout, bool swapped) {
  for (std::size_t i = 0; i < header.dim.size(); ++i) {
    header.dim[i] = load_number<Dim>(bytes.data() + layout.dim + i * sizeof(Dim), swapped);
  }
  header.datatype = load_number<std::int16_t>(bytes.data() + layout.datatype, swapped);
  header.vox_offset =
      static_cast<double>(load_number<Offset>(bytes.data() + layout.vox_offset, swapped));
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
    const auto size = static_cast<std::size_t>(load_number<std::uint32_t>(bytes.data(), swapped));
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
    if (header.dim[axis] > kMaxVoxelsAlong) {
      return fmt::format("dimension {} has {} voxels: must be at most {}", axis, header.dim[axis],
                         kMaxVoxelsAlong);
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
  if (converter_of(header.datatype) != nullptr) return {};
  return fmt::format("voxel type {} ({}) is not supported: must be integer or real",
                     nifti_datatype_string(header.datatype), header.datatype);
}

std::string check_offset(const PackedHeader& header) {
  // libnifti keeps it as an int.
  constexpr double kMax = std::numeric_limits<int>::max();
  const double least = header.single_file ? static_cast<double>(header.bytes) : 0.0;
  const double offset = header.vox_offset;
  const bool whole = offset == std::floor(offset);  // false for NaN
  if (offset == 0.0 || (whole && offset >= least && offset <= kMax)) return {};
  return fmt::format("vox_offset is {}: must be a whole number, {} to {:.0f}", offset, least, kMax);
}

// Bytes that a regular file can hold at most once unpacked: its size, or for a .gz file what
// deflate can make of it.
double largest_content(const fs::path& path) {
  const auto size = static_cast<double>(fs::file_size(path));
  return nifti_is_gzfile(path.c_str()) != 0 ? size * kLargestExpansion : size;
}

// Ok for a NIfTI-1 or -2 header (.nii, .nii.gz, .hdr) of one 3-D volume of integer or real voxels:
// 1 to 32767 voxels along each axis, one entry along every other, and vox_offset a whole number
// behind the header (0 in a single file: right behind it) and inside the file. Precondition: `path`
// is a regular file.
Status check_nifti_header(const fs::path& path) {
  const std::unique_ptr<char, Free> header_file(nifti_findhdrname(path.c_str()));
  const auto header = header_file ? parse(first_bytes(header_file.get())) : std::nullopt;
  if (!header && nifti_is_gzfile(path.c_str()) == 0) {
    const Result<std::string> bytes = read_file(path);
    if (bytes && bytes->starts_with("\x1F\x8B")) {
      return unreadable(path, "is compressed by gzip: its name must end in .nii.gz");
    }
  }
  if (!header) return unreadable(path, "is not a NIfTI image");
  for (const auto check : {check_dimensions, check_datatype, check_offset}) {
    if (const std::string problem = check(*header); !problem.empty()) {
      return unreadable(path, problem);
    }
  }
  const double most = header->single_file ? largest_content(header_file.get()) : header->vox_offset;
  if (header->vox_offset > most) {
    return unreadable(
        path, fmt::format("vox_offset is {}: beyond the end of the file", header->vox_offset));
  }
  return {};
}

// ---- what libnifti reads ----

struct FreeImage {
  void operator()(nifti_image* image) const { nifti_image_free(image); }
};
using ImageHandle = std::unique_ptr<nifti_image, FreeImage>;

// Where the sform contradicts the rest of the header, or nothing. An sform of another code may lie
// in another space than the qform, but a voxel has one size.
std::string contradiction(const nifti_image& image) {
  const double pixdim[] = {image.dx, image.dy, image.dz};
  const auto entry = [](const nifti_dmat44& m, int row, int column) { return m.m[row][column]; };
  double steps[3] = {}, apart_mm = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    for (int row = 0; row < 3; ++row) {
      steps[axis] = std::hypot(steps[axis], entry(image.sto_xyz, row, axis));
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    // NaN: the check of the matrix names it. 0: the header does not say.
    const double size = std::abs(pixdim[axis]);
    if (size > 0.0 && std::abs(steps[axis] - size) > kLargestStepError * size) {
      return fmt::format(
          "contradicts itself: its sform has steps of {:.4g} x {:.4g} x {:.4g} mm, its pixdim of "
          "{:.4g} x {:.4g} x {:.4g}; resave it with the right ones",
          steps[0], steps[1], steps[2], pixdim[0], pixdim[1], pixdim[2]);
    }
  }
  // Atlases often have a qform that nobody filled in; of them the sform counts, as in the standard.
  const bool both =
      image.sform_code == NIFTI_XFORM_SCANNER_ANAT && image.qform_code == NIFTI_XFORM_SCANNER_ANAT;
  if (!both) return {};
  for (int corner = 0; corner < 8; ++corner) {
    double squares = 0.0;
    for (int row = 0; row < 3; ++row) {
      double d = entry(image.sto_xyz, row, 3) - entry(image.qto_xyz, row, 3);
      for (int axis = 0; axis < 3; ++axis) {
        const double index =
            ((corner >> axis) & 1) != 0 ? static_cast<double>(image.dim[axis + 1] - 1) : 0.0;
        d += index * (entry(image.sto_xyz, row, axis) - entry(image.qto_xyz, row, axis));
      }
      squares += d * d;
    }
    apart_mm = std::max(apart_mm, std::sqrt(squares));
  }
  if (apart_mm <= 0.5 * *std::min_element(steps, steps + 3)) return {};
  return fmt::format(
      "contradicts itself: its sform and its qform, both of the scanner's space (code 1), put a "
      "voxel "
      "{:.3g} mm apart; resave it with one of them",
      apart_mm);
}

// The sform when there is one, else the qform; NIfTI-1 "method 3" before "method 2".
Result<AffineTransform> affine_of(const nifti_image& image, const fs::path& path) {
  if (image.xyz_units != NIFTI_UNITS_MM && image.xyz_units != NIFTI_UNITS_UNKNOWN) {
    return unreadable(path, std::string("spatial unit is '") + nifti_units_string(image.xyz_units) +
                                "': must be mm");
  }
  if (image.sform_code <= 0 && image.qform_code <= 0) {
    return unreadable(path,
                      "has no affine (sform_code and qform_code are 0), so its place is unknown");
  }
  const bool use_sform = image.sform_code > 0;
  const nifti_dmat44& matrix = use_sform ? image.sto_xyz : image.qto_xyz;
  AffineTransform affine = AffineTransform::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) affine(row, column) = matrix.m[row][column];
  }
  const std::string name = use_sform ? "sform" : "qform";
  if (!affine.matrix().allFinite()) {
    return unreadable(path, name + " has entries that are not finite");
  }
  // Relative to the voxel edges, so that the test does not depend on the voxel size.
  const double volume = affine.linear().colwise().norm().prod();
  if (!(std::abs(affine.linear().determinant()) > 1e-6 * volume)) {
    return unreadable(path, name + " is singular");
  }
  if (use_sform) {
    if (const std::string problem = contradiction(image); !problem.empty()) {
      return unreadable(path, problem);
    }
  }
  return affine;
}

// Before any voxel is read: the file is large enough for them.
Status check_voxels(const nifti_image& image, const fs::path& path) {
  // The data may lie in a second file (.img); libnifti has looked it up.
  const fs::path data_file = image.iname != nullptr ? fs::path(image.iname) : path;
  if (Status exists = check_regular_file(data_file); !exists) return exists;
  const double needed = static_cast<double>(image.nvox) * image.nbyper;
  const double available = largest_content(data_file) - static_cast<double>(image.iname_offset);
  if (needed > available) {
    return unreadable(
        path, fmt::format("is truncated: the header promises {:.0f} bytes of voxels", needed));
  }
  return {};
}

}  // namespace

Result<VoxelImage> read_nifti(const fs::path& path) {
  if (Status regular = check_regular_file(path); !regular) return tl::unexpected(regular.error());
  nifti_set_debug_level(0);  // else the library prints to stderr even for good files
  if (Status header = check_nifti_header(path); !header) return tl::unexpected(header.error());
  ImageHandle image(nifti_image_read(path.c_str(), 0));
  // libnifti also reads ANALYZE 7.5 (which has no affine) and an ASCII form that nobody writes.
  const bool is_nifti =
      image && image->nifti_type != NIFTI_FTYPE_ANALYZE && image->nifti_type != NIFTI_FTYPE_ASCII;
  if (!is_nifti) return unreadable(path, "is not a NIfTI image");
  if (Status voxels = check_voxels(*image, path); !voxels) return tl::unexpected(voxels.error());
  Result<AffineTransform> affine = affine_of(*image, path);
  if (!affine) return tl::unexpected(affine.error());

  // scl_slope 0 means "no scaling" (NIfTI-1 standard).
  const double slope = image->scl_slope == 0.0 ? 1.0 : image->scl_slope;
  const double intercept = image->scl_slope == 0.0 ? 0.0 : image->scl_inter;
  if (!std::isfinite(slope) || !std::isfinite(intercept)) {
    return unreadable(path, "scl_slope or scl_inter is not finite");
  }
  if (nifti_image_load(image.get()) != 0 || image->data == nullptr) {
    return unreadable(path, "is truncated or damaged: voxels cannot be read");
  }

  VoxelImage result;
  for (int axis = 0; axis < 3; ++axis) {
    result.dims[static_cast<std::size_t>(axis)] = static_cast<int>(image->dim[axis + 1]);
  }
  result.T_ras_voxel = *affine;
  result.values.resize(result.num_voxels());
  converter_of(image->datatype)(image->data, slope, intercept, result.values);
  return result;
}

}  // namespace brainshift::io
