// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <cmath>
#include <mutex>
#include <nlohmann/json.hpp>
#include <sstream>

#include "client/tools/monitor/watch.hpp"
#include "common/wire/frame.hpp"
#include "tests/support/results.hpp"
#include "tests/support/toy_patient.hpp"
#include "tests/unit/client/lib/fake_daemon.hpp"

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
    EXPECT_THAT(sentence_of(parse_choice(text)), testing::StartsWith(sentence)) << sentence;
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

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;
using wire::MessageType;

UpdateMessage update(std::uint64_t sequence, int nodes) {
  UpdateMessage message;
  message.session_id = 1;
  message.boot_id = 7;
  message.update.model_id = "toy";
  message.update.sequence = sequence;
  message.update.estimate.quality.quality = Quality::kGood;
  message.update.estimate.displacement = Points::Zero(3, nodes);
  return message;
}

TEST(Watch, ALineTellsWhatTravelledAndWhetherItIsCurrent) {
  UpdateMessage message = update(12, 3);
  message.update.part = FieldPart{100, {7, 20, 30}, 0};
  message.received_bytes = 7149;
  message.received_nodes = 2;
  WatchedUpdate told = watched(message, {20}, 100);
  told.status = {Currency::kCurrent, "", 0.08};
  EXPECT_EQ(watch_line(told, false),
            "update 12  0.08 s old  tumour 0.00 mm  good, contact, current\n"
            "  3 of 100 nodes (2 sent, 7.1 kB)");
  told.status = {Currency::kStale, "no word", std::nan("")};
  told.tumour.reset();
  EXPECT_EQ(watch_line(told, false),
            "update 12  age unknown  no tumour node  good, contact, stale\n  stale: no word\n"
            "  3 of 100 nodes (2 sent, 7.1 kB)");
  told.status = {Currency::kAged, "35 s old", 35.0, true};
  EXPECT_THAT(watch_line(told, false),
              HasSubstr("good, contact, aged, RECORDED\n  aged: 35 s old"));
  EXPECT_EQ(nlohmann::json::parse(watch_line(told, true)).at("recorded"), true);
  told.status = {Currency::kStale, "no word", std::nan("")};
  const auto said = nlohmann::json::parse(watch_line(told, true));
  EXPECT_EQ(said.at("sequence"), 12);
  EXPECT_EQ(said.at("currency"), "stale");
  EXPECT_TRUE(said.at("age_s").is_null());
  EXPECT_TRUE(said.at("tumour_mm").is_null());
  EXPECT_EQ(said.at("received_nodes"), 2);
}

TEST(Watch, NoLineIsWiderThanATerminalAndReasonsAreWhole) {
  UpdateMessage message = update(4321, 2);
  QualityVerdict& verdict = message.update.estimate.quality;
  verdict.quality = Quality::kCaution;
  for (int i = 0; i < 40; ++i) verdict.reason += "word" + std::to_string(i) + " ";
  message.update.estimate.displacement = Points::Constant(3, 2, 12.345);
  message.update.estimate.sd_mm = VecX::Constant(2, 0.5);
  WatchedUpdate told = watched(message, {0, 1}, 2);
  told.status = {Currency::kSuperseded, "a newer update has come", 123.456, true};
  const std::string text = watch_line(told, false);
  EXPECT_THAT(text,
              StartsWith("update 4321  123.46 s old  tumour 21.38 ± 0.50 mm  caution, contact"));
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 81u) << line;  // ± is 2
  EXPECT_THAT(text, AllOf(HasSubstr("caution: word0 "), HasSubstr("word39")));
}

TEST(Watch, ALateAnswerIsMarked) {
  UpdateMessage message = update(12, 3);
  message.update.answer_time = {250.0, 50.0};
  WatchedUpdate told = watched(message, {}, 3);
  EXPECT_THAT(watch_line(told, false),
              HasSubstr("\n  LATE: answered 250 ms after its observation came, usually 50 ms"));
  EXPECT_EQ(nlohmann::json::parse(watch_line(told, true)).at("late"), true);
  message.update.answer_time = {100.0, 50.0};
  told = watched(message, {}, 3);
  EXPECT_THAT(watch_line(told, false), Not(HasSubstr("LATE")));
  EXPECT_EQ(nlohmann::json::parse(watch_line(told, true)).at("late"), false);
}

TEST(Watch, AFailureSaysWhy) {
  UpdateMessage message = update(5, 0);
  message.error = Error{ErrorCode::kEmptySet, "no point is inside the brain"};
  EXPECT_THAT(watch_line(watched(message, {}, 3), false),
              HasSubstr("no field, none\n  no point is inside the brain"));
}

// A daemon of the toy patient that sends what was chosen once it is subscribed to: a provisional
// field, and the final one with the first renewal.
TEST(Watch, SubscribesWithTheChoiceAndEndsAfterItsCountOfFinalUpdates) {
  BrainModel model = test_support::toy_patient(5);
  model.model_id = "toy";
  std::mutex mutex;
  std::vector<Subscription> subscriptions;
  FakeDaemon daemon([&](const wire::Frame& request) -> FakeDaemon::Answers {
    const std::lock_guard lock(mutex);
    const std::uint64_t id = request.request_id;
    if (request.type == MessageType::kModelRequest) {
      return {wire::encode_frame(MessageType::kModelReply, id, wire::encode(model))};
    }
    if (request.type != MessageType::kSubscribeRequest) return {};
    subscriptions.push_back(wire::decode_subscription(request.payload).value());
    SessionState state;
    state.session = {7, 1, "toy"};
    state.phase = SessionPhase::kTracking;
    state.newest_update = state.newest_usable = 1;
    state.age_ms = 250.0;
    state.valid_ms = SessionState::kMaxValidity_ms;
    FakeDaemon::Answers answers = {
        wire::encode_frame(MessageType::kSessionState, id, wire::encode(state))};
    if (subscriptions.size() <= 2) {
      UpdateMessage message = update(1, 2);
      message.update.final = subscriptions.size() == 2;
      if (!message.update.final) message.update.estimate.quality = {};
      message.update.part = FieldPart{static_cast<int>(model.mesh.nodes.cols()), {3, 8}, 0};
      answers.push_back(wire::encode_frame(MessageType::kUpdate, 0, wire::encode(message)));
    }
    return answers;
  });
  std::vector<std::string> lines;
  const FieldChoice choice{TumourRegion{40.0}, 10.0, 0.1, false};
  const Status status = watch({.endpoint = daemon.endpoint(), .choice = choice, .count = 1},
                              [&](const std::string& line) { lines.push_back(line); });
  ASSERT_TRUE(status) << status.error().message;
  EXPECT_THAT(lines, ElementsAre(StartsWith("update 1  ")));
  EXPECT_THAT(lines.front(), HasSubstr("2 of 216 nodes (2 sent"));
  EXPECT_THAT(lines.front(), HasSubstr("  good, "));
  const std::lock_guard lock(mutex);
  EXPECT_EQ(subscriptions.front().choice, choice);
  EXPECT_EQ(subscriptions.back().choice, choice) << "a renewal names the choice again";
}

}  // namespace
}  // namespace brainshift::client
