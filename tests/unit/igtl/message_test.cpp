// SPDX-License-Identifier: Apache-2.0
#include "common/igtl/message.hpp"

#include <gmock/gmock.h>

#include <set>

#include "tests/support/results.hpp"
#include "tests/unit/igtl/examples.hpp"

namespace brainshift::igtl {
namespace {

using test_example::contents;
using test_example::encoded;
using test_example::envelope;
using ::testing::HasSubstr;

TEST(Message, DecodeReturnsWhatWasEncodedForEveryTypeAndVersion) {
  std::set<std::size_t> types;
  for (const auto& [name, content] : contents()) {
    for (const std::uint16_t version : test_example::kVersions) {
      const auto message = value_or_fail(decode(encoded(envelope(version), content)));
      EXPECT_TRUE(message.content == content) << name;
      Envelope expected = envelope(version);
      if (version == 1) expected.message_id = 0, expected.metadata.clear();
      EXPECT_EQ(message.envelope, expected) << name;
    }
    types.insert(content.index());
  }
  EXPECT_EQ(types.size(), std::variant_size_v<Content>) << "a type has no example";
}

TEST(Message, TheTypeOfAContentIsThatOfItsHeader) {
  for (const auto& [name, content] : contents()) {
    const auto header = value_or_fail(decode_header(encoded(envelope(), content)));
    EXPECT_EQ(header.type, type_of(content));
    EXPECT_TRUE(is_known_type(header.type));
  }
  EXPECT_FALSE(is_known_type("IMAGES"));
  EXPECT_FALSE(is_known_type(""));
}

// So that neither a version 1 reader sees metadata nor a caller has to keep two envelopes.
TEST(Message, Version1HasNeitherMessageIdNorMetadata) {
  Envelope bare;
  bare.device = envelope().device;
  bare.timestamp = envelope().timestamp;
  for (const auto& [name, content] : contents()) {
    EXPECT_EQ(encoded(envelope(1), content), encoded(bare, content)) << name;
  }
}

TEST(Message, AViewOfVoxelsIsTheSameMessageAsTheImage) {
  const Image image = test_example::image<float>(3);
  const ImageView view{image.geometry, 3,
                       std::span<const float>(std::get<std::vector<float>>(image.voxels))};
  std::string bytes;
  ASSERT_TRUE(encode(envelope(2), view, bytes));
  EXPECT_EQ(bytes, encoded(envelope(2), image));
}

TEST(Message, EncodingKeepsTheMemoryOfTheString) {
  const Image image = test_example::image<float>(3);
  std::string bytes;
  bytes.reserve(100000);
  const char* const at = bytes.data();
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(encode(envelope(2), image, bytes));
    EXPECT_EQ(bytes, encoded(envelope(2), image));
    EXPECT_EQ(bytes.data(), at);
    EXPECT_GE(bytes.capacity(), 100000u);
  }
}

TEST(Message, WhatCannotBeSentIsNotEncodedAndTheTypeIsNamed) {
  const auto message = [](const Envelope& with, const Content& content) {
    std::string bytes = "left from before";
    const Status status = encode(with, content, bytes);
    EXPECT_EQ(bytes, "");
    return status ? "" : status.error().message;
  };
  Envelope wrong = envelope(2);
  wrong.device = std::string(21, 'd');
  EXPECT_EQ(message(wrong, Transform{}),
            "TRANSFORM: device name has 21 bytes, must have at most 20");
  wrong = envelope(3);
  EXPECT_EQ(message(wrong, StatusRequest{}), "GET_STATUS: header version 3, must be 1 or 2");
  wrong = envelope(2);
  wrong.metadata.push_back({"sequence", "43"});
  EXPECT_EQ(message(wrong, Text{}), "STRING: metadata key \"sequence\" occurs twice");
  EXPECT_EQ(message(envelope(), Text{std::string(65536, 'x'), kUsAscii}),
            "STRING: text has 65536 bytes, must have at most 65535");
  Image image = test_example::image<float>(3);
  image.components = 2;
  EXPECT_EQ(message(envelope(), image), "IMAGE: 72 numbers, must be 48");
}

// Names above 20 bytes, as PlusServer sends them.
TEST(Message, WholeNamesStandInTheMetadata) {
  Envelope cut = envelope(2);
  cut.device = "UltrasoundProbeToTra";
  cut.metadata = {{"IGTL_DEVICE_NAME", "UltrasoundProbeToTracker"}, {"TransformStatus", "OK"}};
  EXPECT_EQ(full_device(cut), "UltrasoundProbeToTracker");
  EXPECT_TRUE(is_named(cut, "UltrasoundProbeToTracker"));
  EXPECT_FALSE(is_named(cut, "UltrasoundProbeToTrailer"));
  cut.metadata[0].value = "AnotherNameThatDoesNotBeginSo";
  EXPECT_EQ(full_device(cut), "UltrasoundProbeToTra");
  cut.metadata.clear();
  EXPECT_TRUE(is_named(cut, "UltrasoundProbeToTracker"));
  cut.device = "Ultrasound";
  EXPECT_FALSE(is_named(cut, "UltrasoundProbeToTracker"));
}

TEST(Message, AToolsStateIsThatOfItsWholeName) {
  Envelope tools = envelope(2);
  const std::string cut = "UltrasoundProbeToTra";
  tools.metadata = {{"UltrasoundProbeToTrackerStatus", "OK"}, {"StylusToTrackerStatus", "MISSING"}};
  EXPECT_EQ(tool_state(tools, cut).name, "UltrasoundProbeToTracker");
  EXPECT_TRUE(tool_state(tools, cut).valid);
  EXPECT_FALSE(tool_state(tools, "StylusToTracker").valid);
  EXPECT_FALSE(tool_state(tools, "OtherToTracker").valid) << "nothing is said of it";
  tools.metadata.push_back({"UltrasoundProbeToTrailerStatus", "OK"});
  EXPECT_FALSE(tool_state(tools, cut).valid) << "which of the two?";
  tools.metadata.clear();
  EXPECT_TRUE(tool_state(tools, cut).valid) << "a sender without states";
}

void expect_message_refused(const std::string& bytes, const char* part) {
  test_example::expect_refused(decode(bytes), part);
}

TEST(Message, ErrorsNameTheType) {
  const std::string good = encoded(envelope(2), test_example::text());
  expect_message_refused(good.substr(0, 57), "header of 57 bytes");
  expect_message_refused(good.substr(0, good.size() - 1), "STRING: body of");
  expect_message_refused(good + '\0', "STRING: body of");
  std::string damaged = good;
  damaged.back() = static_cast<char>(damaged.back() ^ 1);
  expect_message_refused(damaged, "STRING of \"brainshift_u\": the CRC-64");
  expect_message_refused(encode_header({1, "VIDEO", "camera", 0, 0, 0}),
                         "VIDEO: a message type that is not read");
  Header header{1, "TRANSFORM", "", 0, 47, 0};
  EXPECT_EQ(sentence_of(decode(header, std::string(47, '\0'))), "TRANSFORM: 47 bytes, must be 48");
  header.version = 2;
  EXPECT_THAT(sentence_of(decode(header, std::string(11, '\0'))),
              HasSubstr("TRANSFORM: extended header of 12 bytes"));
}

}  // namespace
}  // namespace brainshift::igtl
