// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/fields/field_files.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include "common/io/files/file_access.hpp"
#include "common/io/model/hdf5_access.hpp"

namespace brainshift::io {
namespace {

constexpr const char* kGroup = "TransformGroup/0";
constexpr const char* kType = "DisplacementFieldTransform_double_3_3";
// Numbers in a piece that is compressed on its own: 1 MiB.
constexpr hsize_t kChunk = hsize_t{1} << 17;
constexpr unsigned kDeflateLevel = 1;  // as field_files.cpp

std::vector<double> fixed_parameters(const VoxelGrid& grid) {
  const Mat3 lps_ras = Vec3(-1, -1, 1).asDiagonal();
  const Vec3 origin = lps_ras * grid.T_ras_voxel.translation(), spacing = grid.spacing_mm();
  const Mat3 direction = lps_ras * grid.directions();
  std::vector<double> values(grid.dims.begin(), grid.dims.end());
  for (const Vec3& vector : {origin, spacing})
    values.insert(values.end(), vector.begin(), vector.end());
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) values.push_back(direction(row, column));
  }
  return values;
}

void write_type(hid_t file) {
  const Hdf5Handle type(H5Tcopy(H5T_C_S1), H5Tclose, "type");
  check_hdf5(H5Tset_size(type.get(), H5T_VARIABLE), "type");
  check_hdf5(H5Tset_cset(type.get(), H5T_CSET_ASCII), "type");
  const hsize_t one[1] = {1};
  const Hdf5Handle space(H5Screate_simple(1, one, nullptr), H5Sclose, "type");
  const Hdf5Handle set(H5Dcreate2(file, (std::string(kGroup) + "/TransformType").c_str(),
                                  type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                       H5Dclose, "type");
  const char* const texts[1] = {kType};
  check_hdf5(H5Dwrite(set.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, texts), "type");
}

// Piece by piece: the doubles of a whole field would take twice its memory again.
void write_parameters(hid_t file, const std::vector<float>& ras_mm) {
  const std::string what = "parameters";
  const hsize_t size[1] = {ras_mm.size()};
  const hsize_t chunk[1] = {std::min(kChunk, size[0])};
  const Hdf5Handle layout(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, what);
  check_hdf5(H5Pset_chunk(layout.get(), 1, chunk), what);
  check_hdf5(H5Pset_shuffle(layout.get()), what);
  check_hdf5(H5Pset_deflate(layout.get(), kDeflateLevel), what);
  const Hdf5Handle space(H5Screate_simple(1, size, nullptr), H5Sclose, what);
  const Hdf5Handle set(
      H5Dcreate2(file, (std::string(kGroup) + "/TransformParameters").c_str(), H5T_IEEE_F64LE,
                 space.get(), H5P_DEFAULT, layout.get(), H5P_DEFAULT),
      H5Dclose, what);
  std::vector<double> piece;
  for (hsize_t first = 0; first < size[0]; first += kChunk) {
    const hsize_t count[1] = {std::min(kChunk, size[0] - first)}, start[1] = {first};
    piece.resize(count[0]);
    for (hsize_t i = 0; i < count[0]; ++i) {
      const double value = ras_mm[first + i];
      piece[i] = (first + i) % 3 < 2 ? -value : value;
    }
    check_hdf5(H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, start, nullptr, count, nullptr),
               what);
    const Hdf5Handle memory(H5Screate_simple(1, count, nullptr), H5Sclose, what);
    check_hdf5(H5Dwrite(set.get(), H5T_NATIVE_DOUBLE, memory.get(), space.get(), H5P_DEFAULT,
                        piece.data()),
               what);
  }
}

}  // namespace

Status write_itk_transform(const std::filesystem::path& path, const DisplacementField& field) {
  if (Status ok = validate(field); !ok) return file_error(path, ok.error());
  if (path.extension() != ".h5") return unreadable(path, "must end in .h5");
  auto pending = PendingFile::create(path);
  if (!pending) return tl::unexpected(pending.error());
  try {
    const QuietHdf5 quiet;
    Hdf5Handle file(
        H5Fcreate(pending->temporary_path().c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT),
        H5Fclose, "file");
    Hdf5Writer out(file.get());
    out.attribute("/", "direction", std::string(to_string(field.direction)));
    out.attribute("/", "frame", std::string("LPS"));
    out.attribute("/", "length_unit", std::string("mm"));
    out.attribute("/", "note", field.note);
    out.group("TransformGroup");
    out.group(kGroup);
    write_type(file.get());
    out.write(std::string(kGroup) + "/TransformFixedParameters", fixed_parameters(field.grid));
    write_parameters(file.get(), field.ras_mm);
    check_hdf5(H5Fflush(file.get(), H5F_SCOPE_GLOBAL), "buffers");
    if (!file.close()) throw Hdf5Problem{"buffers"};
  } catch (const Hdf5Problem& problem) {
    return write_failed(path, "cannot write " + problem.message);
  }
  return pending->commit();
}

}  // namespace brainshift::io
