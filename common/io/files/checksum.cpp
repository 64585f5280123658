// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/files/checksum.hpp"

#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <vector>

#include "common/core/thread_team.hpp"
#include "common/io/files/descriptor.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

constexpr std::size_t kBuffer = std::size_t{1} << 18;            // stays in a core's own cache
constexpr std::uint64_t kWorthThreads = std::uint64_t{1} << 22;  // below this, one core is as fast

struct Piece {
  std::uint64_t begin = 0;
  std::uint64_t end = 0;
  std::uint32_t crc = 0;
  bool whole = false;
};

void check_piece(int file, Piece& piece) {
  std::vector<char> buffer(
      static_cast<std::size_t>(std::min<std::uint64_t>(kBuffer, piece.end - piece.begin)));
  for (std::uint64_t at = piece.begin; at < piece.end;) {
    const auto wanted =
        static_cast<std::size_t>(std::min<std::uint64_t>(buffer.size(), piece.end - at));
    const ssize_t got = ::pread(file, buffer.data(), wanted, static_cast<off_t>(at));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return;
    piece.crc = crc32_of(buffer.data(), static_cast<std::size_t>(got), piece.crc);
    at += static_cast<std::uint64_t>(got);
  }
  piece.whole = true;
}

}  // namespace

std::uint32_t crc32_of(const void* data, std::size_t size, std::uint32_t before) {
  if (size == 0)
    return before;  // zlib starts again when `data` is null, as it is in an empty array
  return static_cast<std::uint32_t>(
      crc32_z(before, static_cast<const Bytef*>(data), static_cast<z_size_t>(size)));
}

Result<FileChecksum> file_checksum(const std::filesystem::path& path, std::uint64_t offset) {
  if (Status regular = check_regular_file(path); !regular) return tl::unexpected(regular.error());
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  const off_t size = file.get() < 0 ? -1 : ::lseek(file.get(), 0, SEEK_END);
  if (size < 0) return unreadable(path, "cannot be opened");
  FileChecksum result;
  result.bytes = static_cast<std::uint64_t>(size);
  const std::uint64_t length = result.bytes - std::min(result.bytes, offset);

  ThreadTeam team(length < kWorthThreads ? 1 : 0);
  std::vector<Piece> pieces(static_cast<std::size_t>(team.size()));
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    pieces[i].begin = offset + length * i / pieces.size();
    pieces[i].end = offset + length * (i + 1) / pieces.size();
  }
  auto task = [&](int member) {
    check_piece(file.get(), pieces[static_cast<std::size_t>(member)]);
  };
  team.run(task);
  for (const Piece& piece : pieces) {
    if (!piece.whole) return unreadable(path, "cannot be read to its end");
    result.crc32 = static_cast<std::uint32_t>(
        crc32_combine(result.crc32, piece.crc, static_cast<z_off_t>(piece.end - piece.begin)));
  }
  return result;
}

}  // namespace brainshift::io
