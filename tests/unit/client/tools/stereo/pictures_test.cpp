// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/stereo/pictures.hpp"

#include <gmock/gmock.h>
#include <zlib.h>

#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::client {
namespace {

using test_support::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;

// Three pixels across, two down.
const std::string kGrey = std::string("P5 3 2 255\n") + "\x01\x02\x03\x04\x05\x06";

TEST(ReadPicture, KeepsRowsAndColumnsOfGreyLevels) {
  const TemporaryFolder folder;
  const auto image = value_or_fail(read_picture(folder.write("a.pgm", kGrey)));
  EXPECT_EQ(image.width, 3);
  EXPECT_EQ(image.height, 2);
  EXPECT_THAT(image.pixels, ElementsAre(1, 2, 3, 4, 5, 6));
}

TEST(ReadPicture, DividesSixteenBitsAndTakesTheLuminanceOfColours) {
  const TemporaryFolder folder;
  const auto deep = value_or_fail(read_picture(folder.write(
      "deep.pgm", std::string("P5 2 1 65535\n") + std::string("\x80\x00\x01\x00", 4))));
  EXPECT_THAT(deep.pixels, ElementsAre(128, 1));
  const auto colour = value_or_fail(read_picture(folder.write(
      "colour.ppm",
      std::string("P6 3 1 255\n") + std::string("\xff\x00\x00\x00\xff\x00\x00\x00\xff", 9))));
  EXPECT_THAT(colour.pixels, ElementsAre(76, 150, 29));  // 0.299 R + 0.587 G + 0.114 B
}

TEST(ReadPicture, ReadsAGzipFileAndRejectsADamagedOne) {
  const TemporaryFolder folder;
  const std::string path = (folder / "a.pgm.gz").string();
  const gzFile file = gzopen(path.c_str(), "wb");
  ASSERT_NE(file, nullptr);
  ASSERT_EQ(gzwrite(file, kGrey.data(), static_cast<unsigned>(kGrey.size())),
            static_cast<int>(kGrey.size()));
  ASSERT_EQ(gzclose(file), Z_OK);
  const auto image = value_or_fail(read_picture(path));
  EXPECT_THAT(image.pixels, ElementsAre(1, 2, 3, 4, 5, 6));

  const std::string whole = test_support::content_of(path);
  EXPECT_THAT(refusal_of(read_picture(folder.write("b.pgm.gz", whole.substr(0, whole.size() - 6))),
                         ErrorCode::kUnreadable),
              HasSubstr("b.pgm.gz: is a damaged gzip file"));
}

TEST(ReadPicture, NamesAFileThatIsMissingEmptyOrNoPicture) {
  const TemporaryFolder folder;
  EXPECT_THAT(refusal_of(read_picture(folder / "nowhere.png"), ErrorCode::kNotFound),
              HasSubstr("nowhere.png"));
  for (const char* text : {"", "no picture"}) {
    EXPECT_THAT(refusal_of(read_picture(folder.write("bad.png", text)), ErrorCode::kUnreadable),
                HasSubstr("bad.png"))
        << text;
  }
}

TEST(ExpandPatterns, KeepsTheOrderOfPatternsAndSortsEachOnesFiles) {
  const TemporaryFolder folder;
  for (const char* name : {"l2.png", "l1.png", "r1.png"}) folder.write(name, "");
  const auto files =
      value_or_fail(expand_patterns({(folder / "r*.png").string(), (folder / "l?.png").string()}));
  EXPECT_THAT(files, ElementsAre(folder / "r1.png", folder / "l1.png", folder / "l2.png"));
  EXPECT_THAT(
      refusal_of(expand_patterns({(folder / "l1.png").string(), (folder / "x*.png").string()}),
                 ErrorCode::kNotFound),
      HasSubstr("x*.png"));
}

}  // namespace
}  // namespace brainshift::client
