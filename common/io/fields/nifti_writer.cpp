// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/fields/nifti_writer.hpp"

#include <fmt/format.h>
#include <nifti1.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <string>
#include <vector>

#include "common/io/fields/gzip_output.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "NIfTI files are written little-endian");
static_assert(sizeof(nifti_1_header) == 348);

// Header, and four zeros: no extension follows.
constexpr std::size_t kVoxelsAt = 352;

template <std::size_t N>
void set_text(char (&place)[N], const std::string& text) {
  std::memcpy(place, text.data(), std::min(text.size(), N - 1));  // the rest is zero already
}

// x_ras = R diag(spacing) (i, j, qfac k) + offset, R a rotation as a quaternion with a >= 0.
void set_affine(nifti_1_header& header, const VoxelGrid& grid) {
  Mat3 rotation = grid.directions();
  const bool flipped = rotation.determinant() < 0.0;
  if (flipped) rotation.col(2) *= -1.0;
  Eigen::Quaterniond q(rotation);
  q.normalize();
  if (q.w() < 0.0) q.coeffs() *= -1.0;
  const Vec3 spacing = grid.spacing_mm(), origin = grid.T_ras_voxel.translation();
  header.pixdim[0] = flipped ? -1.0F : 1.0F;
  for (int axis = 0; axis < 3; ++axis) header.pixdim[axis + 1] = static_cast<float>(spacing[axis]);
  header.quatern_b = static_cast<float>(q.x());
  header.quatern_c = static_cast<float>(q.y());
  header.quatern_d = static_cast<float>(q.z());
  header.qoffset_x = static_cast<float>(origin.x());
  header.qoffset_y = static_cast<float>(origin.y());
  header.qoffset_z = static_cast<float>(origin.z());
  float* const rows[] = {header.srow_x, header.srow_y, header.srow_z};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      rows[row][column] = static_cast<float>(grid.T_ras_voxel(row, column));
    }
  }
  header.qform_code = header.sform_code = NIFTI_XFORM_SCANNER_ANAT;
}

nifti_1_header header_of(const VoxelGrid& grid, const std::string& description) {
  nifti_1_header header;
  std::memset(&header, 0, sizeof header);
  header.sizeof_hdr = sizeof header;
  header.dim[0] = 3;
  for (int axis = 1; axis < 8; ++axis) header.dim[axis] = 1;
  for (int axis = 0; axis < 3; ++axis) {
    header.dim[axis + 1] = static_cast<short>(grid.dims[static_cast<std::size_t>(axis)]);
  }
  header.datatype = DT_FLOAT32;
  header.bitpix = 32;
  header.vox_offset = static_cast<float>(kVoxelsAt);
  header.scl_slope = 1.0F;
  header.xyzt_units = NIFTI_UNITS_MM;
  set_text(header.descrip, description);
  std::memcpy(header.magic, "n+1", 4);
  set_affine(header, grid);
  return header;
}

Result<GzipOutput> begin(const fs::path& path, const nifti_1_header& header) {
  const std::string name = path.filename().string();
  const bool compressed = name.ends_with(".nii.gz");
  if (!compressed && !name.ends_with(".nii")) {
    return file_error(ErrorCode::kUnreadable, path, "must end in .nii or .nii.gz");
  }
  auto file = GzipOutput::create(path, {}, compressed);
  if (!file) return file;
  std::string head(kVoxelsAt, '\0');
  std::memcpy(head.data(), &header, sizeof header);
  if (Status ok = file->write(head.data(), head.size()); !ok) return tl::unexpected(ok.error());
  return file;
}

Status named(const Status& status, const fs::path& path) {
  if (status) return status;
  return file_error(status.error().code, path, status.error().message);
}

}  // namespace

Status write_nifti(const fs::path& path, const DisplacementField& field, VectorFrame vectors) {
  if (Status ok = named(validate(field), path); !ok) return ok;
  nifti_1_header header = header_of(
      field.grid,
      fmt::format("{}, {} mm; {}", to_string(field.direction), to_string(vectors), field.note));
  header.dim[0] = 5;
  header.dim[5] = 3;
  header.intent_code = vectors == VectorFrame::kRas ? NIFTI_INTENT_DISPVECT : NIFTI_INTENT_VECTOR;
  set_text(header.intent_name, std::string(to_string(field.direction)));
  auto file = begin(path, header);
  if (!file) return tl::unexpected(file.error());
  const std::size_t slice = grid_size({field.grid.dims[0], field.grid.dims[1], 1});
  std::vector<float> values(slice);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float sign = vectors == VectorFrame::kLps && axis < 2 ? -1.0F : 1.0F;
    for (std::size_t first = 0; first < field.grid.num_voxels(); first += slice) {
      for (std::size_t i = 0; i < slice; ++i) {
        values[i] = sign * field.ras_mm[3 * (first + i) + axis];
      }
      if (Status ok = file->write(values.data(), slice * sizeof(float)); !ok) return ok;
    }
  }
  return file->commit();
}

Status write_nifti(const fs::path& path, const ScalarVolume& volume) {
  if (Status ok = named(validate(volume), path); !ok) return ok;
  auto file = begin(path, header_of(volume.grid, volume.note));
  if (!file) return tl::unexpected(file.error());
  const std::size_t bytes = volume.values.size() * sizeof(float);
  return file->write(volume.values.data(), bytes).and_then([&] { return file->commit(); });
}

}  // namespace brainshift::io
