// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/replays/manifest.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/benchmarks/csv_table.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::replays {
namespace {

client::RecordedObservation boundary(std::uint64_t sequence, const Points& points) {
  client::RecordedObservation recorded;
  recorded.recorded_ns = 750'000'000 * static_cast<std::int64_t>(sequence);
  recorded.observation.case_id = "c";
  recorded.observation.source = "ius";
  recorded.observation.sequence = sequence;
  recorded.observation.acquired_ns = 30'000'000'000 * static_cast<std::int64_t>(sequence);
  recorded.observation.body = TumourBoundary{points, 0.5};
  return recorded;
}

Points some_points() {
  Points points(3, 2);
  points << 1, 4,  //
      2, 5,        //
      3, 7;
  return points;
}

TEST(Manifest, SumsEveryCoordinateInItsPlace) {
  const ManifestEntry entry = entry_of("sag", 9, boundary(2, some_points()));
  EXPECT_EQ(entry.coordinates, 6u);
  EXPECT_NEAR(entry.mean_mm, 22.0 / 6.0, 1e-12);
  EXPECT_NEAR(entry.ordered_mm,
              (std::cos(1.0) * 1 + std::cos(2.0) * 2 + std::cos(3.0) * 3 + std::cos(4.0) * 4 +
               std::cos(5.0) * 5 + std::cos(6.0) * 7) /
                  6.0,
              1e-12);
  EXPECT_NE(entry.ordered_mm, 0.0);
}

TEST(Manifest, SeesBothEndsOfLandmarkPairsAndAllOfASurface) {
  auto recorded = boundary(1, some_points());
  recorded.observation.body = LandmarkPairs{some_points(), 2.0 * some_points(), 0.5};
  EXPECT_EQ(entry_of("s", 1, recorded).coordinates, 12u);
  EXPECT_NEAR(entry_of("s", 1, recorded).mean_mm, 66.0 / 12.0, 1e-12);
  recorded.observation.body = CorticalSurface{{some_points(), {}}, 0.5};
  EXPECT_EQ(entry_of("s", 1, recorded).coordinates, 6u);
  recorded.observation.body = PatientPose{};
  EXPECT_EQ(entry_of("s", 1, recorded).coordinates, 0u);
}

// By 1e-6 mm tests/studies/replays.py tells them apart.
TEST(Manifest, RoundingHardlyChangesTheSumsAndTwoInterchangedPointsDo) {
  const ManifestEntry entry = entry_of("sag", 9, boundary(1, some_points()));
  const ManifestEntry rounded =
      entry_of("sag", 9, boundary(1, Points(some_points().array() + 1e-9)));
  EXPECT_NEAR(rounded.mean_mm, entry.mean_mm, 1e-8);
  EXPECT_NEAR(rounded.ordered_mm, entry.ordered_mm, 1e-8);
  EXPECT_NE(rounded.crc32, entry.crc32);
  Points turned = some_points();
  turned.col(0).swap(turned.col(1));
  EXPECT_GT(std::abs(entry_of("sag", 9, boundary(1, turned)).ordered_mm - entry.ordered_mm), 1e-3);
}

TEST(Manifest, WritesWhatTheComparisonReads) {
  const test_support::TemporaryFolder folder;
  ASSERT_TRUE(write_manifest(folder / "m.csv", {entry_of("sag", 9, boundary(1, some_points()))}));
  const auto table = bench::CsvTable::read(folder / "m.csv");
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_EQ(table->text(0, "surgery"), "sag");
  EXPECT_EQ(table->number(0, "seed"), 9.0);
  EXPECT_EQ(table->text(0, "recorded_ns"), "750000000");
  EXPECT_EQ(table->text(0, "acquired_ns"), "30000000000");
  EXPECT_NEAR(table->number(0, "mean_mm"), 22.0 / 6.0, 1e-11);
}

}  // namespace
}  // namespace brainshift::replays
