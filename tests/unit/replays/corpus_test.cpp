// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "common/wire/convert.hpp"
#include "tests/benchmarks/csv_table.hpp"
#include "tests/replays/corpus.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::replays {
namespace {

// As the twin makes them: two moments of three instruments, two seconds apart.
client::SimulatedSurgery two_moments() {
  client::SimulatedSurgery surgery;
  for (int i = 0; i < 6; ++i) {
    Observation observation;
    observation.case_id = "c";
    observation.source = i % 3 == 0 ? "ius" : i % 3 == 1 ? "stereopsis" : "tracks";
    observation.sequence = static_cast<std::uint64_t>(i) + 1;
    observation.acquired_ns = 300'000'000'000 * (i / 3) + 2'000'000'000L * (i % 3);
    observation.body = TumourBoundary{Points::Constant(3, 4, i), 0.5};
    surgery.observations.push_back(observation);
  }
  return surgery;
}

TEST(Corpus, IsFiveSurgeriesWhoseMomentsAllDiffer) {
  ASSERT_EQ(corpus().size(), 5u);
  std::set<std::string> names;
  for (const CorpusSurgery& one : corpus()) {
    names.insert(one.name);
    const auto& levels = one.scenario.fluid_levels_mm;
    EXPECT_EQ(std::set<double>(levels.begin(), levels.end()).size(), levels.size()) << one.name;
    const std::size_t instruments = one.scenario.cortex ? 3 : 1;
    EXPECT_GE(levels.size() * instruments, 12u) << one.name;
    EXPECT_LE(levels.size() * instruments, 20u) << one.name;
  }
  EXPECT_EQ(names.size(), 5u);
}

TEST(Corpus, LeavesTheScenariosOfTheTwinAsTheyAre) {
  (void)corpus();
  EXPECT_EQ(client::find_scenario("joint-mixed")->fluid_levels_mm, std::vector<double>{30.0});
}

TEST(Corpus, IsRecordedInTimeLapseAndAcquiredAsTheScenarioSays) {
  const auto surgery = two_moments();
  const auto recording = record(surgery, 2);
  ASSERT_EQ(recording.size(), 6u);
  const std::int64_t expected_ms[] = {0, 250, 500, 2250, 2500, 2750};
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(recording[i].recorded_ns, 1'000'000 * expected_ms[i]);
    EXPECT_EQ(recording[i].observation.acquired_ns, surgery.observations[i].acquired_ns);
  }
}

TEST(Corpus, ReadsWhatItWrote) {
  const test_support::TemporaryFolder folder;
  const auto recording = record(two_moments(), 2);
  io::SurgeryMeta meta;
  meta.case_id = "c";
  meta.model_id = "m";
  meta.seed = 7;
  ASSERT_TRUE(write_recording(folder / "one.surgery", meta, recording));
  const auto read = value_or_fail(read_recording(folder / "one.surgery"));
  EXPECT_EQ(read.meta, meta);
  ASSERT_EQ(read.observations.size(), recording.size());
  for (std::size_t i = 0; i < recording.size(); ++i) {
    EXPECT_EQ(read.observations[i].recorded_ns, recording[i].recorded_ns);
    EXPECT_EQ(wire::encode(read.observations[i].observation),
              wire::encode(recording[i].observation));
  }
}

TEST(Corpus, RefusesAFileThatExistsAndOneWithoutObservations) {
  const test_support::TemporaryFolder folder;
  io::SurgeryMeta meta;
  meta.case_id = "c";
  ASSERT_TRUE(write_recording(folder / "one.surgery", meta, record(two_moments(), 2)));
  refusal_of(write_recording(folder / "one.surgery", meta, {}), ErrorCode::kWriteFailed);
  EXPECT_TRUE(read_recording(folder / "one.surgery")) << "the first is still there";

  EXPECT_EQ(read_recording(folder / "none.surgery").error().code, ErrorCode::kNotFound);
  ASSERT_TRUE(write_recording(folder / "empty.surgery", meta, {}));
  EXPECT_EQ(read_recording(folder / "empty.surgery").error().code, ErrorCode::kEmptySet);
}

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
  const auto table = value_or_fail(bench::CsvTable::read(folder / "m.csv"));
  EXPECT_EQ(table.text(0, "surgery"), "sag");
  EXPECT_EQ(table.number(0, "seed"), 9.0);
  EXPECT_EQ(table.text(0, "recorded_ns"), "750000000");
  EXPECT_EQ(table.text(0, "acquired_ns"), "30000000000");
  EXPECT_NEAR(table.number(0, "mean_mm"), 22.0 / 6.0, 1e-11);
}

}  // namespace

}  // namespace brainshift::replays
