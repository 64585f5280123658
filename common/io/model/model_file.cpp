// SPDX-License-Identifier: GPL-3.0-or-later
// The groups of the file but /condensed, its first block, its checksum, its atomic writing.
#include "common/io/model/model_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <string>
#include <string_view>

#include "common/io/config/config_file.hpp"
#include "common/io/files/checksum.hpp"
#include "common/io/files/descriptor.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/model/condensed_layout.hpp"
#include "common/values/model_id.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

// ---- the groups; errors are thrown as Hdf5Problem ----

constexpr const char* kDistanceGroup = "tumour_distance";

void write_distance_grid(Hdf5Writer& out, const DistanceGrid& grid) {
  if (grid.empty()) return;
  out.group(kDistanceGroup);
  out.attribute(kDistanceGroup, "origin_mm", grid.origin_mm);
  out.number(kDistanceGroup, "spacing_mm", grid.spacing_mm);
  out.attribute(kDistanceGroup, "dims", grid.dims);
  out.write(std::string(kDistanceGroup) + "/values_mm", grid.values);
}

DistanceGrid read_distance_grid(const Hdf5Reader& in) {
  DistanceGrid grid;
  if (!in.has(kDistanceGroup)) return grid;
  const std::vector<double> origin = in.attribute<double>(kDistanceGroup, "origin_mm");
  const std::vector<int> dims = in.attribute<int>(kDistanceGroup, "dims");
  if (origin.size() != 3 || dims.size() != 3)
    throw Hdf5Problem{"attributes of tumour_distance are not three numbers each"};
  grid.origin_mm = Vec3(origin[0], origin[1], origin[2]);
  grid.spacing_mm = in.number<double>(kDistanceGroup, "spacing_mm");
  grid.dims = {dims[0], dims[1], dims[2]};
  grid.values = in.list<float>(std::string(kDistanceGroup) + "/values_mm");
  if (Status valid = validate(grid); !valid)
    throw Hdf5Problem{"tumour_distance: " + valid.error().message};
  return grid;
}

// array(name, values) for each array of a model, in the order of the file.
template <typename Array, typename Model>
void visit_arrays(const Array& array, Model& model) {
  array("mesh/nodes", model.mesh.nodes);
  array("mesh/tets", model.mesh.tets);
  array("mesh/labels", model.mesh.labels);
  array("boundary_triangles", model.boundary_triangles);
  array("skull/vertices", model.skull.vertices);
  array("skull/triangles", model.skull.triangles);
  array("tumour/vertices", model.tumour.vertices);
  array("tumour/triangles", model.tumour.triangles);
  array("sets/craniotomy", model.craniotomy);
  array("sets/brainstem", model.brainstem);
  array("sets/slaves", model.slaves);
  array("sets/fixed", model.fixed);
}

// Only in files of models that have them.
template <typename Array, typename Model>
void visit_anatomy(const Array& array, Model& model) {
  array("anatomy/septum_slaves", model.septa.slaves);
  array("anatomy/septum_normals", model.septa.normals);
  array("anatomy/septum_triangles", model.septa.triangles);
  array("anatomy/ventricle_wall", model.ventricle_wall);
}

void write_brain_model(Hdf5Writer& out, const BrainModel& model) {
  out.attribute("/", "case_id", model.case_id);
  out.attribute("/", "model_id", model.model_id);
  out.attribute("/", "gravity_direction", model.gravity_direction);
  out.number("/", "fluid_plane_depth_mm", model.fluid_plane_depth_mm);
  out.number("/", "slave_plane_depth_mm", model.slave_plane_depth_mm);
  for (const char* group : {"mesh", "skull", "tumour", "sets"}) out.group(group);
  visit_arrays([&](const char* name, const auto& values) { out.write(name, values); }, model);
  if (!model.septa.slaves.empty() || model.ventricle_wall.cols() > 0) {
    out.group("anatomy");
    out.number("anatomy", "septum_gap_mm", model.septa.gap_mm);
    visit_anatomy([&](const char* name, const auto& values) { out.write(name, values); }, model);
  }
  write_distance_grid(out, model.tumour_distance);
}

// Throws also when the content does not hash to its model_id.
BrainModel read_brain_model(const Hdf5Reader& in) {
  BrainModel model;
  model.case_id = in.attribute_text("/", "case_id");
  model.model_id = in.attribute_text("/", "model_id");
  const std::vector<double> gravity = in.attribute<double>("/", "gravity_direction");
  if (gravity.size() != 3) throw Hdf5Problem{"attribute gravity_direction is not three numbers"};
  model.gravity_direction = Vec3(gravity[0], gravity[1], gravity[2]);
  model.fluid_plane_depth_mm = in.number<double>("/", "fluid_plane_depth_mm");
  model.slave_plane_depth_mm = in.number<double>("/", "slave_plane_depth_mm");
  visit_arrays([&](const char* name, auto& values) { in.read(name, values); }, model);
  if (in.has("anatomy")) {
    model.septa.gap_mm = in.number<double>("anatomy", "septum_gap_mm");
    visit_anatomy([&](const char* name, auto& values) { in.read(name, values); }, model);
  }
  model.tumour_distance = read_distance_grid(in);
  if (content_hash(model) != model.model_id) {
    throw Hdf5Problem{"content does not match its model_id (" + model.model_id +
                      "): the file was altered"};
  }
  return model;
}

void write_case(Hdf5Writer& out, const CaseConfig& config) {
  out.group("case");
  out.write("case/yaml", case_config_text(config));
  out.write("case/file", config.file.string());
}

CaseConfig read_case(const Hdf5Reader& in) {
  const std::string case_file = in.text("case/file");
  Result<CaseConfig> config = parse_case_config(in.text("case/yaml"), case_file);
  if (!config) throw Hdf5Problem{"case/yaml: " + config.error().message};
  config->file = case_file;
  return std::move(*config);
}

void write_inputs(Hdf5Writer& out, const std::vector<InputFile>& inputs) {
  out.group("inputs");
  for (const InputFile& input : inputs) {
    const std::string group = "inputs/" + input.key;
    out.group(group);
    out.attribute(group, "path", input.path.string());
    out.number(group, "bytes", input.bytes);
    out.number(group, "crc32", input.crc32);
  }
}

std::vector<InputFile> read_inputs(const Hdf5Reader& in) {
  std::vector<InputFile> inputs;
  for (const std::string& key : in.names("inputs")) {
    const std::string group = "inputs/" + key;
    inputs.push_back({key, in.attribute_text(group, "path"),
                      in.number<std::uint64_t>(group, "bytes"),
                      in.number<std::uint32_t>(group, "crc32")});
  }
  return inputs;
}

// ---- the file around them ----

constexpr std::size_t kHeaderSize = 512;  // the smallest user block that HDF5 knows
constexpr std::string_view kMagic = "brainshift model file\n";
constexpr std::string_view kFormat = "format 7\n";

// The file's first block; see model_file.hpp.
std::string header_text(const FileChecksum& body) {
  char text[64];
  std::snprintf(text, sizeof text, "bytes %llu\ncrc32 %08x\n",
                static_cast<unsigned long long>(body.bytes), body.crc32);
  std::string header = std::string(kMagic) + std::string(kFormat) + text;
  header.resize(kHeaderSize, '\0');
  return header;
}

// The first line from `at`, fit to be quoted in a message.
std::string quoted_line(const std::string& header, std::size_t at) {
  const std::size_t end = std::min(header.find('\n', at), header.size());
  std::string line = header.substr(at, std::min<std::size_t>(end - at, 20));
  for (char& c : line) c = c < ' ' || c > '~' ? '?' : c;
  return "'" + line + "'";
}

// Ok if the file is whole and unchanged since it was written. The checksum comes last, for it
// takes time.
Status check_header(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::string header(kHeaderSize, '\0');
  in.read(header.data(), static_cast<std::streamsize>(header.size()));
  const auto refuse = [&path](const std::string& reason) { return unreadable(path, reason); };
  if (std::string_view(header).substr(0, kMagic.size()) != kMagic) {
    return refuse("is not a model file");
  }
  if (std::string_view(header).substr(kMagic.size(), kFormat.size()) != kFormat) {
    return refuse("is a model file of " + quoted_line(header, kMagic.size()) +
                  ": must be 'format 7', run brainshiftd prepare again");
  }
  FileChecksum written;
  unsigned long long bytes = 0;
  const char* numbers = header.c_str() + kMagic.size() + kFormat.size();
  const int found = std::sscanf(numbers, "bytes %20llu crc32 %8x", &bytes, &written.crc32);
  written.bytes = bytes;
  if (found != 2 || header != header_text(written)) return refuse("is damaged in its first block");
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) return refuse(error.message());
  if (size != written.bytes) {
    return refuse("is truncated or was added to: has " + std::to_string(size) +
                  " bytes, was written with " + std::to_string(written.bytes));
  }
  const Result<FileChecksum> body = file_checksum(path, kHeaderSize);
  if (!body) return tl::unexpected(body.error());
  if (body->crc32 == written.crc32) return {};
  return refuse("is altered or damaged: its checksum differs from what was written");
}

// Puts the header in front of what HDF5 has written.
bool write_header(const fs::path& path) {
  const Result<FileChecksum> body = file_checksum(path, kHeaderSize);
  if (!body) return false;
  const std::string header = header_text(*body);
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  file.write(header.data(), static_cast<std::streamsize>(header.size()));
  file.close();
  return !file.fail();
}

// What would be refused on reading is not written.
Status check_content(const fs::path& path, const ModelFile& file) {
  const auto refuse = [&path](const std::string& reason) { return invalid_file(path, reason); };
  if (file.model.model_id != content_hash(file.model)) {
    return refuse("model_id '" + file.model.model_id + "' is not the hash of the model");
  }
  if (Status valid = validate(file.config); !valid) return refuse(valid.error().message);
  if (Status valid = validate(file.model.tumour_distance); !valid)
    return refuse("tumour_distance: " + valid.error().message);
  for (std::size_t i = 0; i < file.condensed.size(); ++i) {
    if (const auto problem = incompatibility_of(file.condensed[i], file.model))
      return refuse(*problem);
    for (std::size_t j = 0; j < i; ++j) {
      if (file.condensed[i].boundary == file.condensed[j].boundary) {
        return refuse("has two sets of operators for the boundary condition " +
                      std::string(to_string(file.condensed[i].boundary)));
      }
    }
  }
  return {};
}

void write_hdf5(const fs::path& path, const ModelFile& file) {
  const Hdf5Handle properties(H5Pcreate(H5P_FILE_CREATE), H5Pclose, "properties");
  check_hdf5(H5Pset_userblock(properties.get(), kHeaderSize), "properties");
  Hdf5Handle h5(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, properties.get(), H5P_DEFAULT), H5Fclose,
                "file");
  Hdf5Writer out(h5.get());
  write_brain_model(out, file.model);
  write_case(out, file.config);
  write_inputs(out, file.inputs);
  write_condensed(out, file.condensed);
  check_hdf5(H5Fflush(h5.get(), H5F_SCOPE_GLOBAL), "buffers");
  if (!h5.close()) throw Hdf5Problem{"buffers"};
}

// HDF5 does not pass on why a write failed; a full disk is the usual reason.
std::string free_space(const fs::path& path) {
  std::error_code error;
  const fs::space_info space = fs::space(path, error);
  return error ? "" : ", with " + std::to_string(space.available >> 20) + " MiB free there";
}

// read: Hdf5Reader -> T.
template <typename T, typename Read>
Result<T> read_once(const fs::path& path, const Read& read) {
  if (Status whole = check_header(path); !whole) return tl::unexpected(whole.error());
  const QuietHdf5 quiet;
  try {
    const Hdf5Handle h5(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose,
                        "HDF5 cannot open it");
    hsize_t size = 0;
    check_hdf5(H5Fget_filesize(h5.get(), &size), "its size is unknown");
    return read(Hdf5Reader(h5.get(), size));
  } catch (const Hdf5Problem& problem) {
    return unreadable(path, "is no usable model file: " + problem.message);
  }
}

// Reading opens the file by its name more than once, and a newer model may take its place in
// between. While a file is held open its number is not given to another one, so the name still
// leads to it if numbers agree.
bool is_still(const fs::path& path, const Descriptor& held) {
  struct stat now {};
  struct stat then {};
  return ::stat(path.c_str(), &now) == 0 && ::fstat(held.get(), &then) == 0 &&
         now.st_dev == then.st_dev && now.st_ino == then.st_ino;
}

template <typename T, typename Read>
Result<T> read_file(const fs::path& path, const Read& read) {
  constexpr int kAttempts = 20;  // against a file replaced faster than it can be read
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    if (Status regular = check_regular_file(path); !regular) return tl::unexpected(regular.error());
    const Descriptor held(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
    if (held.get() < 0) return unreadable(path, "cannot be opened");
    Result<T> value = read_once<T>(path, read);
    if (is_still(path, held)) return value;
  }
  return unreadable(path, "is replaced all the time while it is read");
}

}  // namespace

Status write_model(const fs::path& path, const ModelFile& file) {
  if (Status good = check_content(path, file); !good) return good;
  Result<PendingFile> pending = PendingFile::create(path);
  if (!pending) return tl::unexpected(pending.error());
  const QuietHdf5 quiet;
  try {
    write_hdf5(pending->temporary_path(), file);
    if (!write_header(pending->temporary_path())) throw Hdf5Problem{"header"};
  } catch (const Hdf5Problem& problem) {
    return write_failed(path,
                        "cannot write " + problem.message + free_space(pending->temporary_path()));
  }
  return pending->commit();
}

Result<ModelFile> read_model(const fs::path& path, const std::vector<Boundary>& operators) {
  return read_file<ModelFile>(path, [&](const Hdf5Reader& in) {
    ModelFile file;
    file.model = read_brain_model(in);
    file.config = read_case(in);
    file.inputs = read_inputs(in);
    file.condensed = read_condensed(in, file.model, operators);
    return file;
  });
}

Result<std::optional<CondensedOperators>> read_operators(const fs::path& path,
                                                         const BrainModel& model,
                                                         Boundary boundary) {
  using Operators = std::optional<CondensedOperators>;
  return read_file<Operators>(path, [&](const Hdf5Reader& in) -> Operators {
    auto found = read_condensed(in, model, {boundary});
    if (found.empty()) return std::nullopt;
    return std::move(found.front());
  });
}

Result<std::optional<OldModel>> model_to_replace(const fs::path& path) {
  std::error_code error;
  if (!fs::exists(path, error)) return std::nullopt;
  std::ifstream in(path, std::ios::binary);
  std::string magic(kMagic.size(), '\0');
  in.read(magic.data(), static_cast<std::streamsize>(magic.size()));
  if (!in || magic != kMagic) {
    return invalid_file(path, "is there and is no model file: it is not replaced");
  }
  const auto read = read_file<OldModel>(path, [](const Hdf5Reader& file) {
    return OldModel{file.attribute_text("/", "case_id"), file.attribute_text("/", "model_id"), {}};
  });
  return read ? *read : OldModel{{}, {}, read.error().message};
}

}  // namespace brainshift::io
