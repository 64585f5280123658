// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "client/tools/bridge/broadcast.hpp"
#include "client/tools/bridge/field_stream.hpp"
#include "client/tools/bridge/picture.hpp"
#include "common/igtl/message.hpp"
#include "tests/support/toy_patient.hpp"

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
  state.method = "condensed";
  state.boundary = "contact";
  state.blank = false;
  state.has_sd = true;
  state.has_known = true;
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
                          {"recorded", false},
                          {"method", "condensed"},
                          {"boundary", "contact"},
                          {"blank", false},
                          {"has_sd", true},
                          {"has_known", true},
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
  for (const Currency currency : {Currency::kNone, Currency::kSuperseded, Currency::kDegraded,
                                  Currency::kStale, Currency::kAged, Currency::kExpired}) {
    ShownState state = current();
    state.currency = currency;
    state.reason = "no word";
    EXPECT_EQ(to_status(state).code, igtl::kStatusNotReady);
    EXPECT_EQ(to_status(state).text, "no word");
    EXPECT_TRUE(igtl::validate(to_status(state)));
  }
  ShownState good = current();
  good.quality = "good";
  EXPECT_EQ(to_status(good).text, "");
  ShownState caution = current();
  caution.flags = "deadline";
  EXPECT_EQ(to_status(caution).code, igtl::kStatusOk);
  EXPECT_EQ(to_status(caution).text, "caution: deadline");
  ShownState recorded = current();
  recorded.recorded = true;
  EXPECT_EQ(to_status(recorded).code, igtl::kStatusNotReady);
  EXPECT_EQ(to_status(recorded).text, "RECORDED, not the patient now");
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

ShownLine line() {
  ShownLine line;
  line.state.sequence = 12;
  line.state.quality = "good";
  line.state.currency = Currency::kCurrent;
  line.state.age_ms = 80.0;
  line.state.method = "condensed";
  line.state.boundary = "fixed";
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
            "update 12  age 0.08 s  condensed, fixed, good, current  62 x 58 x 60 voxels, 2 mm, "
            "error 0.11 mm  4.2 ms  1 client");
  told.state.recorded = true;
  EXPECT_THAT(shown_line(told, false),
              testing::HasSubstr("  RECORDED, condensed, fixed, good, current  "));
  told.state.recorded = false;
  told.clients = 3;
  told.replaced = 7;
  told.state.age_ms = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(shown_line(told, false),
            "update 12  age unknown  condensed, fixed, good, current  62 x 58 x 60 voxels, 2 mm, "
            "error 0.11 mm  4.2 "
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

using testing::Each;
using testing::ElementsAre;

UpdateMessage update_of(const BrainModel& model) {
  UpdateMessage message;
  message.session_id = 4;
  message.update.sequence = 9;
  message.update.model_id = model.model_id;
  message.update.case_id = model.case_id;
  message.update.estimate.quality.quality = Quality::kGood;
  message.update.estimate.displacement = Points::Constant(3, model.mesh.nodes.cols(), 1.5);
  message.update.estimate.sd_mm = VecX::Constant(model.mesh.nodes.cols(), 0.5);
  message.update.estimate.known = VecX::Constant(model.mesh.nodes.cols(), 0.8);
  return message;
}

struct Sent {
  igtl::Header header;
  igtl::Message message;
};
std::vector<Sent> sent(Broadcast& broadcast, std::uint16_t version) {
  std::vector<Sent> all;
  for (std::size_t i = 0; i < broadcast.size(); ++i) {
    const std::string& bytes = broadcast.bytes(i, version);
    all.push_back({igtl::decode_header(bytes).value(), igtl::decode(bytes).value()});
  }
  return all;
}
std::vector<std::string> devices(const std::vector<Sent>& all) {
  std::vector<std::string> names;
  for (const Sent& each : all) {
    names.push_back(std::string(igtl::type_of(each.message.content)) + " " +
                    each.message.envelope.device);
  }
  return names;
}

class BroadcastOfAToy : public testing::Test {
 protected:
  PicturePtr field() {
    auto picture = stream.picture(update_of(model)).value();
    picture->state.currency = Currency::kCurrent;
    return picture;
  }
  BrainModel model = test_support::toy_patient(5);
  FieldStream stream =
      FieldStream::build(model, {.region = WholeBrain{}, .spacing_mm = 5.0}).value();
};

TEST_F(BroadcastOfAToy, HasEveryDeviceAndTheStateFirst) {
  Broadcast whole(field(), Broadcast::Part::kWhole, 7);
  EXPECT_THAT(devices(sent(whole, 1)),
              ElementsAre("STATUS brainshift", "STRING brainshift_state", "IMAGE brainshift_u",
                          "IMAGE brainshift_sd", "IMAGE brainshift_known",
                          "POLYDATA brainshift_tumour", "POLYDATA brainshift_cortex"));
  Broadcast state(field(), Broadcast::Part::kState, 7);
  EXPECT_THAT(devices(sent(state, 1)), ElementsAre("STATUS brainshift", "STRING brainshift_state"));
  EXPECT_EQ(whole.error(), "");
}

TEST_F(BroadcastOfAToy, LeavesOutWhatIsNotWanted) {
  FieldStream bare =
      FieldStream::build(
          model,
          {.region = WholeBrain{}, .spacing_mm = 5.0, .with_sd = false, .with_surfaces = false})
          .value();
  Broadcast whole(bare.picture(update_of(model)).value(), Broadcast::Part::kWhole, 1);
  EXPECT_THAT(devices(sent(whole, 1)),
              ElementsAre("STATUS brainshift", "STRING brainshift_state", "IMAGE brainshift_u"));
}

TEST_F(BroadcastOfAToy, VersionTwoHasTheStateInEveryMessageAndVersionOneHasNone) {
  Broadcast whole(field(), Broadcast::Part::kWhole, 7);
  const auto one = sent(whole, 1), two = sent(whole, 2);
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].header.version, 1);
    EXPECT_TRUE(one[i].message.envelope.metadata.empty());
    EXPECT_EQ(two[i].header.version, 2);
    EXPECT_EQ(two[i].message.envelope.metadata, to_metadata(whole.picture().state));
    EXPECT_EQ(two[i].message.envelope.message_id, 7u);
    EXPECT_EQ(one[i].message.content, two[i].message.content);
  }
  EXPECT_EQ(*igtl::find(two[2].message.envelope.metadata, "sequence"), "9");
  EXPECT_EQ(*igtl::find(two[2].message.envelope.metadata, "quality"), "good");
}

TEST_F(BroadcastOfAToy, TheVolumeLiesWhereTheGridDoes) {
  Broadcast whole(field(), Broadcast::Part::kWhole, 1);
  const auto image = std::get<igtl::Image>(sent(whole, 1)[2].message.content);
  const FieldGrid& grid = stream.grid();
  EXPECT_EQ(image.geometry.dims, grid.dims);
  EXPECT_EQ(image.components, 3);
  EXPECT_EQ(image.geometry.coordinates, igtl::Coordinates::kRas);
  const AffineTransform T = image.geometry.T_ras_voxel();
  EXPECT_LT((T * Vec3(0, 0, 0) - grid.origin_mm).norm(), 1e-4);
  EXPECT_LT((T * Vec3(3, 2, 1) - grid.voxel_mm(3, 2, 1)).norm(), 1e-4);
  const auto& voxels = std::get<std::vector<float>>(image.voxels);
  EXPECT_EQ(voxels, whole.picture().u);
  const auto known = std::get<igtl::Image>(sent(whole, 1)[4].message.content);
  EXPECT_EQ(known.geometry.dims, grid.dims);
  EXPECT_EQ(std::get<std::vector<float>>(known.voxels), whole.picture().known);
}

TEST_F(BroadcastOfAToy, ABlankPictureIsZeroAndUndeformedAndSaysWhy) {
  ShownState state;
  state.reason = "no word from the daemon";
  state.currency = Currency::kStale;
  state.sequence = 9;
  state.grid_error_mm = 1.0;
  Broadcast whole(blank_picture(stream.rest(), state), Broadcast::Part::kWhole, 1);
  const auto all = sent(whole, 2);
  ASSERT_EQ(all.size(), 7u) << "nothing may be left standing";
  const auto& status = std::get<igtl::StatusReport>(all[0].message.content);
  EXPECT_EQ(status.code, igtl::kStatusNotReady);
  EXPECT_EQ(status.text, "no word from the daemon");
  const auto said = json::parse(std::get<igtl::Text>(all[1].message.content).text);
  EXPECT_EQ(said.at("blank"), true);
  EXPECT_EQ(said.at("sequence"), 0);
  EXPECT_EQ(said.at("grid_error_mm"), 0.0);
  for (const std::size_t i : {2, 3, 4}) {
    const auto& image = std::get<igtl::Image>(all[i].message.content);
    EXPECT_EQ(image.geometry.dims, stream.grid().dims);
    EXPECT_THAT(std::get<std::vector<float>>(image.voxels), Each(0.0F));
  }
  const auto& tumour = std::get<igtl::PolyData>(all[5].message.content);
  EXPECT_TRUE(tumour.points.isApprox(model.tumour.vertices.cast<float>()));
  for (const auto& attribute : tumour.attributes) EXPECT_TRUE(attribute.values.isZero(0.0F));
}

TEST_F(BroadcastOfAToy, WithoutAModelThereIsTheStateAlone) {
  ShownState state;
  state.reason = "no daemon";
  Broadcast whole(blank_picture(nullptr, state), Broadcast::Part::kWhole, 1);
  EXPECT_THAT(devices(sent(whole, 1)), ElementsAre("STATUS brainshift", "STRING brainshift_state"));
}

TEST_F(BroadcastOfAToy, EncodesOncePerVersion) {
  Broadcast whole(field(), Broadcast::Part::kWhole, 1);
  EXPECT_EQ(whole.held_bytes(), Broadcast(field(), Broadcast::Part::kWhole, 1).held_bytes());
  const std::string* first = &whole.bytes(2, 1);
  const std::size_t held = whole.held_bytes();
  EXPECT_GE(held, whole.picture().u.size() * sizeof(float));
  EXPECT_EQ(&whole.bytes(2, 1), first);
  EXPECT_EQ(whole.held_bytes(), held);
}

}  // namespace
}  // namespace brainshift::client
