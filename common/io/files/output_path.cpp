// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/files/output_path.hpp"

#include <fmt/format.h>

#include <system_error>

#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

// In words; empty for what a file can replace or be made from.
std::string_view obstacle(fs::file_type type) {
  switch (type) {
    case fs::file_type::not_found:
    case fs::file_type::regular: return {};
    case fs::file_type::directory: return "a folder";
    case fs::file_type::block:
    case fs::file_type::character: return "a device";
    case fs::file_type::fifo: return "a named pipe";
    case fs::file_type::socket: return "a socket";
    default: return "of an unknown kind";
  }
}

tl::unexpected<Error> refuse(ErrorCode code, std::string_view option, const fs::path& path,
                             const std::string& reason) {
  return fail(code, fmt::format("{}: {}: {}", option, path.string(), reason));
}

fs::path output_folder_of(const fs::path& path) {
  return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

// No access bits: a read-only or special file system has its own opinion.
Status check_writable(std::string_view option, const fs::path& path, const fs::path& trial) {
  const auto file = PendingFile::create(trial);  // removed again at once
  if (file) return {};
  return refuse(
      ErrorCode::kInvalidArgument, option, path,
      fmt::format("no file can be made in the folder {}", output_folder_of(trial).string()));
}

}  // namespace

Status check_output_file(std::string_view option, const fs::path& path) {
  if (!path.has_filename()) {
    return invalid(fmt::format("{}: \"{}\" must name a file", option, path.string()));
  }
  std::error_code error;
  const fs::file_type type = fs::status(path, error).type();
  if (type == fs::file_type::none) {
    return refuse(ErrorCode::kInvalidArgument, option, path, error.message());
  }
  if (const std::string_view what = obstacle(type); !what.empty()) {
    return refuse(ErrorCode::kInvalidArgument, option, path,
                  fmt::format("is {}, must be a regular file or not exist yet", what));
  }
  const fs::path folder = output_folder_of(path);
  if (!fs::is_directory(folder, error)) {
    return refuse(ErrorCode::kNotFound, option, path,
                  fmt::format("the folder {} does not exist", folder.string()));
  }
  return check_writable(option, path, path);
}

Status check_output_folder(std::string_view option, const fs::path& path) {
  if (path.empty()) return invalid(fmt::format("{}: must name a folder", option));
  std::error_code ignored;
  fs::path existing = fs::absolute(path, ignored);
  while (!fs::exists(fs::symlink_status(existing, ignored)) && existing.has_relative_path()) {
    existing = existing.parent_path();
  }
  if (!fs::is_directory(existing, ignored)) {
    return refuse(ErrorCode::kInvalidArgument, option, path,
                  fmt::format("{} is no folder", existing.string()));
  }
  return check_writable(option, path, existing / "file");
}

}  // namespace brainshift::io
