// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/files/file_access.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>

#include "common/io/files/descriptor.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

std::string system_message(int error) {
  return std::error_code(error, std::generic_category()).message();
}

tl::unexpected<Error> write_error(const fs::path& path, const std::string& action, int error) {
  return write_failed(path, "cannot " + action + ": " + system_message(error));
}

Status sync_path(const fs::path& path, int flags) {
  Descriptor file(::open(path.c_str(), flags | O_CLOEXEC));
  if (file.get() < 0) return write_error(path, "open", errno);
  if (::fsync(file.get()) != 0) return write_error(path, "sync", errno);
  return {};
}

fs::path folder_of(const fs::path& path) {
  return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

}  // namespace

tl::unexpected<Error> file_error(ErrorCode code, const fs::path& path, const std::string& message) {
  return fail(code, path.string() + ": " + message);
}

Status check_regular_file(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) {
    return file_error(ErrorCode::kNotFound, path, "no such file");
  }
  if (error) return unreadable(path, error.message());
  if (status.type() != fs::file_type::regular) return unreadable(path, "not a regular file");
  return {};
}

Result<std::string> read_file(const fs::path& path) {
  if (Status regular = check_regular_file(path); !regular) return tl::unexpected(regular.error());
  std::ifstream in(path, std::ios::binary);
  if (!in) return unreadable(path, "cannot be opened");
  std::error_code error;
  const auto size = fs::file_size(path, error);
  if (error) return unreadable(path, error.message());
  std::string content(static_cast<std::size_t>(size), '\0');
  in.read(content.data(), static_cast<std::streamsize>(content.size()));
  if (in.bad() || in.gcount() != static_cast<std::streamsize>(content.size())) {
    return unreadable(path, "cannot be read to its end");
  }
  return content;
}

Result<std::string> without_byte_order_mark(std::string content) {
  if (content.starts_with("\xEF\xBB\xBF")) content.erase(0, 3);
  const bool wide = content.starts_with("\xFF\xFE") || content.starts_with("\xFE\xFF");
  if (wide && content.find('<') > 3) {
    return unreadable("is text in UTF-16 (its byte-order mark says so): save it as UTF-8");
  }
  return content;
}

Result<std::string> read_text(const fs::path& path) {
  Result<std::string> bytes = read_file(path);
  if (!bytes) return bytes;
  Result<std::string> content = without_byte_order_mark(std::move(*bytes));
  if (!content) return file_error(path, content.error());
  return content;
}

std::string lower_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

Status write_file(const fs::path& path, std::string_view content) {
  Result<PendingFile> pending = PendingFile::create(path);
  if (!pending) return tl::unexpected(pending.error());
  Descriptor file(::open(pending->temporary_path().c_str(), O_WRONLY | O_CLOEXEC));
  if (file.get() < 0) return write_error(path, "open a temporary file", errno);
  while (!content.empty()) {
    const ssize_t written = ::write(file.get(), content.data(), content.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return write_error(path, "write", errno);
    content.remove_prefix(static_cast<std::size_t>(written));
  }
  if (!file.close()) return write_error(path, "write", errno);
  return pending->commit();
}

PendingFile::PendingFile(fs::path path, fs::path temporary)
    : path_(std::move(path)), temporary_(std::move(temporary)) {}

PendingFile::PendingFile(PendingFile&& other) noexcept
    : path_(std::move(other.path_)), temporary_(std::move(other.temporary_)) {
  other.temporary_.clear();
}

PendingFile::~PendingFile() {
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

Result<PendingFile> PendingFile::create(const fs::path& path) {
  // Process and counter keep two writers of the same target apart; hidden, so that no glob picks
  // it up.
  static std::atomic<unsigned> counter{0};
  std::string name = ".";
  name += path.filename().string() + ".tmp-" + std::to_string(::getpid()) + "-";
  name += std::to_string(counter++);
  std::error_code ignored;
  if (path.filename().empty() || fs::is_directory(path, ignored)) {
    return write_failed(path, "is not a file name");
  }
  if (fs::exists(path, ignored) && !fs::is_regular_file(path, ignored)) {
    return write_failed(path, "exists and is not a regular file");
  }
  const fs::path temporary = folder_of(path) / name;
  Descriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644));
  if (file.get() < 0) return write_error(path, "create a temporary file beside it", errno);
  return PendingFile(path, temporary);
}

Status PendingFile::commit() {
  if (Status synced = sync_path(temporary_, O_RDWR); !synced) {
    return write_failed(path_, synced.error().message);
  }
  if (::rename(temporary_.c_str(), path_.c_str()) != 0) return write_error(path_, "rename", errno);
  temporary_.clear();
  if (Status synced = sync_path(folder_of(path_), O_RDONLY | O_DIRECTORY); !synced) {
    return write_failed(path_, synced.error().message);
  }
  return {};
}

}  // namespace brainshift::io
