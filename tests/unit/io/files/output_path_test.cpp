// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/files/output_path.hpp"

#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;
using test_support::content_of;
using test_support::TemporaryFolder;
using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

std::string file_refusal(const fs::path& path, ErrorCode code = ErrorCode::kInvalidArgument) {
  return refusal_of(check_output_file("--out", path), code);
}

void make_socket(const fs::path& path) {
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  ASSERT_LT(path.native().size(), sizeof address.sun_path);
  path.native().copy(address.sun_path, sizeof address.sun_path - 1);
  EXPECT_EQ(bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  close(fd);
}

TEST(OutputFile, NewFilesRegularFilesAndLinksToThemAreTakenAndNothingIsLeftOrChanged) {
  const TemporaryFolder folder;
  folder.write("old", "content");
  fs::create_symlink(folder / "old", folder / "link");
  for (const char* name : {"new", "old", "link"}) {
    const Status status = check_output_file("--out", folder / name);
    EXPECT_TRUE(status) << status.error().message;
  }
  EXPECT_EQ(content_of(folder / "old"), "content");
  EXPECT_EQ(folder.entries(), 2u);
}

TEST(OutputFile, ARelativeNameLiesInTheWorkingFolder) {
  const TemporaryFolder folder;
  const fs::path before = fs::current_path();
  fs::current_path(folder.path());
  EXPECT_TRUE(check_output_file("--out", "new"));
  fs::current_path(before);
}

TEST(OutputFile, WhatIsNoRegularFileIsRefusedAndStays) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "folder");
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  make_socket(folder / "socket");
  fs::create_symlink("/dev/null", folder / "link");
  const std::pair<fs::path, const char*> kBad[] = {
      {folder / "folder", "is a folder"}, {folder / "pipe", "is a named pipe"},
      {folder / "socket", "is a socket"}, {folder / "link", "is a device"},
      {"/dev/null", "is a device"},       {"/dev/full", "is a device"}};
  for (const auto& [path, reason] : kBad) {
    EXPECT_THAT(file_refusal(path),
                AllOf(StartsWith("--out: " + path.string() + ": "), HasSubstr(reason)));
    EXPECT_TRUE(fs::exists(path));
  }
}

TEST(OutputFile, AMissingOrUnwritableFolderIsNamed) {
  const TemporaryFolder folder;
  EXPECT_THAT(file_refusal(folder / "no" / "f", ErrorCode::kNotFound),
              AllOf(StartsWith("--out: "), HasSubstr((folder / "no").string() + " does not")));
  folder.write("file", "");
  EXPECT_THAT(file_refusal(folder / "file" / "f", ErrorCode::kNotFound), HasSubstr("--out: "));
  // Not even root makes a file there.
  EXPECT_THAT(file_refusal("/proc/f"), HasSubstr("no file can be made in the folder /proc"));
}

TEST(OutputFile, ANameIsNeeded) {
  EXPECT_THAT(file_refusal(""), HasSubstr("must name a file"));
  const TemporaryFolder folder;
  EXPECT_THAT(file_refusal(folder / "new" / ""), HasSubstr("must name a file"));
  EXPECT_THAT(file_refusal(folder / std::string(300, 'n')), HasSubstr("File name too long"));
}

TEST(OutputFolder, AFolderOrWhatCanBecomeOneIsTakenAndNothingIsMade) {
  const TemporaryFolder folder;
  EXPECT_TRUE(check_output_folder("--out", folder.path()));
  EXPECT_TRUE(check_output_folder("--out", folder / "new" / "newer"));
  EXPECT_EQ(folder.entries(), 0u);
}

TEST(OutputFolder, AFileInTheWayOrAnUnwritableFolderIsRefused) {
  const TemporaryFolder folder;
  folder.write("file", "");
  fs::create_symlink(folder / "nothing", folder / "dangling");
  for (const fs::path& path : {folder / "file", folder / "file" / "below", folder / "dangling",
                               fs::path("/dev/null"), fs::path("/proc/new")}) {
    EXPECT_THAT(refusal_of(check_output_folder("--out", path), ErrorCode::kInvalidArgument),
                StartsWith("--out: " + path.string() + ": "));
  }
  EXPECT_THAT(refusal_of(check_output_folder("--out", ""), ErrorCode::kInvalidArgument),
              HasSubstr("must name a folder"));
}

}  // namespace
}  // namespace brainshift::io
