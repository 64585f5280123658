// SPDX-License-Identifier: GPL-3.0-or-later
// A file that appears whole or not at all: plain bytes first, then bytes that are compressed with
// gzip as they come, or not compressed. Private to the room.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "common/core/error.hpp"
#include "common/io/files/file_access.hpp"

struct gzFile_s;

namespace brainshift::io {

class GzipOutput {
 public:
  // Begins with `plain`; all that write() adds is compressed if `compressed`. The same bytes give
  // the same file: no time stands in it. kWriteFailed.
  static Result<GzipOutput> create(const std::filesystem::path& path, std::string_view plain,
                                   bool compressed);
  GzipOutput(GzipOutput&& other) noexcept;
  GzipOutput& operator=(GzipOutput&&) = delete;
  ~GzipOutput();

  Status write(const void* bytes, std::size_t size);
  // The file is there now.
  Status commit();

 private:
  GzipOutput(std::filesystem::path path, PendingFile pending, gzFile_s* stream);
  Status failed(int error) const;
  std::filesystem::path path_;
  PendingFile pending_;
  gzFile_s* stream_;
};

}  // namespace brainshift::io
