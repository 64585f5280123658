// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/bridge/shown_state.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace brainshift::client {
namespace {

using nlohmann::json;

ShownState current() {
  ShownState state;
  state.sequence = 12;
  state.session_id = 3;
  state.model_id = "abc";
  state.case_id = "toy";
  state.quality = "caution";
  state.flags = "data_outside_region+deadline";
  state.currency = Currency::kCurrent;
  state.age_ms = 81.7;
  state.blank = false;
  state.has_sd = true;
  state.grid_error_mm = 0.125;
  state.spacing_mm = 2.0;
  state.fade_mm = 8.0;
  return state;
}

TEST(ShownState, JsonHasEveryKey) {
  const json object = json::parse(to_json(current()));
  EXPECT_EQ(object, (json{{"sequence", 12},
                          {"session_id", 3},
                          {"model_id", "abc"},
                          {"case_id", "toy"},
                          {"quality", "caution"},
                          {"flags", "data_outside_region+deadline"},
                          {"currency", "current"},
                          {"reason", ""},
                          {"age_ms", 82.0},
                          {"direction", "modeling"},
                          {"blank", false},
                          {"has_sd", true},
                          {"grid_error_mm", 0.125},
                          {"spacing_mm", 2.0},
                          {"fade_mm", 8.0}}));
}

TEST(ShownState, MetadataSaysTheSameAsJson) {
  ShownState state = current();
  state.reason = "seen from \"Köln\"";
  const json object = json::parse(to_json(state));
  const igtl::Metadata metadata = to_metadata(state);
  EXPECT_EQ(metadata.size(), object.size());
  for (const auto& [key, value] : object.items()) {
    const std::string* text = igtl::find(metadata, key);
    ASSERT_NE(text, nullptr) << key;
    EXPECT_EQ(*text, value.is_string() ? value.get<std::string>() : value.dump()) << key;
  }
  EXPECT_TRUE(igtl::validate(metadata));
  for (const igtl::MetadataEntry& entry : metadata) {
    EXPECT_EQ(entry.encoding, entry.key == "reason" ? igtl::kUtf8 : igtl::kUsAscii);
  }
}

TEST(ShownState, AnUnknownAgeIsNoNumber) {
  ShownState state = current();
  state.age_ms = std::nan("");
  EXPECT_TRUE(json::parse(to_json(state)).at("age_ms").is_null());
  EXPECT_EQ(*igtl::find(to_metadata(state), "age_ms"), "unknown");
}

TEST(ShownState, BytesThatAreNoTextAreReplaced) {
  ShownState state = current();
  state.reason = "\xff";
  EXPECT_EQ(json::parse(to_json(state)).at("reason"), "\xEF\xBF\xBD");
  EXPECT_EQ(*igtl::find(to_metadata(state), "reason"), "\xEF\xBF\xBD");
}

TEST(ShownState, TheStatusIsOkForACurrentUsableFieldAlone) {
  EXPECT_EQ(to_status(current()).code, igtl::kStatusOk);
  for (const Currency currency :
       {Currency::kNone, Currency::kSuperseded, Currency::kDegraded, Currency::kStale}) {
    ShownState state = current();
    state.currency = currency;
    state.reason = "no word";
    EXPECT_EQ(to_status(state).code, igtl::kStatusNotReady);
    EXPECT_EQ(to_status(state).text, "no word");
    EXPECT_TRUE(igtl::validate(to_status(state)));
  }
  ShownState blank = current();
  blank.blank = true;
  EXPECT_EQ(to_status(blank).code, igtl::kStatusNotReady);
  EXPECT_FALSE(to_status(blank).text.empty());
  blank.reason = std::string("a\0b", 3);
  EXPECT_TRUE(igtl::validate(to_status(blank)));
}

TEST(ShownState, NamesEveryFlag) {
  Update update;
  EXPECT_EQ(flag_names(update), "");
  update.estimate.quality.flags.set(QualityFlag::kDeadline);
  update.estimate.quality.flags.set(QualityFlag::kInvertedElements);
  EXPECT_EQ(flag_names(update), "deadline+inverted_elements");
  update.answer_time = {201.0, 100.0};
  EXPECT_EQ(flag_names(update), "deadline+inverted_elements+late");
  update.estimate.quality.flags = {};
  EXPECT_EQ(flag_names(update), "late");
}

}  // namespace
}  // namespace brainshift::client
