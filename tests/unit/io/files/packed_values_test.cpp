// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/files/packed_values.hpp"

#include <gmock/gmock.h>
#include <zlib.h>

namespace brainshift::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string deflated(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string packed(size, '\0');
  EXPECT_EQ(compress(reinterpret_cast<Bytef*>(packed.data()), &size,
                     reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()),
            Z_OK);
  packed.resize(size);
  return packed;
}

PackedValues of(std::vector<std::int64_t> sizes, std::string_view data, bool compressed) {
  PackedValues packed;
  packed.sizes = std::move(sizes);
  packed.data = data;
  packed.compressed = compressed;
  return packed;
}

std::string values_refusal(const PackedValues& packed, int bytes_per_value) {
  const auto values = unpack(packed, bytes_per_value);
  if (values) return {};
  EXPECT_EQ(values.error().code, ErrorCode::kUnreadable);
  return values.error().message;
}

TEST(PackedValues, RawAndCompressedHoldTheSame) {
  const std::string bytes = "abcdefgh";
  EXPECT_EQ(*unpack(of({4, 2}, bytes, false), 1), bytes);
  EXPECT_EQ(*unpack(of({4, 2}, deflated(bytes), true), 1), bytes);
  EXPECT_EQ(*unpack(of({0, 0, 7}, "", false), 1), "");
}

TEST(PackedValues, TheOtherByteOrderIsTurned) {
  PackedValues packed = of({2}, "abcdefgh", false);
  packed.big_endian = true;
  EXPECT_EQ(*unpack(packed, 4), "dcbahgfe");
}

TEST(PackedValues, RefusesDataThatDisagreeWithTheSizes) {
  const std::string bytes = "abcdefgh", packed = deflated(bytes);
  EXPECT_THAT(values_refusal(of({9}, bytes, false), 1), HasSubstr("holds 8 bytes of pixels"));
  EXPECT_THAT(values_refusal(of({7}, bytes, false), 1), HasSubstr("holds 8 bytes of pixels"));
  EXPECT_THAT(values_refusal(of({9}, packed, true), 1), HasSubstr("truncated: 8 of 9"));
  EXPECT_THAT(values_refusal(of({7}, packed, true), 1), HasSubstr("more than its sizes say"));
  EXPECT_THAT(values_refusal(of({8}, packed.substr(0, 6), true), 1),
              HasSubstr("compressed pixels are"));
  EXPECT_THAT(values_refusal(of({8}, "abcdefgh", true), 1), HasSubstr("damaged"));
  EXPECT_THAT(values_refusal(of({1000000, 1000000}, bytes, false), 1),
              HasSubstr("more than 8 GiB"));
  EXPECT_THAT(values_refusal(of({1000000, 1000}, packed, true), 1), HasSubstr("are too few"));
}

TEST(PackedValues, SizesAreWholeNumbersInRange) {
  EXPECT_THAT(*parse_sizes("sizes", " 3 4\t5 ", 1), ElementsAre(3, 4, 5));
  EXPECT_THAT(*parse_sizes("sizes", "0 0 5", 0), ElementsAre(0, 0, 5));
  for (const char* text : {"0 1", "-1", "1.5", "x", "1000001", "99999999999999999999"}) {
    const auto sizes = parse_sizes("sizes", text, 1);
    ASSERT_FALSE(sizes) << text;
    EXPECT_THAT(sizes.error().message, HasSubstr("sizes = " + std::string(text)));
  }
}

TEST(PackedValues, NamesOfTypesOfBothFormatsAreOne) {
  EXPECT_EQ(element_type("MET_USHORT"), "uint16");
  EXPECT_EQ(element_type("unsigned short int"), "uint16");
  EXPECT_EQ(element_type("float"), "float");
  EXPECT_EQ(element_type("block"), "block");
}

}  // namespace
}  // namespace brainshift::io
