// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/main/ipc_socket.hpp"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <cerrno>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "common/io/files/descriptor.hpp"

namespace brainshift::server {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kScheme = "ipc://";
constexpr mode_t kNobodyElse = 0177;

// Whether a process answers at the socket. The path fits.
bool has_listener(const fs::path& path) {
  const io::Descriptor probe(socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.native().copy(address.sun_path, sizeof address.sun_path - 1);
  const int status =
      connect(probe.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address);
  return status == 0 || errno != ECONNREFUSED;
}

}  // namespace

Status check_ipc_path(const std::string& endpoint) {
  if (endpoint.rfind(kScheme, 0) != 0) return {};
  const fs::path path = endpoint.substr(kScheme.size());
  const auto refuse = [&](ErrorCode code, const std::string& reason) {
    return fail(code, fmt::format("endpoint {}: {}", endpoint, reason));
  };
  constexpr std::size_t kLongest = sizeof(sockaddr_un::sun_path) - 1;
  if (path.native().size() > kLongest) {
    return refuse(ErrorCode::kInvalidArgument,
                  fmt::format("the path must have at most {} characters", kLongest));
  }
  std::error_code ignored;
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, ignored)) {
    return refuse(ErrorCode::kNotFound,
                  fmt::format("the folder {} does not exist", folder.string()));
  }
  const fs::file_type type = fs::symlink_status(path, ignored).type();
  if (type == fs::file_type::not_found) return {};
  if (type != fs::file_type::socket) {
    return refuse(ErrorCode::kInvalidArgument, "the file is no socket, and would be removed");
  }
  if (has_listener(path)) return refuse(ErrorCode::kUnavailable, "another process listens there");
  return {};
}

OwnerOnly::OwnerOnly() : before_(umask(kNobodyElse)) {}
OwnerOnly::~OwnerOnly() { umask(before_); }

}  // namespace brainshift::server
