// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/model/checkpoint_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <map>
#include <mutex>
#include <string>
#include <system_error>

#include "common/io/files/checksum.hpp"
#include "common/io/files/descriptor.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

constexpr char kCheckpointMagic[8] = {'b', 's', 'h', 'i', 'f', 't', 'c', 'p'};
// 2: blocks hold the columns as rows, neighbouring slaves together.
constexpr std::uint32_t kVersion = 2;

struct FileHeader {
  char magic[8];
  std::uint64_t key;
  std::uint32_t version;
  std::uint32_t crc;  // of what precedes it
};
struct BlockHeader {
  std::int64_t index;
  std::uint64_t scalar_bytes;  // 4: float, 8: double
  std::uint64_t rows;
  std::uint64_t columns;
  std::uint32_t payload_crc;
  std::uint32_t crc;  // of what precedes it
};
// Written as they lie in memory.
static_assert(sizeof(FileHeader) == 24 && sizeof(BlockHeader) == 40);

template <typename Header>
std::uint32_t header_crc(const Header& header) {
  return crc32_of(&header, sizeof header - sizeof header.crc);
}

// False at the end of the file or on an error.
bool read_at(int file, void* place, std::size_t size, std::uint64_t at) {
  auto* bytes = static_cast<char*>(place);
  while (size > 0) {
    const ssize_t got = ::pread(file, bytes, size, static_cast<off_t>(at));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    bytes += got;
    size -= static_cast<std::size_t>(got);
    at += static_cast<std::uint64_t>(got);
  }
  return true;
}

bool write_at(int file, const void* data, std::size_t size, std::uint64_t at) {
  const auto* bytes = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t put = ::pwrite(file, bytes, size, static_cast<off_t>(at));
    if (put < 0 && errno == EINTR) continue;
    if (put <= 0) return false;
    bytes += put;
    size -= static_cast<std::size_t>(put);
    at += static_cast<std::uint64_t>(put);
  }
  return true;
}

struct Block {
  BlockHeader header;
  std::uint64_t payload_at;
};

// Of the block at `at`, when it is whole.
bool whole_block(int file, std::uint64_t at, std::uint64_t file_size, Block& block) {
  BlockHeader& header = block.header;
  if (!read_at(file, &header, sizeof header, at) || header.crc != header_crc(header)) return false;
  block.payload_at = at + sizeof header;
  std::uint64_t left = header.rows * header.columns * header.scalar_bytes;
  if (left > file_size - block.payload_at) return false;
  std::vector<char> buffer(std::size_t{1} << 18);
  std::uint32_t crc = 0;
  for (std::uint64_t from = block.payload_at; left > 0;) {
    const auto size = static_cast<std::size_t>(std::min<std::uint64_t>(left, buffer.size()));
    if (!read_at(file, buffer.data(), size, from)) return false;
    crc = crc32_of(buffer.data(), size, crc);
    from += size;
    left -= size;
  }
  return crc == header.payload_crc;
}

// What of a matrix lies in one piece of memory: all of it, or a column.
template <typename Matrix>
struct Pieces {
  Eigen::Index count;
  std::size_t bytes;  // of each

  explicit Pieces(const Matrix& matrix)
      : count(matrix.outerStride() == matrix.rows() ? 1 : matrix.cols()),
        bytes(count == 0 ? 0
                         : static_cast<std::size_t>(matrix.size() / count) *
                               sizeof(typename Matrix::Scalar)) {}
  std::uint64_t from(Eigen::Index i) const { return static_cast<std::uint64_t>(i) * bytes; }
};

std::uint64_t payload_bytes(const BlockHeader& header) {
  return header.rows * header.columns * header.scalar_bytes;
}

}  // namespace

struct CheckpointFile::Impl {
  fs::path path;
  Descriptor file;
  mutable std::mutex mutex;  // guards what follows, and the writing
  std::map<int, Block> blocks;
  std::uint64_t end = 0;  // of the last whole block

  tl::unexpected<Error> write_error(const std::string& action) const {
    return write_failed(path, "cannot " + action + ": " +
                                  std::error_code(errno, std::generic_category()).message());
  }

  // Header read, or written where there is none of this key; what is no whole block cut off.
  Status start(std::uint64_t key) {
    const off_t size = ::lseek(file.get(), 0, SEEK_END);
    if (size < 0) return unreadable(path, "cannot be read");
    FileHeader found{};
    const std::size_t known = std::min(static_cast<std::size_t>(size), sizeof kCheckpointMagic);
    if (!read_at(file.get(), &found, std::min(static_cast<std::size_t>(size), sizeof found), 0) ||
        std::memcmp(found.magic, kCheckpointMagic, known) != 0) {
      return unreadable(path, "is there but is no checkpoint file");
    }
    FileHeader header{};
    std::memcpy(header.magic, kCheckpointMagic, sizeof kCheckpointMagic);
    header.key = key;
    header.version = kVersion;
    header.crc = header_crc(header);
    end = sizeof header;
    if (static_cast<std::size_t>(size) >= sizeof header &&
        std::memcmp(&found, &header, sizeof header) == 0) {
      find_blocks(static_cast<std::uint64_t>(size));
    } else if (::ftruncate(file.get(), 0) != 0 ||
               !write_at(file.get(), &header, sizeof header, 0)) {
      return write_error("start");
    }
    if (::ftruncate(file.get(), static_cast<off_t>(end)) != 0) return write_error("cut");
    return {};
  }

  void find_blocks(std::uint64_t size) {
    Block block{};
    while (end < size && whole_block(file.get(), end, size, block)) {
      blocks.insert_or_assign(static_cast<int>(block.header.index), block);
      end = block.payload_at + payload_bytes(block.header);
    }
  }

  template <typename Matrix>
  Status append(int index, const Matrix& matrix) {
    using Scalar = typename Matrix::Scalar;
    const Pieces pieces(matrix);
    const auto piece = [&](Eigen::Index i) { return matrix.data() + i * matrix.outerStride(); };
    Block block{};
    block.header.index = index;
    block.header.scalar_bytes = sizeof(Scalar);
    block.header.rows = static_cast<std::uint64_t>(matrix.rows());
    block.header.columns = static_cast<std::uint64_t>(matrix.cols());
    for (Eigen::Index i = 0; i < pieces.count; ++i) {
      block.header.payload_crc = crc32_of(piece(i), pieces.bytes, block.header.payload_crc);
    }
    block.header.crc = header_crc(block.header);

    const std::lock_guard lock(mutex);
    if (blocks.count(index) != 0) {
      return invalid_file(path, "has block " + std::to_string(index) + " already");
    }
    block.payload_at = end + sizeof block.header;
    bool good = write_at(file.get(), &block.header, sizeof block.header, end);
    for (Eigen::Index i = 0; good && i < pieces.count; ++i) {
      good = write_at(file.get(), piece(i), pieces.bytes, block.payload_at + pieces.from(i));
    }
    if (!good) {
      auto error = write_error("append block " + std::to_string(index));
      // What is left when this fails too is dropped on the next opening.
      [[maybe_unused]] const int cut = ::ftruncate(file.get(), static_cast<off_t>(end));
      return error;
    }
    end = block.payload_at + payload_bytes(block.header);
    blocks.emplace(index, block);
    return {};
  }

  template <typename Matrix>
  Status read(int index, Matrix& out) const {
    using Scalar = typename Matrix::Scalar;
    const auto found = find(index);
    if (!found) return tl::unexpected(found.error());
    const Block& block = *found;
    const BlockHeader& header = block.header;
    if (header.scalar_bytes != sizeof(Scalar) ||
        header.rows != static_cast<std::uint64_t>(out.rows()) ||
        header.columns != static_cast<std::uint64_t>(out.cols())) {
      return invalid_file(
          path, "block " + std::to_string(index) + " is " + std::to_string(header.rows) + " x " +
                    std::to_string(header.columns) + " numbers of " +
                    std::to_string(header.scalar_bytes) + " bytes, asked for " +
                    std::to_string(out.rows()) + " x " + std::to_string(out.cols()) + " of " +
                    std::to_string(sizeof(Scalar)));
    }
    const Pieces pieces(out);
    std::uint32_t crc = 0;
    for (Eigen::Index i = 0; i < pieces.count; ++i) {
      Scalar* piece = out.data() + i * out.outerStride();
      if (!read_at(file.get(), piece, pieces.bytes, block.payload_at + pieces.from(i))) {
        return unreadable(path, "block " + std::to_string(index) + " cannot be read");
      }
      crc = crc32_of(piece, pieces.bytes, crc);
    }
    if (crc == header.payload_crc) return {};
    return unreadable(path,
                      "block " + std::to_string(index) + " was altered while the file was open");
  }

  Result<Block> find(int index) const {
    const std::lock_guard lock(mutex);
    const auto found = blocks.find(index);
    if (found != blocks.end()) return found->second;
    return file_error(ErrorCode::kNotFound, path, "has no block " + std::to_string(index));
  }
};

CheckpointFile::CheckpointFile(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
CheckpointFile::CheckpointFile(CheckpointFile&&) noexcept = default;
CheckpointFile& CheckpointFile::operator=(CheckpointFile&&) noexcept = default;
CheckpointFile::~CheckpointFile() = default;

Result<CheckpointFile> CheckpointFile::open_or_create(const fs::path& path, std::uint64_t key) {
  std::error_code ignored;
  if (fs::exists(path, ignored)) {
    if (Status regular = check_regular_file(path); !regular) return tl::unexpected(regular.error());
  }
  auto impl = std::make_unique<Impl>();
  impl->path = path;
  impl->file = Descriptor(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644));
  if (impl->file.get() < 0) return impl->write_error("open");
  if (::flock(impl->file.get(), LOCK_EX | LOCK_NB) != 0) {
    return file_error(ErrorCode::kUnavailable, path, "is in use by another process");
  }
  if (Status started = impl->start(key); !started) return tl::unexpected(started.error());
  return CheckpointFile(std::move(impl));
}

std::vector<int> CheckpointFile::blocks() const {
  const std::lock_guard lock(impl_->mutex);
  std::vector<int> indices;
  for (const auto& [index, block] : impl_->blocks) indices.push_back(index);
  return indices;
}

bool CheckpointFile::has(int index) const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->blocks.count(index) != 0;
}

Status CheckpointFile::append(int index, const Eigen::Ref<const Eigen::MatrixXf>& block) {
  return impl_->append(index, block);
}
Status CheckpointFile::append(int index, const Eigen::Ref<const Eigen::MatrixXd>& block) {
  return impl_->append(index, block);
}
Status CheckpointFile::read(int index, Eigen::Ref<Eigen::MatrixXf> out) const {
  return impl_->read(index, out);
}
Status CheckpointFile::read(int index, Eigen::Ref<Eigen::MatrixXd> out) const {
  return impl_->read(index, out);
}

Status CheckpointFile::read_columns(int index, Eigen::Index first, Eigen::MatrixXf& out) const {
  const auto block = impl_->find(index);
  if (!block) return tl::unexpected(block.error());
  const BlockHeader& header = block->header;
  const auto begin = static_cast<std::uint64_t>(first);
  if (header.scalar_bytes != sizeof(float) ||
      header.rows != static_cast<std::uint64_t>(out.rows()) ||
      begin + static_cast<std::uint64_t>(out.cols()) > header.columns) {
    return invalid_file(impl_->path, "block " + std::to_string(index) + " has no such columns");
  }
  if (read_at(impl_->file.get(), out.data(), sizeof(float) * static_cast<std::size_t>(out.size()),
              block->payload_at + begin * header.rows * sizeof(float))) {
    return {};
  }
  return unreadable(impl_->path, "block " + std::to_string(index) + " cannot be read");
}

Status CheckpointFile::remove() {
  const std::lock_guard lock(impl_->mutex);
  impl_->blocks.clear();
  if (::unlink(impl_->path.c_str()) != 0 && errno != ENOENT) return impl_->write_error("remove");
  impl_->file.close();
  return {};
}

}  // namespace brainshift::io
