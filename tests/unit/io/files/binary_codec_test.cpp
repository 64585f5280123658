// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/files/binary_codec.hpp"

#include <gmock/gmock.h>

#include <cstdint>

#include "tests/support/results.hpp"

namespace brainshift::io {
namespace {

using testing::HasSubstr;

TEST(Base64, MatchesTheTestVectorsOfRfc4648) {
  EXPECT_EQ(base64_encode(""), "");
  EXPECT_EQ(base64_encode("f"), "Zg==");
  EXPECT_EQ(base64_encode("fo"), "Zm8=");
  EXPECT_EQ(base64_encode("foo"), "Zm9v");
  EXPECT_EQ(base64_encode("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64_encode("\xff\xfe"), "//4=");
}

TEST(Base64, EveryByteComesBackInPiecesOfAnySize) {
  std::string bytes;
  for (int i = 0; i < 256; ++i) bytes += static_cast<char>(i);
  const std::string text = base64_encode(bytes);
  for (std::size_t piece = 1; piece <= 16; ++piece) {
    Base64Source source(text);
    std::string read;
    while (read.size() + piece <= bytes.size()) read += source.read(piece).value();
    read += source.read(bytes.size() - read.size()).value();
    EXPECT_EQ(read, bytes) << piece;
  }
}

// VTK encodes an array's header and its data one after the other, each with its own padding.
TEST(Base64, PaddingMayOccurInsideAndSpaceAnywhere) {
  Base64Source source(" Zg\n== Zm8= ");
  EXPECT_EQ(source.read(3).value(), "ffo");
}

TEST(Base64, ForeignCharactersAndMissingDataAreRefused) {
  for (const char* text : {"Zm9*", "Z===", "Zg=v", "Zm9", ""}) {
    Base64Source source(text);
    EXPECT_THAT(refusal_of(source.read(3)), HasSubstr("base64 data end too early")) << text;
  }
  Base64Source huge("Zm9v");
  EXPECT_FALSE(huge.read(std::size_t{1} << 60)) << "must be refused without memory for it";
}

TEST(RawSource, GivesItsBytesOnce) {
  RawSource source("abcd");
  EXPECT_EQ(source.read(3).value(), "abc");
  EXPECT_EQ(source.remaining(), 1u);
  EXPECT_FALSE(source.read(2));
  EXPECT_EQ(source.read(1).value(), "d");
}

TEST(LoadNumber, ReadsEitherByteOrder) {
  const char bytes[] = {1, 2, 3, 4};
  EXPECT_EQ(load_number<std::uint32_t>(bytes, false), 0x04030201u);
  EXPECT_EQ(load_number<std::uint32_t>(bytes, true), 0x01020304u);
  std::string out;
  append_number(out, 1.5f);
  EXPECT_EQ(load_number<float>(out.data(), false), 1.5f);
}

TEST(Zlib, ComesBackAndOtherSizesAndDamageAreRefused) {
  const std::string bytes(5000, 'x');
  std::string packed = zlib_compress(bytes);
  EXPECT_LT(packed.size(), 100u);
  EXPECT_EQ(zlib_expand(packed, bytes.size()).value(), bytes);
  EXPECT_FALSE(zlib_expand(packed, bytes.size() - 1));
  EXPECT_FALSE(zlib_expand(packed, bytes.size() + 1));
  packed[packed.size() / 2] ^= 0x40;
  EXPECT_FALSE(zlib_expand(packed, bytes.size()));
}

}  // namespace
}  // namespace brainshift::io
