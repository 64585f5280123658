// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/files/file_access.hpp"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using test_support::content_of;
using test_support::TemporaryFolder;

using testing::HasSubstr;

TEST(FileAccess, WrittenBytesAreReadBack) {
  const TemporaryFolder folder;
  const std::string content("a\0b\r\n\xff", 6);
  ASSERT_TRUE(write_file(folder / "f", content));
  EXPECT_EQ(read_file(folder / "f").value(), content);
  EXPECT_EQ(folder.entries(), 1u) << "the temporary file is gone";
}

TEST(FileAccess, WritingReplacesTheWholeFile) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_file(folder / "f", "a long first content"));
  ASSERT_TRUE(write_file(folder / "f", "short"));
  EXPECT_EQ(read_file(folder / "f").value(), "short");
}

TEST(FileAccess, MissingFileIsNotFoundAndNamed) {
  const TemporaryFolder folder;
  EXPECT_THAT(refusal_of(read_file(folder / "absent"), ErrorCode::kNotFound),
              HasSubstr("absent: no such file"));
}

TEST(FileAccess, FolderIsUnreadable) {
  const TemporaryFolder folder;
  refusal_of(read_file(folder.path()), ErrorCode::kUnreadable);
}

TEST(FileAccess, WritingIntoAMissingFolderFailsAndNamesTheFile) {
  const TemporaryFolder folder;
  EXPECT_THAT(refusal_of(write_file(folder / "no" / "f", "x"), ErrorCode::kWriteFailed),
              HasSubstr("no/f: cannot create"));
}

TEST(FileAccess, WritingOverAFolderFailsAndLeavesNothing) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "d");
  refusal_of(write_file(folder / "d", "x"), ErrorCode::kWriteFailed);
  EXPECT_EQ(folder.entries(), 1u);
}

TEST(FileAccess, OnlyARegularFileIsReplaced) {
  const TemporaryFolder folder;
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  std::filesystem::create_symlink("/dev/null", folder / "device");
  for (const char* name : {"pipe", "device"}) {
    const auto before = std::filesystem::symlink_status(folder / name).type();
    EXPECT_THAT(refusal_of(write_file(folder / name, "x"), ErrorCode::kWriteFailed),
                HasSubstr("exists and is not a regular file"));
    EXPECT_EQ(std::filesystem::symlink_status(folder / name).type(), before);
  }
  EXPECT_EQ(folder.entries(), 2u);
}

TEST(FileAccess, UncommittedFileIsRemovedAndTheOldOneKept) {
  const TemporaryFolder folder;
  folder.write("f", "old");
  {
    const auto pending = value_or_fail(PendingFile::create(folder / "f"));
    std::ofstream(pending.temporary_path()) << "half";
    EXPECT_EQ(folder.entries(), 2u);
  }
  EXPECT_EQ(folder.entries(), 1u);
  EXPECT_EQ(content_of(folder / "f"), "old");
}

TEST(FileAccess, TwoWritersOfOneFileDoNotMeet) {
  const TemporaryFolder folder;
  auto first = value_or_fail(PendingFile::create(folder / "f"));
  auto second = value_or_fail(PendingFile::create(folder / "f"));
  EXPECT_NE(first.temporary_path(), second.temporary_path());
  std::ofstream(first.temporary_path()) << "first";
  std::ofstream(second.temporary_path()) << "second";
  ASSERT_TRUE(first.commit());
  EXPECT_EQ(content_of(folder / "f"), "first");
  ASSERT_TRUE(second.commit());
  EXPECT_EQ(content_of(folder / "f"), "second");
}

TEST(ByteOrderMark, OfUtf8IsCutOffAndUtf16IsNamed) {
  EXPECT_EQ(value_or_fail(without_byte_order_mark("\xEF\xBB\xBFx,y")), "x,y");
  EXPECT_EQ(value_or_fail(without_byte_order_mark("x\xEF\xBB\xBF")), "x\xEF\xBB\xBF");
  EXPECT_EQ(value_or_fail(without_byte_order_mark("")), "");
  for (const auto& text : {std::string("\xFF\xFEx\0", 4), std::string("\xFE\xFF\0x", 4)}) {
    EXPECT_THAT(refusal_of(without_byte_order_mark(text)), testing::HasSubstr("UTF-16"));
  }
  const std::string xml("\xFF\xFE<\0", 4);
  EXPECT_EQ(value_or_fail(without_byte_order_mark(xml)), xml);
}

TEST(ByteOrderMark, NoParserSeesIt) {
  const test_support::TemporaryFolder folder;
  const auto path = folder.write("a.csv",
                                 "\xEF\xBB\xBF"
                                 "1,2");
  EXPECT_EQ(value_or_fail(read_text(path)), "1,2");
  const auto same = [](const std::string& content) -> Result<std::string> { return content; };
  EXPECT_EQ(value_or_fail(parse_file(path, same)), "1,2");
  const auto wide = folder.write("b.csv", std::string("\xFF\xFE"
                                                      "1\0",
                                                      4));
  EXPECT_THAT(refusal_of(read_text(wide)), testing::StartsWith(wide.string() + ": is text"));
}

TEST(LowerExtension, HasItsDotAndNoCapitals) {
  EXPECT_EQ(lower_extension("a/B.NII.GZ"), ".gz");
  EXPECT_EQ(lower_extension("a.b/C"), "");
}

}  // namespace
}  // namespace brainshift::io
