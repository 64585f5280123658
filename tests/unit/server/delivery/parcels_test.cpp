// SPDX-License-Identifier: GPL-3.0-or-later
// What a viewer who chose a part of every field gets, and what is made of it how often.
#include "server/delivery/parcels.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <numeric>
#include <vector>

#include "tests/unit/server/delivery/small_updates.hpp"

namespace brainshift::server {
namespace {

SelectionPtr selection(FieldChoice choice, std::vector<NodeIndex> nodes, int mesh_nodes = 6) {
  return std::make_shared<const Selection>(
      Selection{std::move(choice), mesh_nodes, std::move(nodes)});
}
const std::vector<NodeIndex> kAll = {0, 1, 2, 3, 4, 5};

Parcel made(Parcels& parcels, const Bytes& whole, const SelectionPtr& chosen,
            const Held& held = {}) {
  const auto parcel = parcels.make(whole, chosen, held);
  EXPECT_TRUE(parcel);
  return parcel.value_or(Parcel{});
}

TEST(Parcels, WithoutAChoiceEverybodyGetsTheSameBytes) {
  Parcels parcels;
  const Bytes whole = frame_of(usable(1, 6));
  EXPECT_EQ(made(parcels, whole, nullptr).bytes, whole);
  EXPECT_EQ(made(parcels, whole, selection({.tolerance_mm = 0.1}, kAll)).bytes, whole)
      << "the first is whole";
  EXPECT_NE(made(parcels, whole, selection({.with_sd = false}, kAll)).bytes, whole);
}

TEST(Parcels, ARegionTravelsWithTheNamesOfItsNodes) {
  Parcels parcels;
  auto whole = usable(1, 6);
  whole.update.estimate.displacement(1, 4) = 7.5;
  const Parcel parcel = made(parcels, frame_of(whole), selection({}, {1, 4}));
  EXPECT_EQ(parcel.held, nullptr) << "nothing is held without a tolerance";
  const auto received = decoded(parcel.bytes);
  EXPECT_EQ(received.update.part, (FieldPart{6, {1, 4}, 0}));
  EXPECT_EQ(received.update.estimate.displacement(1, 1), 7.5);
  EXPECT_EQ(received.update.estimate.sd_mm.size(), 2);
  EXPECT_EQ(received.update.estimate.known, VecX::Ones(2));
  const auto bare =
      decoded(made(parcels, frame_of(whole), selection({.with_sd = false}, {1, 4})).bytes);
  EXPECT_EQ(bare.update.estimate.sd_mm.size(), 0);
  EXPECT_EQ(bare.update.estimate.known.size(), 0);
}

TEST(Parcels, NodesTravelAgainOnceTheyAreBeyondTheTolerance) {
  Parcels parcels;
  const auto chosen = selection({.tolerance_mm = 0.5}, kAll);
  auto message = usable(1, 6);
  Held held = made(parcels, frame_of(message), chosen).held;
  ASSERT_TRUE(held);
  // Node 2 creeps by 0.25 mm an update: beyond 0.5 mm of what is held at every third.
  std::vector<std::size_t> sent;
  for (std::uint64_t sequence = 2; sequence <= 7; ++sequence) {
    message.update.sequence = sequence;
    message.update.estimate.displacement(0, 2) += 0.25;
    parcels.begin_turn();
    const Parcel parcel = made(parcels, frame_of(message), chosen, held);
    const auto received = decoded(parcel.bytes);
    ASSERT_TRUE(received.update.part);
    EXPECT_EQ(received.update.part->base_sequence, sequence - 1);
    sent.push_back(received.update.part->nodes.size());
    held = parcel.held;
  }
  EXPECT_EQ(sent, (std::vector<std::size_t>{0, 0, 1, 0, 0, 1}));
}

TEST(Parcels, ADeviationThatChangesTravelsToo) {
  Parcels parcels;
  const auto chosen = selection({.tolerance_mm = 0.5}, kAll);
  auto message = usable(1, 6);
  const Held held = made(parcels, frame_of(message), chosen).held;
  message.update.sequence = 2;
  message.update.estimate.sd_mm[3] += 0.75;
  const auto received = decoded(made(parcels, frame_of(message), chosen, held).bytes);
  EXPECT_EQ(received.update.part, (FieldPart{6, {3}, 1}));

  message.update.sequence = 3;
  message.update.estimate.sd_mm.resize(0);
  const auto without = decoded(made(parcels, frame_of(message), chosen, held).bytes);
  EXPECT_EQ(without.update.part, std::nullopt) << "deviations that end travel with everything";
}

TEST(Parcels, WhatIsKnownTravelsOnceItChangesByMoreThanItsTolerance) {
  Parcels parcels;
  const auto chosen = selection({.tolerance_mm = 0.5}, kAll);
  auto message = usable(1, 6);
  Held held = made(parcels, frame_of(message), chosen).held;
  // Node 3 loses 0.03 an update: beyond 0.05 of what is held at every second.
  std::vector<std::size_t> sent;
  for (std::uint64_t sequence = 2; sequence <= 5; ++sequence) {
    message.update.sequence = sequence;
    message.update.estimate.known[3] -= 0.03;
    const Parcel parcel = made(parcels, frame_of(message), chosen, held);
    sent.push_back(decoded(parcel.bytes).update.part->nodes.size());
    held = parcel.held;
  }
  EXPECT_EQ(sent, (std::vector<std::size_t>{0, 1, 0, 1}));
  message.update.sequence = 6;
  message.update.estimate.known.resize(0);
  EXPECT_EQ(decoded(made(parcels, frame_of(message), chosen, held).bytes).update.part, std::nullopt)
      << "of an older prior: it ends with everything";
}

TEST(Parcels, MostOfTheChoiceTravelsAsAllOfIt) {
  Parcels parcels;
  const auto chosen = selection({.tolerance_mm = 0.5}, {0, 1, 2});
  auto message = usable(1, 6);
  const Held held = made(parcels, frame_of(message), chosen).held;
  message.update.sequence = 2;
  message.update.estimate.displacement.array() += 1.0;
  const auto received = decoded(made(parcels, frame_of(message), chosen, held).bytes);
  EXPECT_EQ(received.update.part, (FieldPart{6, {0, 1, 2}, 0}));
}

TEST(Parcels, NothingIsBuiltOnAnotherSessionOrALaterUpdate) {
  Parcels parcels;
  const auto chosen = selection({.tolerance_mm = 0.5}, kAll);
  const Held held = made(parcels, frame_of(usable(5, 6)), chosen).held;
  auto other = usable(6, 6);
  other.session_id = 2;
  EXPECT_EQ(decoded(made(parcels, frame_of(other), chosen, held).bytes).update.part, std::nullopt);
  EXPECT_EQ(decoded(made(parcels, frame_of(usable(5, 6)), chosen, held).bytes).update.part,
            std::nullopt);
}

TEST(Parcels, FailuresUnusableFieldsAndIteratesAreHeldByNobody) {
  Parcels parcels;
  const auto chosen = selection({.tolerance_mm = 0.5}, {1, 4});
  const Held held = made(parcels, frame_of(usable(1, 6)), chosen).held;
  const Bytes failed = frame_of(failure(2));
  EXPECT_EQ(made(parcels, failed, chosen, held).bytes, failed);
  auto unusable = usable(2, 6);
  unusable.update.estimate.quality.flags.set(QualityFlag::kInvertedElements);
  unusable.update.estimate.quality.quality = Quality::kUnusable;
  auto iterate = usable(3, 6);
  iterate.update.final = false;
  iterate.update.estimate.quality = {};
  for (const auto& message : {unusable, iterate}) {
    const Parcel parcel = made(parcels, frame_of(message), chosen, held);
    EXPECT_EQ(parcel.held, nullptr) << "the viewer goes on with what it held";
    EXPECT_EQ(decoded(parcel.bytes).update.part, (FieldPart{6, {1, 4}, 0}));
  }
}

TEST(Parcels, AFieldOfAnotherMeshTravelsWhole) {
  Parcels parcels;
  const Bytes whole = frame_of(usable(1, 5));
  EXPECT_EQ(made(parcels, whole, selection({}, {1, 4}, 6)).bytes, whole);
}

TEST(Parcels, AreMadeOnceForEqualChoicesAndABoundedNumberInATurn) {
  Parcels parcels;
  const Bytes whole = frame_of(usable(1, 6));
  const auto shared = selection({}, {1, 4});
  const Bytes first = made(parcels, whole, shared).bytes;
  for (int viewer = 0; viewer < 100; ++viewer) EXPECT_EQ(made(parcels, whole, shared).bytes, first);
  EXPECT_FALSE(parcels.spent());
  for (int other = 1; other < Parcels::kMakesPerTurn; ++other) {
    EXPECT_TRUE(parcels.make(whole, selection({}, {other % 6}), {}));
  }
  EXPECT_TRUE(parcels.spent());
  const auto late = selection({}, {0, 5});
  EXPECT_EQ(parcels.make(whole, late, {}), std::nullopt);
  EXPECT_EQ(made(parcels, whole, shared).bytes, first) << "what is made costs nothing";
  parcels.begin_turn();
  EXPECT_TRUE(parcels.make(whole, late, {}));
}

// Two viewers that hold the same share changes; a third that missed one has its own, until it gets
// the whole choice.
TEST(Parcels, ChangesAreSharedByThoseWhoHoldTheSame) {
  Parcels parcels;
  const auto chosen = selection({.tolerance_mm = 0.1}, kAll);
  const Held held = made(parcels, frame_of(usable(1, 6)), chosen).held;
  auto second = usable(2, 6);
  second.update.estimate.displacement(0, 0) += 1.0;
  const Held newer = made(parcels, frame_of(second), chosen, held).held;
  auto third = second;
  third.update.sequence = 3;
  third.update.estimate.displacement(0, 5) += 1.0;
  const Bytes whole = frame_of(third);
  const Parcel one = made(parcels, whole, chosen, newer);
  EXPECT_EQ(made(parcels, whole, chosen, newer).bytes, one.bytes);
  const Parcel behind = made(parcels, whole, chosen, held);
  EXPECT_EQ(decoded(one.bytes).update.part, (FieldPart{6, {5}, 2}));
  EXPECT_EQ(decoded(behind.bytes).update.part, (FieldPart{6, {0, 5}, 1}));
  EXPECT_EQ(behind.held->xyz_mm, one.held->xyz_mm);
}

TEST(Parcels, WhatIsKeptIsBoundedAndGoesWithItsViewer) {
  Parcels parcels;
  const Bytes whole = frame_of(usable(1, 6));
  const auto one = selection({.tolerance_mm = 0.5}, kAll);
  const Parcel parcel = made(parcels, whole, one);
  const std::size_t each = parcels.bytes_kept();
  EXPECT_GE(each, parcel.bytes->size());
  for (int i = 0; i < 1000; ++i) {  // choices of a viewer that changes its mind
    parcels.begin_turn();
    made(parcels, whole, selection({.tolerance_mm = 0.5 + i}, kAll));
  }
  parcels.begin_turn();
  EXPECT_EQ(parcels.bytes_kept(), each) << "the viewer that stayed";
  EXPECT_EQ(made(parcels, whole, one).held, parcel.held) << "still made once";
}

TEST(Parcels, ViewersThatStayHaveABoundTogether) {
  Parcels parcels;
  constexpr int kMany = 50'000;
  const Bytes whole = frame_of(usable(1, kMany));
  std::vector<NodeIndex> all(kMany);
  std::iota(all.begin(), all.end(), 0);
  std::vector<SelectionPtr> choices;
  for (int i = 0; i < 40; ++i) {
    parcels.begin_turn();
    choices.push_back(selection({.tolerance_mm = 0.5 + i}, all, kMany));
    made(parcels, whole, choices.back());
    EXPECT_LE(parcels.bytes_kept(), Parcels::kBytesKept);
  }
  EXPECT_GT(parcels.bytes_kept(), Parcels::kBytesKept / 2);
}

}  // namespace
}  // namespace brainshift::server
