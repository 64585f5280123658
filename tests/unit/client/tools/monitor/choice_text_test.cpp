// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/monitor/choice_text.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace brainshift::client {
namespace {

TEST(ChoiceText, ReadsEveryChoice) {
  EXPECT_EQ(parse_choice({}).value(), FieldChoice{});
  EXPECT_EQ(parse_choice({"tumour:40mm", "10mm", "0.1mm", true}).value(),
            (FieldChoice{TumourRegion{40.0}, 10.0, 0.1, false}));
  EXPECT_EQ(parse_choice({.region = "-30,12.5,0:40mm"}).value(),
            (FieldChoice{.region = BallRegion{Vec3(-30, 12.5, 0), 40.0}}));
}

TEST(ChoiceText, NamesWhatItCannotRead) {
  const auto expect = [](const ChoiceText& text, const char* sentence) {
    const auto refused = parse_choice(text);
    ASSERT_FALSE(refused) << sentence;
    EXPECT_THAT(refused.error().message, testing::StartsWith(sentence));
  };
  for (const char* region :
       {"", "tumor:4mm", "tumour", "tumour:", "tumour:4", "tumour:mm", "1,2:4mm", "1,2,3,4:4mm",
        "1,,3:4mm", "1,2,3:4cm", "1,2,x:4mm", "tumour:4 mm", "tumour:4mm:4mm", ":4mm"}) {
    const std::string sentence = "--region " + std::string(region) + ": must be brain, tumour";
    expect({.region = region}, sentence.c_str());
  }
  for (const char* length : {"", "10", "10cm", "mm", "ten mm", "10mmm"}) {
    const std::string spacing = "--decimate " + std::string(length) + ": must be a length";
    expect({.spacing = length}, spacing.c_str());
    const std::string tolerance = "--tolerance " + std::string(length) + ": must be a length";
    expect({.tolerance = length}, tolerance.c_str());
  }
  expect({.region = "tumour:-1mm"}, "choice.tumour.margin_mm = -1: must be in [0, 1000]");
  expect({.region = "nan,0,0:1mm"}, "choice.ball.centre_mm = nan: must be a number");
}

}  // namespace
}  // namespace brainshift::client
