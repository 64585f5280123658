// SPDX-License-Identifier: GPL-3.0-or-later
// CheckpointFile: blocks of a long computation, kept as they are finished, so that it can go on
// after an interruption.
//
// The file is only appended to. It begins with {magic, version, key, CRC-32}; the key says what
// the blocks belong to, and a file of another key is started afresh. Each block follows as
// {index, scalar size, rows, columns, CRC-32s} and its numbers, column by column. What an
// interruption left incomplete, and everything behind a damaged block, is dropped on opening.
// Native byte order: it is no file to keep or to give away.
//
// Not synced block by block: a block that a power failure lost fails its checksum and is computed
// again. append() and the reads may be called from several threads at once.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "common/core/error.hpp"

namespace brainshift::io {

class CheckpointFile {
 public:
  // kUnreadable for a file that is there but is no checkpoint (it is left as it is); kUnavailable
  // when another process has it open; kWriteFailed when it cannot be made.
  static Result<CheckpointFile> open_or_create(const std::filesystem::path& path,
                                               std::uint64_t key);
  CheckpointFile(CheckpointFile&&) noexcept;
  CheckpointFile& operator=(CheckpointFile&&) noexcept;
  ~CheckpointFile();  // leaves the file for the next time

  // Indices of the whole blocks, sorted.
  std::vector<int> blocks() const;
  bool has(int index) const;

  // kInvalidArgument for an index that is there; kWriteFailed (the file keeps the blocks it had).
  Status append(int index, const Eigen::Ref<const Eigen::MatrixXf>& block);
  Status append(int index, const Eigen::Ref<const Eigen::MatrixXd>& block);

  // Into `out`, which has the block's shape, e.g. columns of a larger matrix. kNotFound;
  // kInvalidArgument for another shape or scalar; kUnreadable (then `out` holds no meaningful
  // numbers).
  Status read(int index, Eigen::Ref<Eigen::MatrixXf> out) const;
  Status read(int index, Eigen::Ref<Eigen::MatrixXd> out) const;

  // Columns [first, first + out.cols()) of a block with out.rows() rows, without a look at its
  // checksum, which covers the whole block. Errors as read().
  Status read_columns(int index, Eigen::Index first, Eigen::MatrixXf& out) const;

  // Deletes the file; nothing can be appended or read afterwards.
  Status remove();

 private:
  struct Impl;
  explicit CheckpointFile(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace brainshift::io
