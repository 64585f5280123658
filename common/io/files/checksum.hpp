// SPDX-License-Identifier: GPL-3.0-or-later
// CRC-32 (IEEE 802.3, as zlib) of memory and of large files. It tells accidents, not forgery.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>

#include "common/core/error.hpp"

namespace brainshift::io {

// Of `before` followed by `size` bytes; a checksum starts from 0.
std::uint32_t crc32_of(const void* data, std::size_t size, std::uint32_t before = 0);

// Of the bytes of `path` from `offset` to its end. The file is cut into one piece per core,
// because one core checks about as fast as a disk reads; the checksums of the pieces are combined
// exactly. kNotFound, or kUnreadable also when the file becomes shorter meanwhile.
struct FileChecksum {
  std::uint64_t bytes = 0;  // size of the whole file
  std::uint32_t crc32 = 0;
};
Result<FileChecksum> file_checksum(const std::filesystem::path& path, std::uint64_t offset = 0);

}  // namespace brainshift::io
