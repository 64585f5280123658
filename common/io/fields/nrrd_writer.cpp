// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/fields/nrrd_writer.hpp"

#include <fmt/format.h>

#include <bit>
#include <string>
#include <vector>

#include "common/io/fields/gzip_output.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

static_assert(std::endian::native == std::endian::little, "NRRD files are written little-endian");

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

Status write_nrrd(const std::filesystem::path& path, const DisplacementField& field) {
  if (Status ok = validate(field); !ok) {
    return file_error(ok.error().code, path, ok.error().message);
  }
  if (path.extension() != ".nrrd") {
    return file_error(ErrorCode::kUnreadable, path, "must end in .nrrd");
  }
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
