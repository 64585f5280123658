// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/files/checksum.hpp"

#include <gmock/gmock.h>
#include <zlib.h>

#include <random>

#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using test_support::TemporaryFolder;

std::string random_bytes(std::size_t size) {
  std::mt19937 generator(7);
  std::string bytes(size, '\0');
  for (char& byte : bytes) byte = static_cast<char>(generator());
  return bytes;
}

// The whole at once, by the library alone.
std::uint32_t reference(const std::string& bytes) {
  return static_cast<std::uint32_t>(
      crc32(0L, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())));
}

TEST(Checksum, FileInPiecesEqualsTheWholeAtOnce) {
  const TemporaryFolder folder;
  // Below and above the size from which several cores work, odd sizes that do not divide.
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{1000003},
                                 (std::size_t{1} << 22) + 513, std::size_t{9000001}}) {
    const std::string bytes = random_bytes(size);
    const auto path = folder.write("f", bytes);
    for (const std::size_t offset : {std::size_t{0}, std::size_t{512}}) {
      const auto checksum = file_checksum(path, offset);
      ASSERT_TRUE(checksum) << checksum.error().message;
      EXPECT_EQ(checksum->bytes, size);
      EXPECT_EQ(checksum->crc32, reference(bytes.substr(std::min(offset, size)))) << size;
    }
  }
}

TEST(Checksum, GoesOnFromWhatCameBefore) {
  const std::string bytes = random_bytes(1000);
  const std::uint32_t first = crc32_of(bytes.data(), 300);
  EXPECT_EQ(crc32_of(bytes.data() + 300, 700, first), reference(bytes));
  EXPECT_EQ(crc32_of(nullptr, 0, first), first) << "nothing more leaves it as it is";
}

TEST(Checksum, MissingFileIsNotFound) {
  const TemporaryFolder folder;
  EXPECT_EQ(file_checksum(folder / "absent").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(file_checksum(folder.path()).error().code, ErrorCode::kUnreadable);
}

}  // namespace
}  // namespace brainshift::io
