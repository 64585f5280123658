// SPDX-License-Identifier: Apache-2.0
#include "common/igtl/metadata.hpp"

#include <gmock/gmock.h>

#include "tests/support/results.hpp"
#include "tests/unit/igtl/examples.hpp"

namespace brainshift::igtl {
namespace {

using test_example::complaint;
using ::testing::HasSubstr;
using namespace std::string_literals;

Metadata example_metadata() {
  return {{"sequence", "42"}, {"case", "M\xc3\xbcller", kUtf8}, {"reason", ""}};
}

std::string body_of(const Metadata& metadata, const std::string& content) {
  const BodyFrame frame = encode_body_frame(2, 0x01020304u, metadata);
  return frame.before + content + frame.after;
}

void expect_metadata_refused(const std::string& body, const char* part) {
  test_example::expect_refused(decode_body(2, body), part);
}

TEST(Metadata, LayoutIsTheDocumentedOne) {
  EXPECT_EQ(body_of({{"key", "value", 106}, {"k", ""}}, "content"),
            "\0\14\0\22\0\0\0\11\1\2\3\4"
            "content"
            "\0\2\0\3\0\152\0\0\0\5\0\1\0\3\0\0\0\0"
            "keyvaluek"s);
}

TEST(Metadata, DecodeReturnsWhatWasEncoded) {
  for (const Metadata& metadata : {Metadata{}, example_metadata()}) {
    for (const std::string& content : {""s, "content"s}) {
      const std::string body = body_of(metadata, content);
      const auto parts = value_or_fail(decode_body(2, body));
      EXPECT_EQ(parts.content, content);
      EXPECT_EQ(parts.message_id, 0x01020304u);
      EXPECT_EQ(parts.metadata, metadata);
    }
  }
}

TEST(Metadata, Version1IsTheContentAlone) {
  const BodyFrame frame = encode_body_frame(1, 7, example_metadata());
  EXPECT_EQ(frame.before + frame.after, "");
  const auto parts = value_or_fail(decode_body(1, "content"));
  EXPECT_EQ(parts.content, "content");
  EXPECT_TRUE(parts.metadata.empty());
}

TEST(Metadata, AnEmptyBodyIsEmptyInBothVersions) {
  for (const std::uint16_t version : test_example::kVersions) {
    const auto parts = value_or_fail(decode_body(version, ""));
    EXPECT_EQ(parts.content, "");
  }
}

TEST(Metadata, ABodyWithoutAMetadataHeaderHasNone) {
  const std::string body = "\0\14\0\0\0\0\0\0\0\0\0\5content"s;
  const auto parts = value_or_fail(decode_body(2, body));
  EXPECT_EQ(parts.content, "content");
  EXPECT_EQ(parts.message_id, 5u);
  EXPECT_TRUE(parts.metadata.empty());
}

TEST(Metadata, WhatALongerExtendedHeaderAddsIsSkipped) {
  const std::string body = "\0\16\0\2\0\0\0\0\0\0\0\5??content\0\0"s;
  const auto parts = value_or_fail(decode_body(2, body));
  EXPECT_EQ(parts.content, "content");
}

TEST(Metadata, SizesBeyondTheBodyAreRefused) {
  const std::string body = body_of(example_metadata(), "content");
  const auto with = [&body](std::size_t at, const std::string& bytes) {
    return std::string(body).replace(at, bytes.size(), bytes);
  };
  expect_metadata_refused("\0\14\0\0"s, "extended header");
  expect_metadata_refused(with(0, "\0\13"s), "extended header of 11 bytes");
  expect_metadata_refused(with(0, "\xff\xff"), "extended header of 65535 bytes");
  expect_metadata_refused(with(2, "\xff\xff"), "metadata of 65");
  expect_metadata_refused(with(4, "\xff\xff\xff\xff"), "metadata of 4294967");
  expect_metadata_refused(with(2, "\0\1"s), "metadata count");
  const std::size_t entries = 12 + 7;
  expect_metadata_refused(with(entries, "\xff\xff"), "header of 65535 metadata entries");
  expect_metadata_refused(with(entries, "\0\4"s), "header of 4 metadata entries");
  expect_metadata_refused(with(entries + 2, "\xff\xff"), "metadata key of 65535 bytes");
  expect_metadata_refused(with(entries + 6, "\xff\xff\xff\xff"),
                          "metadata value of 4294967295 bytes");
}

TEST(Metadata, FindGivesTheValueOfTheKey) {
  const Metadata metadata = example_metadata();
  ASSERT_NE(find(metadata, "sequence"), nullptr);
  EXPECT_EQ(*find(metadata, "sequence"), "42");
  EXPECT_EQ(find(metadata, "Sequence"), nullptr);
  EXPECT_EQ(find({}, ""), nullptr);
}

TEST(Metadata, ValidateNamesWhatIsWrong) {
  EXPECT_EQ(complaint(example_metadata()), "");
  EXPECT_EQ(complaint(Metadata{{"", "value"}}), "metadata key is empty");
  EXPECT_EQ(complaint(Metadata{{"a", "1"}, {"a", "2"}}), "metadata key \"a\" occurs twice");
  EXPECT_EQ(complaint(Metadata{{"a", std::string(kMaxMetadataBytes - 1, 'v')}}), "");
  EXPECT_THAT(complaint(Metadata{{"a", std::string(kMaxMetadataBytes, 'v')}}),
              HasSubstr("65536 bytes"));
  Metadata many(kMaxMetadataEntries + 1);
  EXPECT_THAT(complaint(many), HasSubstr("8192 metadata entries"));
}

TEST(Metadata, AsManyEntriesAsTheProtocolAllowsSurvive) {
  Metadata many;
  for (std::size_t i = 0; i < kMaxMetadataEntries; ++i) many.push_back({std::to_string(i), "v"});
  ASSERT_TRUE(validate(many));
  const auto parts = value_or_fail(decode_body(2, body_of(many, "")));
  EXPECT_EQ(parts.metadata, many);
}

}  // namespace
}  // namespace brainshift::igtl
