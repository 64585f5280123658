// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/main/ipc_socket.hpp"

#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <filesystem>

#include "common/io/files/descriptor.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::server {
namespace {

namespace fs = std::filesystem;
using test_support::content_of;
using test_support::TemporaryFolder;
using testing::HasSubstr;

io::Descriptor listen_at(const fs::path& path) {
  io::Descriptor fd(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.native().copy(address.sun_path, sizeof address.sun_path - 1);
  EXPECT_EQ(bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  EXPECT_EQ(listen(fd.get(), 1), 0);
  return fd;
}

std::string refusal(const std::string& endpoint, ErrorCode code) {
  const Status status = check_ipc_path(endpoint);
  EXPECT_FALSE(status) << endpoint;
  if (status) return {};
  EXPECT_EQ(status.error().code, code);
  EXPECT_THAT(status.error().message, HasSubstr(endpoint + ": "));
  return status.error().message;
}

TEST(IpcPath, AFreePathAndALeftoverSocketAreTaken) {
  const TemporaryFolder folder;
  const std::string endpoint = "ipc://" + (folder / "s").string();
  EXPECT_TRUE(check_ipc_path(endpoint));
  listen_at(folder / "s");  // closed at once: the file stays, as after a crash
  EXPECT_TRUE(fs::is_socket(folder / "s"));
  EXPECT_TRUE(check_ipc_path(endpoint));
  EXPECT_TRUE(check_ipc_path("tcp://127.0.0.1:5555"));
}

TEST(IpcPath, AFileThatIsNoSocketIsRefusedAndStays) {
  const TemporaryFolder folder;
  folder.write("patient.h5", "model");
  EXPECT_THAT(refusal("ipc://" + (folder / "patient.h5").string(), ErrorCode::kInvalidArgument),
              HasSubstr("no socket"));
  EXPECT_EQ(content_of(folder / "patient.h5"), "model");
  EXPECT_THAT(refusal("ipc://" + folder.path().string(), ErrorCode::kInvalidArgument),
              HasSubstr("no socket"));
}

TEST(IpcPath, TheSocketOfARunningProcessIsNotTakenOver) {
  const TemporaryFolder folder;
  const auto listening = listen_at(folder / "s");
  EXPECT_THAT(refusal("ipc://" + (folder / "s").string(), ErrorCode::kUnavailable),
              HasSubstr("another process listens"));
}

TEST(IpcPath, AMissingFolderAndAPathThatIsTooLongAreRefused) {
  const TemporaryFolder folder;
  EXPECT_THAT(refusal("ipc://" + (folder / "no" / "s").string(), ErrorCode::kNotFound),
              HasSubstr("does not exist"));
  EXPECT_THAT(refusal("ipc:///tmp/" + std::string(120, 's'), ErrorCode::kInvalidArgument),
              HasSubstr("at most 107"));
}

TEST(OwnerOnly, WhatIsCreatedMeanwhileIsForTheOwnerAndNotLater) {
  const TemporaryFolder folder;
  const auto mode = [&](const char* name) {
    folder.write(name, "");
    return fs::status(folder / name).permissions() & fs::perms::mask;
  };
  const mode_t before = umask(022);
  {
    const OwnerOnly guard;
    EXPECT_EQ(mode("meanwhile"), fs::perms::owner_read | fs::perms::owner_write);
  }
  EXPECT_NE(mode("later") & fs::perms::others_read, fs::perms::none);
  umask(before);
}

}  // namespace
}  // namespace brainshift::server
