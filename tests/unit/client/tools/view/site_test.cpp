// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/view/site.hpp"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

namespace brainshift::client {
namespace {

UpdateMessage moved(double mm, Quality quality) {
  UpdateMessage message;
  message.update.sequence = 7;
  message.update.answer_time = {90.0, 30.0, 0.0};
  Estimate& estimate = message.update.estimate;
  estimate.displacement = Points::Zero(3, 4);
  estimate.displacement.row(2).setConstant(-mm);
  estimate.displacement.col(3).setConstant(1e3);  // outside of the tumour
  estimate.sd_mm = VecX::LinSpaced(4, 0.1, 0.4);
  estimate.misfit_mm.mean = 0.3;
  estimate.quality.quality = quality;
  return message;
}

TEST(HistoryPoint, HasTheMotionOfTheTumourWithItsSd) {
  const HistoryPoint point = history_point(moved(2.0, Quality::kCaution), {0, 1, 2});
  EXPECT_EQ(point.update, 7u);
  EXPECT_EQ(point.quality, "caution");
  EXPECT_DOUBLE_EQ(point.motion_mm, 2.0);
  EXPECT_DOUBLE_EQ(point.motion_sd, 0.2);
  EXPECT_DOUBLE_EQ(point.misfit_mm, 0.3);
  EXPECT_DOUBLE_EQ(point.latency_ms, 90.0);
  EXPECT_TRUE(point.late);
}

TEST(HistoryPoint, OfAFieldThatMayNotBeShownHasNoMotion) {
  UpdateMessage failed = moved(2.0, Quality::kGood);
  failed.error = Error{ErrorCode::kEmptySet, "no point"};
  EXPECT_EQ(history_point(failed, {0}).quality, "failed");
  for (const UpdateMessage& message : {failed, moved(2.0, Quality::kUnusable)}) {
    const HistoryPoint point = history_point(message, {0});
    EXPECT_TRUE(std::isnan(point.motion_mm) && std::isnan(point.misfit_mm));
    EXPECT_DOUBLE_EQ(point.latency_ms, 90.0);
  }
}

TEST(PageState, IsOneLineOfJsonWhateverItsTextsHold) {
  PageState state;
  state.status.reason = "line\nbreak \"quoted\" </script> \xff";
  state.status.age_s = kNoNumber;
  state.shown = history_point(moved(1.0, Quality::kGood), {});
  state.sources.push_back({.name = "ius"});
  state.left_out.push_back({"falx", "no key", "1 mm"});
  const std::string line = to_json(state, 12.5);
  EXPECT_EQ(line.find('\n'), std::string::npos);
  const auto json = nlohmann::json::parse(line);
  EXPECT_EQ(json["clock_ms"], 12.5);
  EXPECT_TRUE(json["age_s"].is_null());
  EXPECT_TRUE(json["shown"]["motion_mm"].is_null());  // no node in the tumour
  EXPECT_EQ(json["sources"][0]["name"], "ius");
  EXPECT_EQ(json["left_out"][0]["error"], "1 mm");
  EXPECT_EQ(json["currency"], "none");
}

TEST(Site, AnotherModelTakesFieldAndMriAway) {
  Site site;
  const HttpSource source = site.source();
  EXPECT_FALSE(source.get("/model").has_value());
  site.show_model("a", "{}", "in", "grey");
  site.show_field("1.1.3", "field");
  EXPECT_EQ(*source.get("/field")->body, "field");
  EXPECT_EQ(source.get("/field")->of, "1.1.3");
  EXPECT_EQ(source.get("/mri")->of, "a");
  site.show_model("b", "{}", "in", std::nullopt);
  EXPECT_EQ(source.get("/model")->of, "b");
  EXPECT_FALSE(source.get("/field").has_value() || source.get("/mri").has_value() ||
               source.get("/history").has_value());
}

TEST(Site, HasAdviceComputedOnlyWhereAPageAsks) {
  Site without;
  EXPECT_FALSE(without.source().get("/advice"));
  Site site;
  int asked = 0;
  site.on_advice_asked([&] { ++asked; });
  const HttpSource source = site.source();
  source.get("/model");
  EXPECT_EQ(asked, 0);
  EXPECT_EQ(*source.get("/advice")->body, "{}");
  EXPECT_EQ(asked, 1);
  site.show_advice("{\"of\":\"1.2.3\"}");
  EXPECT_EQ(*source.get("/advice")->body, "{\"of\":\"1.2.3\"}");
}

}  // namespace
}  // namespace brainshift::client
