// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/files/nrrd_header.hpp"

#include <gmock/gmock.h>

namespace brainshift::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr const char* kGood =
    "NRRD0004\n# a comment\ntype: unsigned short\ndimension: 3\nsizes: 4 3 2\r\n"
    "encoding: gzip\nendian: big\nSegment0_Name:=a name: with colons\nSegment0_Tags:=\n\nDATA";

std::string replaced(std::string text, const std::string& what, const std::string& with) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), with);
}

std::string refusal(const std::string& text) {
  const auto header = parse_nrrd_header(text);
  if (header) return {};
  EXPECT_EQ(header.error().code, ErrorCode::kUnreadable);
  return header.error().message;
}

TEST(TakeLine, CutsAtTheLineFeedAndTakesTheRestWhereThereIsNone) {
  std::string_view rest = "a: 1\n\nend";
  EXPECT_EQ(take_line(rest), "a: 1");
  EXPECT_EQ(take_line(rest), "");
  EXPECT_EQ(rest, "end");
  EXPECT_EQ(take_line(rest), "end");
  EXPECT_EQ(take_line(rest), "");
}

TEST(NrrdHeader, KeepsFieldsAndKeysAndWhatFollows) {
  const auto header = parse_nrrd_header(kGood);
  ASSERT_TRUE(header) << header.error().message;
  EXPECT_THAT(header->sizes, ElementsAre(4, 3, 2));
  EXPECT_EQ(header->element_type, "uint16");
  EXPECT_TRUE(header->big_endian);
  EXPECT_TRUE(header->compressed);
  EXPECT_EQ(header->field("Segment0_Name"), "a name: with colons");
  EXPECT_EQ(header->field("Segment0_Tags"), "");
  EXPECT_EQ(header->field("Segment1_Name"), "");
  EXPECT_EQ(header->data, "DATA");
}

TEST(NrrdHeader, NeitherCaseNorBlanksOfNamesCount) {
  const auto header = parse_nrrd_header(
      "NRRD0004\nType: Unsigned Short\nDIMENSION: 1\nSizes: 2\nencoding: RAW\nEndian: Big\n"
      "Space Directions: (1,0,0)\n\nDATA");
  ASSERT_TRUE(header) << header.error().message;
  EXPECT_EQ(header->element_type, "uint16");
  EXPECT_TRUE(header->big_endian);
  EXPECT_FALSE(header->compressed);
  EXPECT_EQ(header->field("spacedirections"), "(1,0,0)");
  EXPECT_EQ(header->word("type"), "unsigned short");
  EXPECT_THAT(refusal("NRRD0004\ntype: float\nTYPE: float\n\n"), HasSubstr("given twice"));
}

TEST(NrrdHeader, RefusesWhatItCannotStandFor) {
  const auto bad = [](const char* what, const char* with) {
    return refusal(replaced(kGood, what, with));
  };
  EXPECT_THAT(refusal(""), HasSubstr("is no NRRD file"));
  EXPECT_THAT(refusal("PNG"), HasSubstr("is no NRRD file"));
  EXPECT_THAT(refusal("NRRD0004\ntype: uint8\n"), HasSubstr("has no end"));
  EXPECT_THAT(bad("dimension: 3", "dimension: 2"), HasSubstr("dimension = \"2\""));
  EXPECT_THAT(bad("dimension: 3\n", ""), HasSubstr("dimension = \"\""));
  EXPECT_THAT(bad("sizes: 4 3 2", "sizes: 4 -3 2"), HasSubstr("sizes = 4 -3 2"));
  EXPECT_THAT(bad("sizes: 4 3 2", "sizes: 4 3 9999999999"), HasSubstr("every size must be"));
  EXPECT_THAT(bad("sizes: 4 3 2", "sizes: four"), HasSubstr("sizes = four"));
  EXPECT_THAT(bad("encoding: gzip", "encoding: bzip2"), HasSubstr("encoding = bzip2"));
  EXPECT_THAT(bad("encoding: gzip", "encoding:"), HasSubstr("\"encoding:\" has no value"));
  EXPECT_THAT(bad("endian: big", "endian: middle"), HasSubstr("endian = middle"));
  EXPECT_THAT(bad("# a comment", "data file: other.raw"),
              HasSubstr("data file = other.raw: its pixels lie elsewhere"));
  EXPECT_THAT(bad("# a comment", "datafile: other.raw"), HasSubstr("detached header"));
  EXPECT_THAT(refusal("NRRD0004\ndimension: 1\nsizes: 2\ndata file: a.raw\n"),
              HasSubstr("data file = a.raw: its pixels lie elsewhere"));
  EXPECT_THAT(bad("# a comment", "byte skip: -1"), HasSubstr("byte skip = -1"));
  EXPECT_THAT(bad("# a comment", "type: float"), HasSubstr("field type is given twice"));
  EXPECT_THAT(bad("# a comment", "words alone"), HasSubstr("\"words alone\" has no value"));
}

}  // namespace
}  // namespace brainshift::io
