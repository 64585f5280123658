// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/model_file.hpp"

#include <hdf5.h>
#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "common/core/model_id.hpp"
#include "common/io/config_file.hpp"
#include "common/io/file_access.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kHeaderSize = 512;  // the smallest user block that HDF5 knows

// The file's first block; see model_file.hpp.
std::string header_text(std::uintmax_t file_size, unsigned long crc) {
  char text[128];
  std::snprintf(text, sizeof text, "brainshift model file\nformat 1\nbytes %llu\ncrc32 %08lx\n",
                static_cast<unsigned long long>(file_size), crc);
  std::string header = text;
  header.resize(kHeaderSize, '\0');
  return header;
}

constexpr std::string_view kMagic = "brainshift model file\n";
constexpr std::string_view kFormat = "format 1\n";

// CRC-32 of everything behind the header; in pieces, for models can be large.
unsigned long body_crc(std::istream& in) {
  in.clear();
  in.seekg(static_cast<std::streamoff>(kHeaderSize));
  std::vector<char> buffer(std::size_t{1} << 16);
  unsigned long crc = crc32(0L, nullptr, 0);
  while (in) {
    in.read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
    crc = crc32(crc, reinterpret_cast<const Bytef*>(buffer.data()), static_cast<uInt>(in.gcount()));
  }
  return crc;
}

// Ok if the file is whole and unchanged since it was written.
Status check_header(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::string header(kHeaderSize, '\0');
  in.read(header.data(), static_cast<std::streamsize>(header.size()));
  if (std::string_view(header).substr(0, kMagic.size()) != kMagic) {
    return file_error(ErrorCode::kUnreadable, path, "is not a model file");
  }
  if (std::string_view(header).substr(kMagic.size(), kFormat.size()) != kFormat) {
    const std::size_t end = header.find('\n', kMagic.size());
    std::string found =
        header.substr(kMagic.size(), std::min<std::size_t>(end - kMagic.size(), 20));
    for (char& c : found) c = c < ' ' ? '?' : c;
    return file_error(ErrorCode::kUnreadable, path,
                      "is a model file of '" + found + "': must be 'format 1'");
  }
  if (header == header_text(fs::file_size(path), body_crc(in))) return {};
  return file_error(ErrorCode::kUnreadable, path,
                    "is truncated or damaged: size or checksum differ from what was written");
}

// Puts the header in front of what HDF5 has written.
bool write_header(const fs::path& path) {
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  const unsigned long crc = body_crc(file);
  file.clear();
  const std::string header = header_text(fs::file_size(path), crc);
  file.seekp(0);
  file.write(header.data(), static_cast<std::streamsize>(header.size()));
  file.close();
  return !file.fail();
}

// Thrown inside this file only, by the first HDF5 call that fails; the two public functions catch it.
struct Hdf5Problem {
  std::string message;
};

// HDF5 prints every failed call to stderr unless told otherwise.
class QuietHdf5 {
 public:
  QuietHdf5() {
    H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  ~QuietHdf5() { H5Eset_auto2(H5E_DEFAULT, function_, data_); }
  QuietHdf5(const QuietHdf5&) = delete;
  QuietHdf5& operator=(const QuietHdf5&) = delete;

 private:
  H5E_auto2_t function_ = nullptr;
  void* data_ = nullptr;
};

// Closes an HDF5 identifier; throws when it was not given one.
class Handle {
 public:
  Handle(hid_t id, herr_t (*closer)(hid_t), const std::string& what) : id_(id), close_(closer) {
    if (id < 0) throw Hdf5Problem{what};
  }
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  hid_t get() const { return id_; }
  // For files: closing writes what is still buffered.
  bool close() {
    const hid_t id = id_;
    id_ = -1;
    return close_(id) >= 0;
  }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

void check(herr_t status, const std::string& what) {
  if (status < 0) throw Hdf5Problem{what};
}

template <typename T>
hid_t memory_type() {
  if constexpr (std::is_same_v<T, double>) {
    return H5T_NATIVE_DOUBLE;
  } else if constexpr (std::is_same_v<T, char>) {
    return H5T_NATIVE_UCHAR;
  } else {
    static_assert(std::is_same_v<T, int>);
    return H5T_NATIVE_INT;
  }
}
// In the file: fixed sizes and byte order, so that the file means the same on every machine.
template <typename T>
hid_t file_type() {
  if constexpr (std::is_same_v<T, double>) {
    return H5T_IEEE_F64LE;
  } else if constexpr (std::is_same_v<T, char>) {
    return H5T_STD_U8LE;
  } else {
    return H5T_STD_I32LE;
  }
}

class Writer {
 public:
  explicit Writer(hid_t file) : file_(file) {}

  // rows = 0: a plain list. Otherwise rows x (size/rows), column-major in memory, one column per row of
  // the data set, i.e. n x 3 for 3 x n points.
  template <typename T>
  void array(const std::string& name, const T* data, std::size_t size, std::size_t rows = 0) {
    const hsize_t dims[2] = {rows == 0 ? size : size / rows, rows};
    const Handle space(H5Screate_simple(rows == 0 ? 1 : 2, dims, nullptr), H5Sclose, name);
    const Handle set(H5Dcreate2(file_, name.c_str(), file_type<T>(), space.get(), H5P_DEFAULT,
                                H5P_DEFAULT, H5P_DEFAULT),
                     H5Dclose, name);
    if (size == 0) return;
    check(H5Dwrite(set.get(), memory_type<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, data), name);
  }
  template <typename Matrix>
  void matrix(const std::string& name, const Matrix& values) {
    array(name, values.data(), static_cast<std::size_t>(values.size()),
          static_cast<std::size_t>(values.rows()));
  }
  void list(const std::string& name, const std::vector<int>& values) {
    array(name, values.data(), values.size());
  }
  void text(const std::string& name, const std::string& value) {
    array(name, value.data(), value.size());
  }
  void group(const std::string& name) {
    const Handle group(H5Gcreate2(file_, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                       H5Gclose, name);
  }
  template <typename T>
  void attribute(const std::string& name, const T* data, std::size_t size) {
    const hsize_t dims[1] = {size};
    const Handle space(H5Screate_simple(1, dims, nullptr), H5Sclose, name);
    const Handle set(
        H5Acreate2(file_, name.c_str(), file_type<T>(), space.get(), H5P_DEFAULT, H5P_DEFAULT),
        H5Aclose, name);
    check(H5Awrite(set.get(), memory_type<T>(), data), name);
  }

 private:
  hid_t file_;
};

class Reader {
 public:
  // No data set is compressed, so none can hold more bytes than the file has.
  Reader(hid_t file, std::uintmax_t file_size) : file_(file), file_size_(file_size) {}

  template <typename T>
  std::vector<T> array(const std::string& name, std::size_t rows = 0) {
    const Handle set(H5Dopen2(file_, name.c_str(), H5P_DEFAULT), H5Dclose, name + " is missing");
    const Handle space(H5Dget_space(set.get()), H5Sclose, name + " is damaged");
    std::vector<T> values(checked_size<T>(space.get(), name, rows));
    if (values.empty()) return values;
    check(H5Dread(set.get(), memory_type<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()),
          name + " is truncated or damaged");
    return values;
  }
  template <typename Matrix>
  void matrix(const std::string& name, Matrix& out) {
    using Scalar = typename Matrix::Scalar;
    constexpr int kRows = Matrix::RowsAtCompileTime;
    const std::vector<Scalar> values = array<Scalar>(name, kRows);
    out = Eigen::Map<const Matrix>(values.data(), kRows,
                                   static_cast<Eigen::Index>(values.size()) / kRows);
  }
  std::string text(const std::string& name) {
    const std::vector<char> values = array<char>(name);
    return {values.begin(), values.end()};
  }
  template <typename T>
  std::vector<T> attribute(const std::string& name) {
    const Handle set(H5Aopen(file_, name.c_str(), H5P_DEFAULT), H5Aclose,
                     "attribute " + name + " is missing");
    const Handle space(H5Aget_space(set.get()), H5Sclose, "attribute " + name + " is damaged");
    std::vector<T> values(checked_size<T>(space.get(), name, 0));
    check(H5Aread(set.get(), memory_type<T>(), values.data()), "attribute " + name + " is damaged");
    return values;
  }
  double number(const std::string& name) {
    const std::vector<double> values = attribute<double>(name);
    if (values.size() != 1) throw Hdf5Problem{"attribute " + name + " is not one number"};
    return values[0];
  }

 private:
  template <typename T>
  std::size_t checked_size(hid_t space, const std::string& name, std::size_t rows) const {
    hsize_t dims[H5S_MAX_RANK] = {};
    const int rank = H5Sget_simple_extent_dims(space, dims, nullptr);
    const int expected_rank = rows == 0 ? 1 : 2;
    if (rank != expected_rank || (rows != 0 && dims[1] != rows)) {
      throw Hdf5Problem{name + " has the wrong shape"};
    }
    // Columns first, else the product could wrap around.
    const std::uintmax_t columns = dims[0];
    const std::uintmax_t bytes_per_column = sizeof(T) * (rows == 0 ? 1 : rows);
    if (columns > file_size_ / bytes_per_column)
      throw Hdf5Problem{name + " is larger than the file"};
    return static_cast<std::size_t>(columns) * (rows == 0 ? 1 : rows);
  }
  hid_t file_;
  std::uintmax_t file_size_;
};

void write_all(hid_t id, const ModelFile& file) {
  const BrainModel& model = file.model;
  Writer out(id);
  out.attribute("case_id", model.case_id.data(), model.case_id.size());
  out.attribute("model_id", model.model_id.data(), model.model_id.size());
  out.attribute("gravity_direction", model.gravity_direction.data(), 3);
  out.attribute("fluid_plane_depth_mm", &model.fluid_plane_depth_mm, 1);
  out.attribute("slave_plane_depth_mm", &model.slave_plane_depth_mm, 1);
  for (const char* group : {"case", "mesh", "skull", "tumour", "sets"}) out.group(group);
  out.text("case/yaml", case_config_text(file.config));
  out.text("case/file", file.config.file.string());
  out.matrix("mesh/nodes", model.mesh.nodes);
  out.matrix("mesh/tets", model.mesh.tets);
  out.list("mesh/labels", model.mesh.labels);
  out.matrix("boundary_triangles", model.boundary_triangles);
  out.matrix("skull/vertices", model.skull.vertices);
  out.matrix("skull/triangles", model.skull.triangles);
  out.matrix("tumour/vertices", model.tumour.vertices);
  out.matrix("tumour/triangles", model.tumour.triangles);
  out.list("sets/craniotomy", model.craniotomy);
  out.list("sets/brainstem", model.brainstem);
  out.list("sets/slaves", model.slaves);
  out.list("sets/fixed", model.fixed);
}

std::string attribute_text(Reader& in, const std::string& name) {
  const std::vector<char> values = in.attribute<char>(name);
  return {values.begin(), values.end()};
}

BrainModel read_brain_model(Reader& in) {
  BrainModel model;
  model.case_id = attribute_text(in, "case_id");
  model.model_id = attribute_text(in, "model_id");
  const std::vector<double> gravity = in.attribute<double>("gravity_direction");
  if (gravity.size() != 3) throw Hdf5Problem{"attribute gravity_direction is not three numbers"};
  model.gravity_direction = Vec3(gravity[0], gravity[1], gravity[2]);
  model.fluid_plane_depth_mm = in.number("fluid_plane_depth_mm");
  model.slave_plane_depth_mm = in.number("slave_plane_depth_mm");
  in.matrix("mesh/nodes", model.mesh.nodes);
  in.matrix("mesh/tets", model.mesh.tets);
  model.mesh.labels = in.array<int>("mesh/labels");
  in.matrix("boundary_triangles", model.boundary_triangles);
  in.matrix("skull/vertices", model.skull.vertices);
  in.matrix("skull/triangles", model.skull.triangles);
  in.matrix("tumour/vertices", model.tumour.vertices);
  in.matrix("tumour/triangles", model.tumour.triangles);
  model.craniotomy = in.array<int>("sets/craniotomy");
  model.brainstem = in.array<int>("sets/brainstem");
  model.slaves = in.array<int>("sets/slaves");
  model.fixed = in.array<int>("sets/fixed");
  return model;
}

ModelFile read_all(hid_t id, std::uintmax_t size) {
  Reader in(id, size);
  ModelFile file;
  file.model = read_brain_model(in);
  const std::string hash = content_hash(file.model);
  if (hash != file.model.model_id) {
    throw Hdf5Problem{"content does not match its model_id (" + file.model.model_id +
                      "): the file was altered"};
  }
  const std::string yaml = in.text("case/yaml");
  const std::string case_file = in.text("case/file");
  Result<CaseConfig> config = parse_case_config(yaml, case_file);
  if (!config) throw Hdf5Problem{"case/yaml: " + config.error().message};
  file.config = std::move(*config);
  file.config.file = case_file;
  return file;
}

}  // namespace

Status write_model(const fs::path& path, const ModelFile& file) {
  if (file.model.model_id != content_hash(file.model)) {
    return file_error(ErrorCode::kInvalidArgument, path,
                      "model_id '" + file.model.model_id + "' is not the hash of the model");
  }
  if (Status valid = validate(file.config); !valid) {
    return file_error(ErrorCode::kInvalidArgument, path, valid.error().message);
  }
  Result<PendingFile> pending = PendingFile::create(path);
  if (!pending) return tl::unexpected(pending.error());
  const QuietHdf5 quiet;
  try {
    const Handle properties(H5Pcreate(H5P_FILE_CREATE), H5Pclose, "properties");
    check(H5Pset_userblock(properties.get(), kHeaderSize), "properties");
    Handle h5(
        H5Fcreate(pending->temporary_path().c_str(), H5F_ACC_TRUNC, properties.get(), H5P_DEFAULT),
        H5Fclose, "file");
    write_all(h5.get(), file);
    check(H5Fflush(h5.get(), H5F_SCOPE_GLOBAL), "buffers");
    if (!h5.close()) throw Hdf5Problem{"buffers"};
    if (!write_header(pending->temporary_path())) throw Hdf5Problem{"header"};
  } catch (const Hdf5Problem& problem) {
    return file_error(ErrorCode::kWriteFailed, path, "cannot write " + problem.message);
  }
  return pending->commit();
}

Result<ModelFile> read_model(const fs::path& path) {
  if (Status regular = check_regular_file(path); !regular) return tl::unexpected(regular.error());
  if (Status whole = check_header(path); !whole) return tl::unexpected(whole.error());
  const QuietHdf5 quiet;
  try {
    const Handle h5(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose,
                    "HDF5 cannot open it");
    return read_all(h5.get(), fs::file_size(path));
  } catch (const Hdf5Problem& problem) {
    return file_error(ErrorCode::kUnreadable, path, "is no usable model file: " + problem.message);
  }
}

}  // namespace brainshift::io
