// SPDX-License-Identifier: Apache-2.0
#include "client/lib/received_updates.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <vector>

namespace brainshift::client {
namespace {

using Outcome = FieldAssembly::Outcome;

// ---------- those that wait ----------

UpdateMessage queued_update(std::uint64_t sequence, bool final) {
  UpdateMessage message;
  message.update.sequence = sequence;
  message.update.final = final;
  return message;
}

std::vector<std::uint64_t> drain(UpdateQueue& queue) {
  std::vector<std::uint64_t> sequences;
  while (auto entry = queue.pop()) sequences.push_back(*entry ? (*entry)->update.sequence : 0);
  return sequences;
}

TEST(UpdateQueue, KeepsTheOrderOfArrival) {
  UpdateQueue queue(10);
  for (std::uint64_t i = 1; i <= 5; ++i) queue.push(queued_update(i, i % 2 == 0));
  EXPECT_EQ(drain(queue), (std::vector<std::uint64_t>{1, 2, 3, 4, 5}));
}

TEST(UpdateQueue, WhenFullTheOldestIterateGivesWay) {
  UpdateQueue queue(3);
  queue.push(queued_update(1, true));
  queue.push(queued_update(2, false));
  queue.push(queued_update(3, false));
  queue.push(queued_update(4, false));
  EXPECT_EQ(queue.size(), 3u);
  EXPECT_EQ(drain(queue), (std::vector<std::uint64_t>{1, 3, 4}));
}

TEST(UpdateQueue, FinalUpdatesAndErrorsAreNeverDropped) {
  UpdateQueue queue(2);
  queue.push(queued_update(1, true));
  queue.push(fail(ErrorCode::kProtocol, "bad"));
  auto failed = queued_update(3, false);
  failed.error = Error{ErrorCode::kEmptySet, "no point"};
  queue.push(failed);
  queue.push(queued_update(4, true));
  queue.push(queued_update(5, false));  // the only one that may go
  EXPECT_EQ(drain(queue), (std::vector<std::uint64_t>{1, 0, 3, 4}));
}

TEST(UpdateQueue, WhatTheDaemonHasNewerIsDropped) {
  UpdateQueue queue(10);
  const auto usable = [](std::uint64_t sequence, std::uint64_t session) {
    UpdateMessage message = queued_update(sequence, true);
    message.session_id = session;
    message.update.estimate.quality.quality = Quality::kGood;
    return message;
  };
  UpdateMessage failure = queued_update(4, true);
  failure.session_id = 2;
  failure.error = Error{ErrorCode::kEmptySet, "no point"};
  UpdateMessage last = failure;
  last.update.sequence = 5;
  for (const auto& message : {usable(9, 1), usable(2, 2), usable(3, 2), failure, last}) {
    queue.push(message);
  }
  queue.push(fail(ErrorCode::kProtocol, "bad"));
  SessionState state;
  state.session = {0, 2, ""};
  state.newest_usable = 3;
  state.newest_update = 5;
  queue.drop_older_than(state);
  EXPECT_EQ(drain(queue), (std::vector<std::uint64_t>{3, 5, 0}));
}

TEST(UpdateQueue, IteratesAloneNeverExceedTheCapacity) {
  UpdateQueue queue(4);
  for (std::uint64_t i = 1; i <= 1000; ++i) {
    queue.push(queued_update(i, false));
    EXPECT_LE(queue.size(), 4u);
  }
  EXPECT_EQ(drain(queue), (std::vector<std::uint64_t>{997, 998, 999, 1000}));
}

// ---------- changes go into the update that they name, or nowhere ----------

const SessionKey kSession{7, 1, "model"};

// Every column of the displacement holds the value, every deviation a tenth of it, and a quarter is
// known.
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
  message.update.estimate.known = VecX::Constant(columns, 0.25 * value);
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
  EXPECT_EQ(message.update.estimate.known, Eigen::Vector4d(0.25, 0.5, 0.25, 0.5));

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
      {"nothing known", [](auto& m) { m.update.estimate.known.resize(0); }},
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

// ---------- the one to show ----------

SessionKey key(std::uint64_t session, std::uint64_t boot = 1) { return {boot, session, "m"}; }

UpdateMessage update(std::uint64_t session, std::uint64_t sequence,
                     Quality quality = Quality::kGood, bool final = true) {
  UpdateMessage message;
  message.session_id = session;
  message.boot_id = 1;
  message.update.model_id = "m";
  message.update.sequence = sequence;
  message.update.final = final;
  message.update.estimate.quality.quality = quality;
  return message;
}

std::uint64_t sequence_of(const LatestUsable& latest) {
  return latest.get() ? latest.get()->update.sequence : 0;
}

TEST(LatestUsable, IsEmptyUntilAUsableUpdateComes) {
  LatestUsable latest;
  EXPECT_FALSE(latest.get());
  latest.take(update(1, 1, Quality::kUnusable));
  EXPECT_FALSE(latest.get());
  latest.take(update(1, 2, Quality::kCaution));
  EXPECT_EQ(sequence_of(latest), 2u);
}

TEST(LatestUsable, OnlyAnotherUsableUpdateReplacesIt) {
  LatestUsable latest;
  latest.take(update(1, 1));
  latest.take(update(1, 2, Quality::kUnusable));
  latest.take(update(1, 3, Quality::kNotJudged));
  latest.take(update(1, 4, Quality::kGood, false));
  auto failed = update(1, 5);
  failed.error = Error{ErrorCode::kEmptySet, "no point"};
  latest.take(failed);
  EXPECT_EQ(sequence_of(latest), 1u);
  latest.take(update(1, 6));
  EXPECT_EQ(sequence_of(latest), 6u);
}

TEST(LatestUsable, OfAnotherSessionIsForgottenAndDoesNotComeBack) {
  LatestUsable latest;
  latest.begin(key(4));
  latest.take(update(4, 9));
  latest.take(update(5, 1, Quality::kUnusable));  // another client has started session 5
  EXPECT_FALSE(latest.get());
  latest.take(update(4, 10));
  EXPECT_FALSE(latest.get());
  latest.take(update(5, 2));
  EXPECT_EQ(sequence_of(latest), 2u);
}

// Session numbers of a restarted daemon begin again.
TEST(LatestUsable, BeginForgetsWhateverTheNumber) {
  LatestUsable latest;
  latest.begin(key(7));
  latest.take(update(7, 3));
  latest.follow(key(7));  // subscribed again
  EXPECT_EQ(sequence_of(latest), 3u);
  latest.begin(key(7));
  EXPECT_FALSE(latest.get());
  latest.take(update(7, 4));
  latest.follow(key(1));
  EXPECT_FALSE(latest.get());
  latest.take(update(1, 1));
  EXPECT_EQ(sequence_of(latest), 1u);
}

TEST(LatestUsable, OfAnotherDaemonIsNotTakenUntilThatOneIsFollowed) {
  LatestUsable latest;
  latest.begin(key(1));
  latest.take(update(1, 1));
  auto foreign = update(9, 1);
  foreign.boot_id = 2;
  EXPECT_FALSE(latest.belongs(foreign.key()));
  latest.take(foreign);
  EXPECT_EQ(latest.get()->boot_id, 1u);
  latest.follow(key(9, 2));
  EXPECT_FALSE(latest.get());
  latest.take(foreign);
  EXPECT_EQ(latest.get()->boot_id, 2u);
}

}  // namespace
}  // namespace brainshift::client
