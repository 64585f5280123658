// SPDX-License-Identifier: GPL-3.0-or-later
// NIfTI and NRRD; ITK's transforms, which need HDF5, are in itk_transform_file.cpp.
#include "common/io/fields/field_files.hpp"

#include <fmt/format.h>
#include <nifti1.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "fields are written little-endian");
static_assert(sizeof(nifti_1_header) == 348);

// ---- compressed or not ----

// A field's mantissas hardly compress; its zeros do at any level. 6 takes thrice the time of 1 for
// 4 % less.
constexpr const char* kAppendCompressed = "ab1";
constexpr const char* kAppendPlain = "abT";

// A file that appears whole or not at all: plain bytes first, then bytes that are compressed with
// gzip as they come, or not compressed.
class GzipOutput {
 public:
  // Begins with `plain`; all that write() adds is compressed if `compressed`. The same bytes give
  // the same file: no time stands in it. kWriteFailed.
  static Result<GzipOutput> create(const fs::path& path, std::string_view plain, bool compressed) {
    auto pending = PendingFile::create(path);
    if (!pending) return tl::unexpected(pending.error());
    {
      std::ofstream head(pending->temporary_path(), std::ios::binary);
      head.write(plain.data(), static_cast<std::streamsize>(plain.size()));
      head.close();
      if (!head) return write_failed(path, "cannot be written");
    }
    gzFile_s* stream =
        gzopen(pending->temporary_path().c_str(), compressed ? kAppendCompressed : kAppendPlain);
    if (stream == nullptr) return write_failed(path, "cannot be written");
    gzbuffer(stream, 1u << 18);
    return GzipOutput(path, std::move(*pending), stream);
  }

  Status write(const void* bytes, std::size_t size) {
    constexpr std::size_t kPiece = std::size_t{1} << 30;  // gzwrite counts with an int
    const auto* at = static_cast<const char*>(bytes);
    while (size > 0) {
      const std::size_t piece = std::min(size, kPiece);
      errno = 0;
      if (gzwrite(stream_.get(), at, static_cast<unsigned>(piece)) != static_cast<int>(piece)) {
        return failed(errno);
      }
      at += piece;
      size -= piece;
    }
    return {};
  }

  // The file is there now.
  Status commit() {
    errno = 0;
    if (gzclose(stream_.release()) != Z_OK) return failed(errno);
    return pending_.commit();
  }

 private:
  struct Close {
    void operator()(gzFile_s* stream) const { gzclose(stream); }
  };

  GzipOutput(fs::path path, PendingFile pending, gzFile_s* stream)
      : path_(std::move(path)), pending_(std::move(pending)), stream_(stream) {}
  Status failed(int error) const {
    return write_failed(path_, std::string("cannot be written: ") +
                                   (error != 0 ? std::strerror(error) : "the compressor failed"));
  }

  fs::path path_;
  PendingFile pending_;
  std::unique_ptr<gzFile_s, Close> stream_;
};

// ---- NIfTI ----

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
    return unreadable(path, "must end in .nii or .nii.gz");
  }
  auto file = GzipOutput::create(path, {}, compressed);
  if (!file) return file;
  std::string head(kVoxelsAt, '\0');
  std::memcpy(head.data(), &header, sizeof header);
  if (Status ok = file->write(head.data(), head.size()); !ok) return tl::unexpected(ok.error());
  return file;
}

// ---- NRRD ----

std::string lps(const Vec3& ras) {
  // + 0.0: no "-0"
  return fmt::format("({},{},{})", 0.0 - ras.x(), 0.0 - ras.y(), ras.z() + 0.0);
}

std::string nrrd_header_of(const DisplacementField& field) {
  const VoxelGrid& grid = field.grid;
  const Mat3 axes = grid.T_ras_voxel.linear();
  return fmt::format(
      "NRRD0005\n"
      "# displacement field, mm\n"
      "type: float\n"
      "dimension: 4\n"
      "space: left-posterior-superior\n"
      "sizes: 3 {} {} {}\n"
      "space directions: none {} {} {}\n"
      "kinds: vector domain domain domain\n"
      "endian: little\n"
      "encoding: gzip\n"
      "space origin: {}\n"
      "intent_code:=1006\n"
      "displacement field type:={}\n"
      "brainshift note:={}\n"
      "\n",
      grid.dims[0], grid.dims[1], grid.dims[2], lps(axes.col(0)), lps(axes.col(1)),
      lps(axes.col(2)), lps(grid.T_ras_voxel.translation()), to_string(field.direction),
      field.note);
}

}  // namespace

Status write_nifti(const fs::path& path, const DisplacementField& field, VectorFrame vectors) {
  if (Status ok = validate(field); !ok) return file_error(path, ok.error());
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
  if (Status ok = validate(volume); !ok) return file_error(path, ok.error());
  auto file = begin(path, header_of(volume.grid, volume.note));
  if (!file) return tl::unexpected(file.error());
  const std::size_t bytes = volume.values.size() * sizeof(float);
  return file->write(volume.values.data(), bytes).and_then([&] { return file->commit(); });
}

Status write_nrrd(const fs::path& path, const DisplacementField& field) {
  if (Status ok = validate(field); !ok) return file_error(path, ok.error());
  if (path.extension() != ".nrrd") return unreadable(path, "must end in .nrrd");
  auto file = GzipOutput::create(path, nrrd_header_of(field), true);
  if (!file) return tl::unexpected(file.error());
  const std::size_t slice = 3 * grid_size({field.grid.dims[0], field.grid.dims[1], 1});
  std::vector<float> values(slice);
  for (std::size_t first = 0; first < field.ras_mm.size(); first += slice) {
    for (std::size_t i = 0; i < slice; i += 3) {
      values[i] = -field.ras_mm[first + i];
      values[i + 1] = -field.ras_mm[first + i + 1];
      values[i + 2] = field.ras_mm[first + i + 2];
    }
    if (Status ok = file->write(values.data(), slice * sizeof(float)); !ok) return ok;
  }
  return file->commit();
}

}  // namespace brainshift::io
