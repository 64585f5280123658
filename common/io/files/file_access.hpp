// SPDX-License-Identifier: GPL-3.0-or-later
// Whole files in and out; every write is checked, and a reader never sees half a file.
//
// A file is written under a temporary name in its own folder, synced, renamed over the final
// name, and the folder is synced: after a crash there is the old file or the new one. Messages
// begin with the path.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>

#include "common/core/error.hpp"

namespace brainshift::io {

// Ok if `path` is a regular file; else kNotFound or kUnreadable.
Status check_regular_file(const std::filesystem::path& path);

// The bytes of a regular file. kNotFound, or kUnreadable.
Result<std::string> read_file(const std::filesystem::path& path);

// Replaces `path` by `content`, or leaves it as it was. kWriteFailed. What is no regular file is
// never replaced.
Status write_file(const std::filesystem::path& path, std::string_view content);

// For libraries that write the file themselves: they write to temporary_path(), and commit() puts
// the complete file in place. Without commit() the temporary file is removed.
class PendingFile {
 public:
  // The temporary file exists and is empty. kWriteFailed, also when `path` is a device or the like.
  static Result<PendingFile> create(const std::filesystem::path& path);
  PendingFile(PendingFile&& other) noexcept;
  PendingFile& operator=(PendingFile&&) = delete;
  ~PendingFile();

  const std::filesystem::path& temporary_path() const { return temporary_; }
  // Sync, rename, sync the folder. kWriteFailed.
  Status commit();

 private:
  PendingFile(std::filesystem::path path, std::filesystem::path temporary);
  std::filesystem::path path_;
  std::filesystem::path temporary_;  // empty once committed or moved from
};

// "PATH: MESSAGE" as an Error.
tl::unexpected<Error> file_error(ErrorCode code, const std::filesystem::path& path,
                                 const std::string& message);
inline tl::unexpected<Error> file_error(const std::filesystem::path& path, const Error& error) {
  return file_error(error.code, path, error.message);
}

inline tl::unexpected<Error> invalid_file(const std::filesystem::path& path,
                                          const std::string& message) {
  return file_error(ErrorCode::kInvalidArgument, path, message);
}
inline tl::unexpected<Error> write_failed(const std::filesystem::path& path,
                                          const std::string& message) {
  return file_error(ErrorCode::kWriteFailed, path, message);
}
// What is wrong with a file's content, for parsers that do not know the file's name.
inline tl::unexpected<Error> unreadable(std::string message) {
  return fail(ErrorCode::kUnreadable, std::move(message));
}
// The same with the path in front.
inline tl::unexpected<Error> unreadable(const std::filesystem::path& path,
                                        const std::string& message) {
  return file_error(ErrorCode::kUnreadable, path, message);
}

// The one rule for byte-order marks: that of UTF-8 in front of a file's content is cut off.
// kUnreadable for UTF-16, unless it is XML, which says so itself.
Result<std::string> without_byte_order_mark(std::string content);
// The content of a text file behind its byte-order mark. Errors of read_file, and the above.
Result<std::string> read_text(const std::filesystem::path& path);

// Of the name, in lower case, with its dot: programs write .NII and .STL too.
std::string lower_extension(const std::filesystem::path& path);

// What `parse` makes of a regular file's content behind its byte-order mark: a Result. Errors of
// read_text, and those of `parse` with the path in front.
template <typename Parse>
auto parse_file(const std::filesystem::path& path, const Parse& parse)
    -> decltype(parse(std::string())) {
  Result<std::string> content = read_text(path);
  if (!content) return tl::unexpected(content.error());
  auto parsed = parse(std::move(*content));
  if (!parsed) return file_error(path, parsed.error());
  return parsed;
}

}  // namespace brainshift::io
