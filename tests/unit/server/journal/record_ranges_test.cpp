// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/journal/record_ranges.hpp"

#include <gtest/gtest.h>

namespace brainshift::server {
namespace {

using io::RecordKind;

TEST(RecordRanges, SourcesAndUpdatesAreCountedApart) {
  RecordRanges ranges;
  EXPECT_TRUE(ranges.empty());
  EXPECT_EQ(describe(ranges), "nothing");
  for (const std::uint64_t i : {5u, 6u, 9u}) ranges.add(RecordKind::kObservation, "ius", i);
  ranges.add(RecordKind::kObservation, "camera", 50);
  ranges.add(RecordKind::kUpdate, "", 3);
  ranges.add(RecordKind::kDecision, "", 7);
  EXPECT_FALSE(ranges.empty());
  EXPECT_EQ(ranges.observations.at("ius"), (SequenceRange{5, 9, 3}));
  EXPECT_EQ(ranges.updates, (SequenceRange{3, 3, 1}));
  EXPECT_EQ(describe(ranges),
            "observations 50 of camera (1), observations 5 to 9 of ius (3), updates 3 (1)");
}

TEST(RecordRanges, TheUnionSpansBoth) {
  RecordRanges a, b;
  a.add(RecordKind::kObservation, "ius", 7);
  b.add(RecordKind::kObservation, "ius", 4);
  b.add(RecordKind::kObservation, "camera", 1);
  b.add(RecordKind::kUpdate, "", 2);
  a.add(b);
  EXPECT_EQ(a.observations.at("ius"), (SequenceRange{4, 7, 2}));
  EXPECT_EQ(a.observations.at("camera"), (SequenceRange{1, 1, 1}));
  EXPECT_EQ(a.updates, (SequenceRange{2, 2, 1}));
  a.add(RecordRanges{});
  EXPECT_EQ(a.updates, (SequenceRange{2, 2, 1}));
}

}  // namespace
}  // namespace brainshift::server
