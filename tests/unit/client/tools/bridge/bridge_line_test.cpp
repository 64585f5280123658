// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/bridge/bridge_line.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace brainshift::client {
namespace {

ShownLine line() {
  ShownLine line;
  line.state.sequence = 12;
  line.state.quality = "good";
  line.state.currency = Currency::kCurrent;
  line.state.age_ms = 80.0;
  line.state.spacing_mm = 2.0;
  line.state.grid_error_mm = 0.114;
  line.dims = {62, 58, 60};
  line.made_ms = 4.21;
  line.clients = 1;
  return line;
}

TEST(BridgeLine, TellsWhatIsShownAndToHowMany) {
  ShownLine told = line();
  EXPECT_EQ(shown_line(told, false),
            "update 12  age 0.08 s  good, current  62 x 58 x 60 voxels, 2 mm, error 0.11 mm  4.2 ms"
            "  1 client");
  told.clients = 3;
  told.replaced = 7;
  told.state.age_ms = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(shown_line(told, false),
            "update 12  age unknown  good, current  62 x 58 x 60 voxels, 2 mm, error 0.11 mm  4.2 "
            "ms  3 clients, 7 replaced");
}

TEST(BridgeLine, JsonHasTheStateAndTheCounts) {
  const auto object = nlohmann::json::parse(shown_line(line(), true));
  EXPECT_EQ(object.at("event"), "update");
  EXPECT_EQ(object.at("sequence"), 12);
  EXPECT_EQ(object.at("dims"), (nlohmann::json{62, 58, 60}));
  EXPECT_EQ(object.at("clients"), 1);
  EXPECT_EQ(object.at("replaced"), 0);
  const auto note = nlohmann::json::parse(note_line("so it is", true));
  EXPECT_EQ(note, (nlohmann::json{{"event", "note"}, {"text", "so it is"}}));
  EXPECT_EQ(note_line("so it is", false), "so it is");
}

}  // namespace
}  // namespace brainshift::client
