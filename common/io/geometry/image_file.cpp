// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/image_file.hpp"

#include <nifti2_io.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <sstream>

#include "common/io/files/file_access.hpp"
#include "common/io/geometry/nifti_header.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

struct FreeImage {
  void operator()(nifti_image* image) const { nifti_image_free(image); }
};
using ImageHandle = std::unique_ptr<nifti_image, FreeImage>;

// The sform when there is one, else the qform; NIfTI-1 "method 3" before "method 2".
Result<AffineTransform> affine_of(const nifti_image& image, const fs::path& path) {
  if (image.xyz_units != NIFTI_UNITS_MM && image.xyz_units != NIFTI_UNITS_UNKNOWN) {
    return file_error(
        ErrorCode::kUnreadable, path,
        std::string("spatial unit is '") + nifti_units_string(image.xyz_units) + "': must be mm");
  }
  if (image.sform_code <= 0 && image.qform_code <= 0) {
    return file_error(ErrorCode::kUnreadable, path,
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
    return file_error(ErrorCode::kUnreadable, path, name + " has entries that are not finite");
  }
  // Relative to the voxel edges, so that the test does not depend on the voxel size.
  const double volume = affine.linear().colwise().norm().prod();
  if (!(std::abs(affine.linear().determinant()) > 1e-6 * volume)) {
    return file_error(ErrorCode::kUnreadable, path, name + " is singular");
  }
  return affine;
}

template <typename T>
void convert(const void* data, double slope, double intercept, std::vector<float>& values) {
  const auto* bytes = static_cast<const unsigned char*>(data);
  for (std::size_t i = 0; i < values.size(); ++i) {
    T value;
    std::memcpy(&value, bytes + i * sizeof(T), sizeof(T));
    values[i] = static_cast<float>(static_cast<double>(value) * slope + intercept);
  }
}

void convert_any(const nifti_image& image, double slope, double intercept,
                 std::vector<float>& values) {
  const void* data = image.data;
  switch (image.datatype) {
    case DT_UINT8: return convert<std::uint8_t>(data, slope, intercept, values);
    case DT_INT8: return convert<std::int8_t>(data, slope, intercept, values);
    case DT_UINT16: return convert<std::uint16_t>(data, slope, intercept, values);
    case DT_INT16: return convert<std::int16_t>(data, slope, intercept, values);
    case DT_UINT32: return convert<std::uint32_t>(data, slope, intercept, values);
    case DT_INT32: return convert<std::int32_t>(data, slope, intercept, values);
    case DT_UINT64: return convert<std::uint64_t>(data, slope, intercept, values);
    case DT_INT64: return convert<std::int64_t>(data, slope, intercept, values);
    case DT_FLOAT32: return convert<float>(data, slope, intercept, values);
    case DT_FLOAT64: return convert<double>(data, slope, intercept, values);
    case DT_FLOAT128: return convert<long double>(data, slope, intercept, values);
    default: assert(false && "check_nifti_header() admitted an unknown type");
  }
}

// Before any voxel is read: the file is large enough for them.
Status check_voxels(const nifti_image& image, const fs::path& path) {
  // The data may lie in a second file (.img); libnifti has looked it up.
  const fs::path data_file = image.iname != nullptr ? fs::path(image.iname) : path;
  if (Status exists = check_regular_file(data_file); !exists) return exists;
  const double needed = static_cast<double>(image.nvox) * image.nbyper;
  const double available = largest_content(data_file) - static_cast<double>(image.iname_offset);
  if (needed > available) {
    std::ostringstream text;
    text << std::fixed;
    text.precision(0);
    text << "is truncated: the header promises " << needed << " bytes of voxels";
    return file_error(ErrorCode::kUnreadable, path, text.str());
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
  if (!is_nifti) return file_error(ErrorCode::kUnreadable, path, "is not a NIfTI image");
  if (Status voxels = check_voxels(*image, path); !voxels) return tl::unexpected(voxels.error());
  Result<AffineTransform> affine = affine_of(*image, path);
  if (!affine) return tl::unexpected(affine.error());

  // scl_slope 0 means "no scaling" (NIfTI-1 standard).
  const double slope = image->scl_slope == 0.0 ? 1.0 : image->scl_slope;
  const double intercept = image->scl_slope == 0.0 ? 0.0 : image->scl_inter;
  if (!std::isfinite(slope) || !std::isfinite(intercept)) {
    return file_error(ErrorCode::kUnreadable, path, "scl_slope or scl_inter is not finite");
  }
  if (nifti_image_load(image.get()) != 0 || image->data == nullptr) {
    return file_error(ErrorCode::kUnreadable, path,
                      "is truncated or damaged: voxels cannot be read");
  }

  VoxelImage result;
  for (int axis = 0; axis < 3; ++axis) {
    result.dims[static_cast<std::size_t>(axis)] = static_cast<int>(image->dim[axis + 1]);
  }
  result.T_ras_voxel = *affine;
  result.values.resize(result.num_voxels());
  convert_any(*image, slope, intercept, result.values);
  return result;
}

}  // namespace brainshift::io
