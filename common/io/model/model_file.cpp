// SPDX-License-Identifier: GPL-3.0-or-later
// The file around the groups of model_layout.hpp: its first block, its checksum, its atomic
// writing.
#include "common/io/model/model_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <string>
#include <string_view>

#include "common/io/files/checksum.hpp"
#include "common/io/files/descriptor.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/model/condensed_check.hpp"
#include "common/io/model/condensed_layout.hpp"
#include "common/io/model/model_layout.hpp"
#include "common/values/model_id.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kHeaderSize = 512;  // the smallest user block that HDF5 knows
constexpr std::string_view kMagic = "brainshift model file\n";
constexpr std::string_view kFormat = "format 6\n";

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
  const auto refuse = [&path](const std::string& reason) {
    return file_error(ErrorCode::kUnreadable, path, reason);
  };
  if (std::string_view(header).substr(0, kMagic.size()) != kMagic) {
    return refuse("is not a model file");
  }
  if (std::string_view(header).substr(kMagic.size(), kFormat.size()) != kFormat) {
    return refuse("is a model file of " + quoted_line(header, kMagic.size()) +
                  ": must be 'format 6', run brainshiftd prepare again");
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
  const auto refuse = [&path](const std::string& reason) {
    return file_error(ErrorCode::kInvalidArgument, path, reason);
  };
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
    return file_error(ErrorCode::kUnreadable, path, "is no usable model file: " + problem.message);
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
    if (held.get() < 0) return file_error(ErrorCode::kUnreadable, path, "cannot be opened");
    Result<T> value = read_once<T>(path, read);
    if (is_still(path, held)) return value;
  }
  return file_error(ErrorCode::kUnreadable, path, "is replaced all the time while it is read");
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
    return file_error(ErrorCode::kWriteFailed, path,
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

}  // namespace brainshift::io
