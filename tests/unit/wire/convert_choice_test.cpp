// SPDX-License-Identifier: Apache-2.0
// A viewer's choice on the wire, and the nodes of an update that carries a part of its field.
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "brainshift/v1/brainshift.pb.h"
#include "tests/support/results.hpp"
#include "tests/unit/wire/refusals.hpp"
#include "tests/unit/wire/same_values.hpp"
#include "tests/unit/wire/sample_values.hpp"

namespace brainshift::wire {
namespace {

namespace pb = brainshift::v1;

// The sample's four columns as nodes 1, 2, 7 and 99 of a hundred; the sample holds slaves 3 and 0.
UpdateMessage sample_part(std::uint64_t base = 0) {
  UpdateMessage message = sample_judged_update();
  message.update.sequence = 8;
  message.update.estimate.quality = {};
  message.update.estimate.quality.quality = Quality::kGood;
  message.update.part = FieldPart{100, {1, 2, 7, 99}, base};
  return message;
}

Result<UpdateMessage> decode_changed_choice(const std::function<void(pb::Update&)>& change) {
  return decode_update(changed<pb::Update>(encode(sample_part(7)), change));
}

Result<Subscription> decode_choice(const std::function<void(pb::FieldChoice&)>& change) {
  pb::SubscribeRequest request;
  change(*request.mutable_choice());
  return decode_subscription(request.SerializeAsString());
}

TEST(FieldChoiceOnTheWire, EveryChoiceComesBackAsItWas) {
  for (const Region& region :
       {Region{WholeBrain{}}, Region{BallRegion{Vec3(-0.1, 1.0 / 3.0, 99.0), 40.5}},
        Region{TumourRegion{0.0}}, Region{TumourRegion{40.0}}}) {
    for (const bool with_sd : {true, false}) {
      const Subscription sent{7, 2, 3, {region, 10.1, 0.1, with_sd}};
      EXPECT_EQ(decode_subscription(encode(sent)).value(), sent);
    }
  }
}

TEST(FieldChoiceOnTheWire, TheDefaultChoiceTakesNoBytes) {
  EXPECT_EQ(encode(Subscription{1, 1, 0, FieldChoice{}}), encode(Subscription{1, 1, 0}));
  EXPECT_EQ(encode(Subscription{1, 1, 0}).size(), 4u);
}

TEST(FieldChoiceOnTheWire, ABadChoiceIsRefusedNamingTheLength) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  expect_refused(decode_choice([](auto& m) { m.mutable_ball()->set_radius_mm(4.0); }),
                 ErrorCode::kProtocol, "choice.ball.centre_mm: 0 numbers, must be 3");
  expect_refused(decode_choice([](auto& m) {
                   for (int i = 0; i < 4; ++i) m.mutable_ball()->add_centre_mm(0.0);
                 }),
                 ErrorCode::kProtocol, "choice.ball.centre_mm: 4 numbers, must be 3");
  expect_refused(decode_choice([](auto& m) {
                   for (int i = 0; i < 3; ++i) m.mutable_ball()->add_centre_mm(0.0);
                   m.mutable_ball()->set_radius_mm(-1.0);
                 }),
                 ErrorCode::kInvalidArgument, "choice.ball.radius_mm = -1");
  expect_refused(decode_choice([](auto& m) { m.mutable_tumour()->set_margin_mm(kNaN); }),
                 ErrorCode::kNotFinite, "choice.tumour.margin_mm");
  expect_refused(decode_choice([](auto& m) { m.set_spacing_mm(-0.5); }),
                 ErrorCode::kInvalidArgument, "choice.spacing_mm = -0.5");
  expect_refused(decode_choice([](auto& m) { m.set_tolerance_mm(1e300); }),
                 ErrorCode::kInvalidArgument, "choice.tolerance_mm = 1e+300");
}

TEST(FieldPartOnTheWire, ComesBackAsItWas) {
  for (const std::uint64_t base : {0u, 7u}) {
    const UpdateMessage sent = sample_part(base);
    const auto received = value_or_fail(decode_update(encode(sent)));
    expect_same(received, sent);
  }
}

TEST(FieldPartOnTheWire, ChangesMayHoldNoNode) {
  UpdateMessage sent = sample_part(7);
  sent.update.part->nodes.clear();
  sent.update.estimate.displacement.resize(3, 0);
  sent.update.estimate.sd_mm.resize(0);
  sent.update.estimate.known.resize(0);
  const auto received = value_or_fail(decode_update(encode(sent)));
  EXPECT_EQ(received.update.part, sent.update.part);
}

TEST(FieldPartOnTheWire, NodesThatAreNotOnesOfTheMeshInOrderAreRefused) {
  const auto expect = [](const char* sentence, const std::function<void(pb::FieldPart&)>& change) {
    expect_refused(decode_changed_choice([&](auto& m) { change(*m.mutable_part()); }),
                   ErrorCode::kProtocol, sentence);
  };
  expect("update.part.node_steps: node 2 twice", [](auto& m) { m.set_node_steps(2, 0); });
  expect("update.part.node_steps: node 100, must be in [0, 100)",
         [](auto& m) { m.set_node_steps(3, 93); });
  // A step back in 32 bits is a step out of the mesh.
  expect("must be in [0, 100)", [](auto& m) { m.set_node_steps(1, 0xffffffffu); });
  expect("update.part.node_steps: 5 nodes for 4 displacements", [](auto& m) {
    m.set_node_steps(3, 10);
    m.add_node_steps(1);
  });
  expect("update.part.node_steps: 0 nodes for 4 displacements",
         [](auto& m) { m.clear_node_steps(); });
  expect("update.part.mesh_nodes: 0, must be in", [](auto& m) { m.set_mesh_nodes(0); });
  expect("update.part.mesh_nodes: 4294967295, must be in",
         [](auto& m) { m.set_mesh_nodes(0xffffffffu); });
}

TEST(FieldPartOnTheWire, SlavesAreNodesOfTheMeshAndNotOfThePart) {
  EXPECT_TRUE(
      decode_changed_choice([](auto& m) { m.mutable_contact()->set_active_slaves(0, 99); }));
  expect_refused(
      decode_changed_choice([](auto& m) { m.mutable_contact()->set_active_slaves(0, 100); }),
      ErrorCode::kProtocol, "update.contact.active_slaves: index 100");
}

TEST(FieldPartOnTheWire, ABaseIsAnEarlierUpdateOfAUsableOne) {
  expect_refused(decode_changed_choice([](auto& m) { m.mutable_part()->set_base_sequence(8); }),
                 ErrorCode::kProtocol, "update.part.base_sequence: is not below");
  expect_refused(decode_changed_choice([](auto& m) { m.set_final(false); }), ErrorCode::kProtocol,
                 "update.part.base_sequence: is present although the update is not final");
  expect_refused(decode_changed_choice([](auto& m) {
                   m.set_quality(pb::QUALITY_UNUSABLE);
                   m.add_quality_flags(pb::QUALITY_FLAG_INVERTED_ELEMENTS);
                 }),
                 ErrorCode::kProtocol,
                 "update.part.base_sequence: is present although the update is not usable");
  expect_refused(decode_changed_choice([](auto& m) {
                   m.mutable_part()->clear_base_sequence();
                   m.mutable_part()->clear_node_steps();
                   m.clear_displacement();
                   m.clear_sd_mm();
                 }),
                 ErrorCode::kProtocol, "update.part.node_steps: no node");
}

TEST(FieldPartOnTheWire, AFailureAndAMissingDeviationAreRefused) {
  expect_refused(decode_changed_choice([](auto& m) {
                   m.set_status("failed");
                   m.set_error_code("internal");
                   m.clear_displacement();
                   m.clear_quality();
                 }),
                 ErrorCode::kProtocol, "update.part: is present although");
  expect_refused(decode_changed_choice([](auto& m) { m.mutable_sd_mm()->RemoveLast(); }),
                 ErrorCode::kProtocol, "update.sd_mm: 3 values");
}

}  // namespace
}  // namespace brainshift::wire
