// SPDX-License-Identifier: Apache-2.0
// Payloads that Protobuf would accept and the service must reject.
#include <gmock/gmock.h>

#include <functional>
#include <limits>

#include "brainshift/v1/brainshift.pb.h"
#include "common/core/stopwatch.hpp"
#include "common/wire/frame.hpp"
#include "tests/unit/wire/refusals.hpp"
#include "tests/unit/wire/sample_values.hpp"

namespace brainshift::wire {
namespace {

namespace pb = brainshift::v1;

// A length-delimited field as raw bytes; `tag` is its first byte.
std::string raw_field(char tag, const std::string& content) {
  std::string out(1, tag);
  for (std::size_t size = content.size(); size > 0; size >>= 7) {
    out.push_back(static_cast<char>((size & 0x7f) | (size > 0x7f ? 0x80 : 0)));
  }
  return out + content;
}
constexpr char kContactTag = 0x6a;       // Update.contact
constexpr char kActiveSlavesTag = 0x2a;  // Contact.active_slaves
constexpr char kForceTag = 0x32;         // Contact.force_n

Result<Observation> decode_changed(int kind, const std::function<void(pb::Observation&)>& change) {
  return decode_observation(changed<pb::Observation>(encode(sample_observation(kind)), change));
}
Result<BrainModel> decode_changed_model(const std::function<void(pb::ModelReply&)>& change) {
  return decode_model(changed<pb::ModelReply>(encode(sample_model()), change));
}
Result<UpdateMessage> decode_changed_update(const std::function<void(pb::Update&)>& change) {
  return decode_update(changed<pb::Update>(encode(sample_update()), change));
}

// ---------- numbers that are not finite ----------

class NotFinite : public ::testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Values, NotFinite, ::testing::ValuesIn(kNotFinite), name_of_number);

TEST_P(NotFinite, InAnObservationIsRefusedNamingTheField) {
  const double bad = GetParam();
  const auto expect = [&](int kind, const char* field,
                          std::function<void(pb::Observation&)> change) {
    expect_refused(decode_changed(kind, change), ErrorCode::kNotFinite, field);
  };
  expect(0, "tumour_boundary.points.xyz_mm: entry 4 ",
         [=](auto& m) { m.mutable_tumour_boundary()->mutable_points()->set_xyz_mm(4, bad); });
  expect(0, "tumour_boundary.sd_mm", [=](auto& m) { m.mutable_tumour_boundary()->set_sd_mm(bad); });
  expect(1, "cortical_surface.surface.vertices", [=](auto& m) {
    m.mutable_cortical_surface()->mutable_surface()->mutable_vertices()->set_xyz_mm(0, bad);
  });
  expect(1, "cortical_surface.sd_mm",
         [=](auto& m) { m.mutable_cortical_surface()->set_sd_mm(bad); });
  expect(2, "landmark_pairs.undeformed",
         [=](auto& m) { m.mutable_landmark_pairs()->mutable_undeformed()->set_xyz_mm(8, bad); });
  expect(2, "landmark_pairs.deformed",
         [=](auto& m) { m.mutable_landmark_pairs()->mutable_deformed()->set_xyz_mm(0, bad); });
  expect(2, "landmark_pairs.sd_mm", [=](auto& m) { m.mutable_landmark_pairs()->set_sd_mm(bad); });
  expect(3, "patient_pose.gravity_direction",
         [=](auto& m) { m.mutable_patient_pose()->set_gravity_direction(2, bad); });
  expect(3, "patient_pose.fluid_level_mm",
         [=](auto& m) { m.mutable_patient_pose()->set_fluid_level_mm(bad); });
}

TEST_P(NotFinite, InAModelIsRefusedNamingTheField) {
  const double bad = GetParam();
  const auto expect = [&](const char* field, std::function<void(pb::ModelReply&)> change) {
    expect_refused(decode_changed_model(change), ErrorCode::kNotFinite, field);
  };
  expect("model.nodes", [=](auto& m) { m.mutable_nodes()->set_xyz_mm(14, bad); });
  expect("model.skull",
         [=](auto& m) { m.mutable_skull()->mutable_vertices()->set_xyz_mm(1, bad); });
  expect("model.tumour",
         [=](auto& m) { m.mutable_tumour()->mutable_vertices()->set_xyz_mm(1, bad); });
  expect("model.gravity_direction", [=](auto& m) { m.set_gravity_direction(0, bad); });
  expect("model.fluid_plane_depth_mm", [=](auto& m) { m.set_fluid_plane_depth_mm(bad); });
  expect("model.slave_plane_depth_mm", [=](auto& m) { m.set_slave_plane_depth_mm(bad); });
}

TEST_P(NotFinite, InAnUpdateIsRefusedNamingTheField) {
  const double bad = GetParam();
  const auto bad_float = static_cast<float>(bad);
  const auto expect = [&](const char* field, std::function<void(pb::Update&)> change) {
    expect_refused(decode_changed_update(change), ErrorCode::kNotFinite, field);
  };
  expect("displacement.xyz_mm: entry 11 ",
         [=](auto& m) { m.mutable_displacement()->set_xyz_mm(11, bad_float); });
  expect("update.sd_mm", [=](auto& m) { m.set_sd_mm(0, bad_float); });
  expect("update.sources.age_s", [=](auto& m) { m.mutable_sources(0)->set_age_s(bad); });
  expect("update.sources.p_value", [=](auto& m) { m.mutable_sources(0)->set_p_value(bad); });
  expect("contact.force_n", [=](auto& m) { m.mutable_contact()->set_force_n(1, bad_float); });
  expect("contact.max_penetration_mm",
         [=](auto& m) { m.mutable_contact()->set_max_penetration_mm(bad); });
  expect("initial_misfit.mean_mm", [=](auto& m) { m.mutable_initial_misfit()->set_mean_mm(bad); });
  expect("misfit.std_mm", [=](auto& m) { m.mutable_misfit()->set_std_mm(bad); });
  expect("history.misfit",
         [=](auto& m) { m.mutable_history(1)->mutable_misfit()->set_mean_mm(bad); });
  expect("history.max_penetration_mm",
         [=](auto& m) { m.mutable_history(0)->set_max_penetration_mm(bad); });
  expect("history.elapsed_ms", [=](auto& m) { m.mutable_history(0)->set_elapsed_ms(bad); });
  expect("timings.register_ms", [=](auto& m) { m.mutable_timings()->set_register_ms(bad); });
  expect("timings.journal_ms", [=](auto& m) { m.mutable_timings()->set_journal_ms(bad); });
  expect("rotation_row_major",
         [=](auto& m) { m.mutable_t_undeformed_deformed()->set_rotation_row_major(0, bad); });
  expect("translation_mm",
         [=](auto& m) { m.mutable_t_undeformed_deformed()->set_translation_mm(0, bad); });
}

TEST_P(NotFinite, InASessionReplyIsRefusedNamingTheField) {
  SessionInfo info;
  info.prepare_s = GetParam();
  expect_refused(decode_session_info(encode(info)), ErrorCode::kNotFinite, "session.prepare_s");
}

// ---------- counts, ranges, meaning ----------

TEST(Refusal, WrongCountsInAnObservation) {
  expect_refused(
      decode_changed(
          0, [](auto& m) { m.mutable_tumour_boundary()->mutable_points()->add_xyz_mm(1.0); }),
      ErrorCode::kProtocol, "22 numbers, must be a multiple of 3");
  expect_refused(
      decode_changed(1,
                     [](auto& m) {
                       m.mutable_cortical_surface()->mutable_surface()->add_triangle_indices(0);
                     }),
      ErrorCode::kProtocol, "triangle_indices: 13 numbers");
  expect_refused(
      decode_changed(2,
                     [](auto& m) {
                       auto* xyz = m.mutable_landmark_pairs()->mutable_deformed()->mutable_xyz_mm();
                       xyz->Truncate(xyz->size() - 3);
                     }),
      ErrorCode::kProtocol, "3 undeformed and 2 deformed");
  expect_refused(
      decode_changed(3, [](auto& m) { m.mutable_patient_pose()->add_gravity_direction(0); }),
      ErrorCode::kProtocol, "gravity_direction: 4 numbers, must be 3");
  expect_refused(
      decode_changed(3, [](auto& m) { m.mutable_patient_pose()->clear_gravity_direction(); }),
      ErrorCode::kProtocol, "gravity_direction: 0 numbers, must be 3");
}

TEST(Refusal, WrongCountsInAModelOrUpdate) {
  expect_refused(decode_changed_model([](auto& m) { m.add_tet_indices(0); }), ErrorCode::kProtocol,
                 "tet_indices: 9 numbers, must be a multiple of 4");
  expect_refused(decode_changed_model([](auto& m) { m.add_boundary_indices(0); }),
                 ErrorCode::kProtocol, "boundary_indices: 7 numbers");
  expect_refused(decode_changed_model([](auto& m) { m.add_tet_labels(0); }), ErrorCode::kProtocol,
                 "tet_labels: 3 labels");
  expect_refused(decode_changed_update([](auto& m) { m.mutable_displacement()->add_xyz_mm(0); }),
                 ErrorCode::kProtocol, "displacement.xyz_mm: 13 numbers");
  expect_refused(decode_changed_update([](auto& m) { m.add_sd_mm(0); }), ErrorCode::kProtocol,
                 "sd_mm: 5 values, must be 0 or one per node (4)");
  expect_refused(decode_changed_update([](auto& m) { m.set_known("\xff\x80\x01"); }),
                 ErrorCode::kProtocol, "update.known: 3 values, must be 0 or one per node (4)");
  expect_refused(decode_changed_update([](auto& m) { m.mutable_contact()->add_force_n(0); }),
                 ErrorCode::kProtocol, "3 forces for 2 active slaves");
  expect_refused(decode_changed_update(
                     [](auto& m) { m.mutable_t_undeformed_deformed()->add_rotation_row_major(0); }),
                 ErrorCode::kProtocol, "rotation_row_major: 10 numbers, must be 9");
}

TEST(Refusal, IndicesOutOfRange) {
  for (const int bad : {-1, 5, std::numeric_limits<int>::max(), std::numeric_limits<int>::min()}) {
    const auto expect = [&](const char* field, std::function<void(pb::ModelReply&)> change) {
      expect_refused(decode_changed_model(change), ErrorCode::kProtocol, field);
    };
    expect("model.tet_indices: index", [=](auto& m) { m.set_tet_indices(3, bad); });
    expect("model.boundary_indices", [=](auto& m) { m.set_boundary_indices(0, bad); });
    expect("model.skull.triangle_indices",
           [=](auto& m) { m.mutable_skull()->set_triangle_indices(0, bad); });
    expect("model.tumour.triangle_indices",
           [=](auto& m) { m.mutable_tumour()->set_triangle_indices(0, bad); });
    expect("model.craniotomy", [=](auto& m) { m.set_craniotomy(0, bad); });
    expect("model.brainstem", [=](auto& m) { m.set_brainstem(0, bad); });
    expect("model.slaves", [=](auto& m) { m.set_slaves(1, bad); });
    expect("model.fixed", [=](auto& m) { m.set_fixed(0, bad); });
    expect_refused(
        decode_changed_update([=](auto& m) { m.mutable_contact()->set_active_slaves(0, bad); }),
        ErrorCode::kProtocol, "update.contact.active_slaves: index");
  }
}

TEST(Refusal, NegativeStandardDeviationsAndDirectionsThatAreNoUnitVector) {
  expect_refused(decode_changed(0, [](auto& m) { m.mutable_tumour_boundary()->set_sd_mm(-0.5); }),
                 ErrorCode::kProtocol, "tumour_boundary.sd_mm: -0.5, must not be negative");
  expect_refused(
      decode_changed(3, [](auto& m) { m.mutable_patient_pose()->set_gravity_direction(0, 9.81); }),
      ErrorCode::kProtocol, "must be 1");
  expect_refused(decode_changed_update([](auto& m) {
                   m.mutable_t_undeformed_deformed()->set_rotation_row_major(0, -1.5);
                 }),
                 ErrorCode::kProtocol, "must be a rotation");
}

TEST(Refusal, AReflectionIsNoRotation) {
  expect_refused(decode_changed_update([](auto& m) {
                   auto* r = m.mutable_t_undeformed_deformed()->mutable_rotation_row_major();
                   for (int i = 0; i < 9; ++i) r->Set(i, i == 0 ? -1.0 : i % 4 == 0 ? 1.0 : 0.0);
                 }),
                 ErrorCode::kProtocol, "must be a rotation");
}

TEST(Refusal, UnknownNamesAreQuoted) {
  pb::StartSessionRequest request;
  request.set_method("magic");
  request.set_boundary("contact");
  expect_refused(decode_session_request(request.SerializeAsString()), ErrorCode::kInvalidArgument,
                 "start_session.method = \"magic\"");
  request.set_method("paper");
  request.set_boundary("");
  expect_refused(decode_session_request(request.SerializeAsString()), ErrorCode::kInvalidArgument,
                 "start_session.boundary = \"\"");
  expect_refused(decode_changed_update([](auto& m) { m.set_status("done\n"); }),
                 ErrorCode::kProtocol, "update.status: \"done?\"");
  expect_refused(decode_changed_update([](auto& m) { m.set_method("x"); }), ErrorCode::kProtocol,
                 "update.method");
  expect_refused(decode_changed_update([](auto& m) { m.set_boundary("x"); }), ErrorCode::kProtocol,
                 "update.boundary");
}

TEST(Refusal, AStateThatContradictsItselfAndAWindowBeyondTheLimit) {
  pb::SessionState state;
  expect_refused(decode_session_state(state.SerializeAsString()), ErrorCode::kProtocol,
                 "session_state.phase: 0 is unknown");
  state.set_phase(pb::SESSION_PHASE_TRACKING);
  state.set_newest_usable(2);
  state.set_newest_update(1);
  expect_refused(decode_session_state(state.SerializeAsString()), ErrorCode::kProtocol,
                 "session_state.newest_usable: is above");
  state.set_newest_update(2);
  state.set_age_ms(-1.0);
  expect_refused(decode_session_state(state.SerializeAsString()), ErrorCode::kProtocol,
                 "session_state.age_ms");
  pb::SubscribeRequest request;
  request.set_window(Subscription::kMaxWindow + 1);
  expect_refused(decode_subscription(request.SerializeAsString()), ErrorCode::kProtocol,
                 "subscribe.window: 257, must be at most 256");
}

TEST(Refusal, AFailedUpdateWithAFieldAndAGoodOneWithAnError) {
  expect_refused(decode_changed_update([](auto& m) { m.set_status("failed"); }),
                 ErrorCode::kProtocol, "update.error_code: is absent");
  expect_refused(decode_changed_update([](auto& m) {
                   m.set_status("failed");
                   m.set_error_code("internal");
                 }),
                 ErrorCode::kProtocol, "update.displacement: is present");
  expect_refused(decode_changed_update([](auto& m) { m.set_error_code("internal"); }),
                 ErrorCode::kProtocol, "update.error_code: is present");
}

TEST(Refusal, AnObservationWithoutBody) {
  expect_refused(decode_observation(""), ErrorCode::kProtocol, "observation.body");
}

TEST(Refusal, CountsThatDoNotFit) {
  pb::StartSessionReply reply;
  reply.set_nodes(1u << 31);
  expect_refused(decode_session_info(reply.SerializeAsString()), ErrorCode::kProtocol,
                 "session.nodes");
}

TEST(Refusal, AnErrorReplyThatCannotBeReadIsAProtocolError) {
  EXPECT_EQ(decode_error("\x0a\xff").code, ErrorCode::kProtocol);
}

TEST(Refusal, AnErrorCodeOfANewerVersionKeepsItsName) {
  pb::ErrorReply reply;
  reply.set_code("out_of_tea");
  reply.set_message("no more");
  const Error error = decode_error(reply.SerializeAsString());
  EXPECT_EQ(error.code, ErrorCode::kInternal);
  EXPECT_EQ(error.message, "out_of_tea: no more");
}

// ---------- malformed and hostile bytes ----------

// A cut at a field boundary is a shorter valid message, which is why payloads are framed. Any
// other cut must be rejected, and none may crash.
TEST(Hostile, TruncatedPayloadsAreRefusedOrShorter) {
  const std::string payload = encode(sample_update());
  int refused = 0;
  for (std::size_t size = 0; size < payload.size(); ++size) {
    const auto decoded = decode_update(std::string_view(payload).substr(0, size));
    if (!decoded) ++refused;
    const std::string frame = encode_frame(MessageType::kUpdate, 0, payload);
    EXPECT_FALSE(decode_frame(std::string_view(frame).substr(0, kHeaderBytes + size)));
  }
  EXPECT_GT(refused, static_cast<int>(payload.size() * 9 / 10));
}

TEST(Hostile, ConcatenatedPayloadsAreRefused) {
  const std::string payload = encode(sample_observation(0));
  expect_refused(decode_observation(payload + payload), ErrorCode::kProtocol,
                 "occurs more than once");
}

TEST(Hostile, TwoBodiesAreRefused) {
  pb::Observation other;
  other.mutable_patient_pose()->set_fluid_level_mm(1.0);
  expect_refused(decode_observation(encode(sample_observation(0)) + other.SerializeAsString()),
                 ErrorCode::kProtocol, "occurs more than once");
}

TEST(Hostile, EveryFlippedBitIsRefusedOrDecodesToAValue) {
  const std::string payload = encode(sample_judged_update());
  for (std::size_t offset = 0; offset < payload.size(); ++offset) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string damaged = payload;
      damaged[offset] = static_cast<char>(damaged[offset] ^ (1 << bit));
      const auto decoded = decode_update(damaged);
      EXPECT_TRUE(!decoded || decoded->update.estimate.displacement.allFinite());
    }
  }
}

TEST(Hostile, TextThatIsNotUtf8IsRefused) {
  expect_refused(decode_observation("\x0a\x01\xff"), ErrorCode::kProtocol,
                 "Observation.case_id: is not UTF-8");
}

TEST(Hostile, WrongWireTypesGroupsAndBadTagsAreRefused) {
  expect_refused(decode_observation(std::string("\x08\x01", 2)), ErrorCode::kProtocol,
                 "wrong wire type");
  expect_refused(decode_observation(std::string("\x0b\x0c", 2)), ErrorCode::kProtocol, "malformed");
  expect_refused(decode_observation(std::string("\x00\x01", 2)), ErrorCode::kProtocol,
                 "malformed field tag");
  expect_refused(decode_observation(std::string(1, '\0')), ErrorCode::kProtocol,
                 "malformed field tag");
  expect_refused(decode_observation(std::string(11, '\xff')), ErrorCode::kProtocol,
                 "malformed field tag");
}

TEST(Hostile, AFieldOfANewerVersionIsIgnored) {
  const std::string unknown("\xfa\x7f\x02hi", 5);  // field 2047, two bytes
  EXPECT_TRUE(decode_observation(encode(sample_observation(0)) + unknown));
}

void expect_refused_quickly(const std::function<Result<UpdateMessage>()>& decode,
                            const char* text) {
  const Stopwatch watch;
  const auto result = decode();
  const double elapsed_ms = watch.milliseconds();
  expect_refused(result, ErrorCode::kProtocol, text);
  // The walk stops at the cap, within microseconds. A parse of the whole takes seconds and 227 MB.
  EXPECT_LT(elapsed_ms, 100.0);
}

std::string repeat(const std::string& unit, std::size_t bytes) {
  std::string out;
  out.reserve(bytes + unit.size());
  while (out.size() < bytes) out += unit;
  return out;
}

TEST(Hostile, TenMegabytesOfEmptySubmessagesAreRefusedQuickly) {
  const std::string history = repeat(std::string("\x82\x01\x00", 3), 10u << 20);  // field 16
  expect_refused_quickly([&] { return decode_update(history); }, "more than 65536 fields");
  const std::string unknown = repeat(std::string("\xfa\x7f\x00", 3), 10u << 20);  // field 2047
  expect_refused_quickly([&] { return decode_update(unknown); }, "more than 65536 fields");
}

TEST(Hostile, EmptyFieldsInsideASubmessageCountToo) {
  const std::string forces = repeat(std::string{kForceTag, '\0'}, 1u << 20);
  const std::string payload = raw_field(kContactTag, forces);
  expect_refused_quickly([&] { return decode_update(payload); }, "more than 65536 fields");
}

// 17 million one-byte varints would become 68 MB.
TEST(Hostile, TooManyNumbersAreRefusedBeforeTheyAreAllocated) {
  const std::string indices(17'000'000, '\x01');
  expect_refused(decode_update(raw_field(kContactTag, raw_field(kActiveSlavesTag, indices))),
                 ErrorCode::kProtocol, "more than 16777216 numbers");
}

TEST(Hostile, MorePointsThanTheCapAreRefused) {
  Observation observation = sample_observation(0);
  observation.body = TumourBoundary{Points::Zero(3, kMaxPoints + 1), 0.1};
  expect_refused(decode_observation(encode(observation)), ErrorCode::kProtocol,
                 "2000001 entries, must be at most 2000000");
}

TEST(Hostile, LongTextIsRefused) {
  Observation observation = sample_observation(3);
  observation.source = std::string(1u << 17, 's');
  expect_refused(decode_observation(encode(observation)), ErrorCode::kProtocol,
                 "source: 131072 bytes");
}

TEST(Hostile, AnOversizedPayloadIsRefused) {
  const std::string payload(kMaxPayloadBytes + 1, '\0');
  expect_refused(decode_update(payload), ErrorCode::kProtocol, "must be at most 67108864");
}

}  // namespace
}  // namespace brainshift::wire
