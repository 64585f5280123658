// SPDX-License-Identifier: Apache-2.0
// Changes go into the update that they name, or nowhere.
#include "client/lib/field_assembly.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <vector>

namespace brainshift::client {
namespace {

using Outcome = FieldAssembly::Outcome;

const SessionKey kSession{7, 1, "model"};

// Every column of the displacement holds the value, every deviation a tenth of it.
UpdateMessage assembled_update(std::uint64_t sequence, double value, int columns,
                               std::optional<FieldPart> part = std::nullopt) {
  UpdateMessage message;
  message.session_id = kSession.session_id;
  message.boot_id = kSession.boot_id;
  message.update.model_id = kSession.model_id;
  message.update.sequence = sequence;
  message.update.estimate.quality.quality = Quality::kGood;
  message.update.estimate.displacement = Points::Constant(3, columns, value);
  message.update.estimate.sd_mm = VecX::Constant(columns, 0.1 * value);
  message.update.part = std::move(part);
  return message;
}

UpdateMessage changes(std::uint64_t sequence, double value, std::vector<NodeIndex> nodes,
                      std::uint64_t base) {
  const int columns = static_cast<int>(nodes.size());
  return assembled_update(sequence, value, columns, FieldPart{10, std::move(nodes), base});
}

FieldAssembly assembly() {
  FieldAssembly assembly;
  assembly.begin({.tolerance_mm = 0.1});
  return assembly;
}

// Holding update 4 of nodes 2, 3, 5 and 8, all of them 1.
FieldAssembly holding_a_part() {
  FieldAssembly held = assembly();
  auto first = assembled_update(4, 1.0, 4, FieldPart{10, {2, 3, 5, 8}, 0});
  EXPECT_EQ(held.complete(first), Outcome::kWhole);
  return held;
}

TEST(FieldAssembly, ChangesComeOutAsTheWholeChoice) {
  FieldAssembly held = holding_a_part();
  auto message = changes(6, 2.0, {3, 8}, 4);
  ASSERT_EQ(held.complete(message), Outcome::kWhole);
  EXPECT_EQ(message.update.part, (FieldPart{10, {2, 3, 5, 8}, 0}));
  EXPECT_EQ(message.update.estimate.displacement.row(2), Eigen::RowVector4d(1, 2, 1, 2));
  EXPECT_EQ(message.update.estimate.sd_mm, Eigen::Vector4d(0.1, 0.2, 0.1, 0.2));

  auto none = changes(7, 0.0, {}, 6);
  ASSERT_EQ(held.complete(none), Outcome::kWhole);
  EXPECT_EQ(none.update.estimate.displacement.row(0), Eigen::RowVector4d(1, 2, 1, 2));
  EXPECT_EQ(none.update.estimate.sd_mm, Eigen::Vector4d(0.1, 0.2, 0.1, 0.2));
}

TEST(FieldAssembly, ChangesOfTheWholeBrainNameNoPart) {
  FieldAssembly held = assembly();
  auto first = assembled_update(1, 1.0, 10);
  ASSERT_EQ(held.complete(first), Outcome::kWhole);
  auto message = changes(2, 2.0, {9}, 1);
  ASSERT_EQ(held.complete(message), Outcome::kWhole);
  EXPECT_EQ(message.update.part, std::nullopt);
  EXPECT_EQ(message.update.estimate.displacement.cols(), 10);
  EXPECT_EQ(message.update.estimate.displacement(0, 8), 1.0);
  EXPECT_EQ(message.update.estimate.displacement(0, 9), 2.0);
}

TEST(FieldAssembly, WhatDoesNotFitIsLostAndChangesNothing) {
  using Damage = std::function<void(UpdateMessage&)>;
  const std::vector<std::pair<const char*, Damage>> damages = {
      {"another base", [](auto& m) { m.update.part->base_sequence = 3; }},
      {"another daemon", [](auto& m) { m.boot_id = 8; }},
      {"another session", [](auto& m) { m.session_id = 2; }},
      {"another model", [](auto& m) { m.update.model_id = "other"; }},
      {"another mesh", [](auto& m) { m.update.part->mesh_nodes = 11; }},
      {"a node between the chosen",
       [](auto& m) {
         m.update.part->nodes = {3, 4};
       }},
      {"a node behind the chosen",
       [](auto& m) {
         m.update.part->nodes = {3, 9};
       }},
      {"no deviations", [](auto& m) { m.update.estimate.sd_mm.resize(0); }},
  };
  for (const auto& [name, damage] : damages) {
    FieldAssembly held = holding_a_part();
    auto message = changes(6, 2.0, {3, 8}, 4);
    damage(message);
    EXPECT_EQ(held.complete(message), Outcome::kLost) << name;
    auto good = changes(6, 2.0, {3, 8}, 4);
    EXPECT_EQ(held.complete(good), Outcome::kDropped) << name << ": nothing is held any more";
  }
}

TEST(FieldAssembly, ChangesAreDroppedUntilTheWholeChoiceComes) {
  FieldAssembly held = holding_a_part();
  held.forget();
  auto under_way = changes(5, 2.0, {3}, 4);
  EXPECT_EQ(held.complete(under_way), Outcome::kDropped) << "asking anew was due before";
  auto whole = assembled_update(6, 3.0, 4, FieldPart{10, {2, 3, 5, 8}, 0});
  EXPECT_EQ(held.complete(whole), Outcome::kWhole);
  auto next = changes(7, 4.0, {2}, 6);
  ASSERT_EQ(held.complete(next), Outcome::kWhole);
  EXPECT_EQ(next.update.estimate.displacement.row(0), Eigen::RowVector4d(4, 3, 3, 3));
}

TEST(FieldAssembly, NothingIsBuiltOnFailuresIteratesAndUnusableFields) {
  FieldAssembly held = holding_a_part();
  auto failure = assembled_update(5, 9.0, 4, FieldPart{10, {2, 3, 5, 8}, 0});
  failure.error = Error{ErrorCode::kEmptySet, "no point"};
  auto iterate = assembled_update(5, 9.0, 4, FieldPart{10, {2, 3, 5, 8}, 0});
  iterate.update.final = false;
  auto unusable = assembled_update(5, 9.0, 4, FieldPart{10, {2, 3, 5, 8}, 0});
  unusable.update.estimate.quality.quality = Quality::kUnusable;
  for (auto* message : {&failure, &iterate, &unusable}) {
    EXPECT_EQ(held.complete(*message), Outcome::kWhole) << "it is handed out as it is";
    EXPECT_EQ(message->update.estimate.displacement(0, 0), 9.0);
  }
  auto good = changes(6, 2.0, {3}, 4);
  ASSERT_EQ(held.complete(good), Outcome::kWhole);
  EXPECT_EQ(good.update.estimate.displacement.row(0), Eigen::RowVector4d(1, 2, 1, 1));
}

TEST(FieldAssembly, AnotherChoiceForgetsAndWithoutAToleranceNothingIsHeld) {
  FieldAssembly held = holding_a_part();
  held.begin({.tolerance_mm = 0.2});
  auto message = changes(6, 2.0, {3}, 4);
  EXPECT_EQ(held.complete(message), Outcome::kLost);
  held.begin({});
  auto whole = assembled_update(1, 1.0, 10);
  EXPECT_EQ(held.complete(whole), Outcome::kWhole);
  auto unasked = changes(2, 2.0, {3}, 1);
  EXPECT_EQ(held.complete(unasked), Outcome::kLost);
}

}  // namespace
}  // namespace brainshift::client
