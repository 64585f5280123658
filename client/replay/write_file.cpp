// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/replay/write_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

namespace brainshift::client {
namespace {

// Writes everything and syncs; the errno of the first failure, or 0.
int write_and_sync(int descriptor, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return ::fsync(descriptor) == 0 ? 0 : errno;
}

}  // namespace

Status write_file(const std::filesystem::path& path, std::string_view bytes) {
  const auto failed = [&path](int error) {
    return fail(ErrorCode::kWriteFailed,
                path.string() + ": cannot be written (" + std::strerror(error) + ")");
  };
  const std::string temporary = path.string() + ".tmp" + std::to_string(::getpid());
  const int descriptor = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (descriptor < 0) return failed(errno);

  int error = write_and_sync(descriptor, bytes);
  if (::close(descriptor) != 0 && error == 0) error = errno;
  if (error == 0 && ::rename(temporary.c_str(), path.c_str()) != 0) error = errno;
  if (error != 0) {
    ::unlink(temporary.c_str());
    return failed(error);
  }
  return {};
}

}  // namespace brainshift::client
