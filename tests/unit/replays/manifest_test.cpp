// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/replays/manifest.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/temporary_folder.hpp"

namespace brainshift::replays {
namespace {

using testing::HasSubstr;

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

std::vector<ManifestEntry> three() {
  std::vector<ManifestEntry> entries;
  for (std::uint64_t s = 1; s <= 3; ++s) {
    entries.push_back(entry_of("sag", 9, boundary(s, some_points() * double(s))));
  }
  return entries;
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

TEST(Manifest, ReadsWhatItWrote) {
  const test_support::TemporaryFolder folder;
  ASSERT_TRUE(write_manifest(folder / "m.csv", three()));
  const auto read = read_manifest(folder / "m.csv");
  ASSERT_TRUE(read) << read.error().message;
  const ManifestComparison comparison = compare_manifests(three(), *read);
  EXPECT_EQ(comparison.same_bits, 3);
  EXPECT_THAT(comparison.differences, testing::IsEmpty());
}

TEST(Manifest, NamesTheLineWhoseNumberIsNone) {
  const test_support::TemporaryFolder folder;
  ASSERT_TRUE(write_manifest(folder / "m.csv", three()));
  const std::string good = test_support::content_of(folder / "m.csv");
  const std::string first = ",1500000000,";  // recorded_ns of line 3
  for (const char* bad : {",soon,", ",,", ",-1,", ",0.5,", ",1e300,"}) {
    std::string text = good;
    text.replace(text.find(first), first.size(), bad);
    folder.write("bad.csv", text);
    const auto read = read_manifest(folder / "bad.csv");
    ASSERT_FALSE(read) << bad;
    EXPECT_EQ(read.error().code, ErrorCode::kUnreadable);
    EXPECT_THAT(read.error().message, HasSubstr("bad.csv: line 3")) << bad;
  }
  EXPECT_EQ(read_manifest(folder / "none.csv").error().code, ErrorCode::kNotFound);
}

TEST(Manifest, RoundingIsNoChangeAndTwoInterchangedPointsAre) {
  auto made = three();
  const Points rounded = some_points().array() + 1e-9;
  made[0] = entry_of("sag", 9, boundary(1, rounded));
  auto comparison = compare_manifests(three(), made);
  EXPECT_EQ(comparison.same_bits, 2);
  EXPECT_EQ(comparison.same_within_rounding, 1);
  EXPECT_THAT(comparison.differences, testing::IsEmpty());

  Points turned = some_points();
  turned.col(0).swap(turned.col(1));
  made[0] = entry_of("sag", 9, boundary(1, turned));
  comparison = compare_manifests(three(), made);
  ASSERT_EQ(comparison.differences.size(), 1u);
  EXPECT_THAT(comparison.differences[0], HasSubstr("sag, observation 1: mean"));
}

TEST(Manifest, EveryKindOfChangeIsADifference) {
  using Change = std::function<void(std::vector<ManifestEntry>&)>;
  const std::pair<Change, std::string> changes[] = {
      {[](auto& made) { made[1].seed = 8; }, "observation 2: seed 8, committed 9"},
      {[](auto& made) { made[1].source = "tracks"; }, "of tracks, committed of ius"},
      {[](auto& made) { made[1].recorded_ns += 1; }, "recorded at 1500000001 ns"},
      {[](auto& made) { made[1].acquired_ns += 1; }, "acquired at 60000000001 ns"},
      {[](auto& made) { made[1].coordinates = 7; }, "7 coordinates, committed 6"},
      {[](auto& made) { made[1].mean_mm += 1e-5; }, "mean"},
      {[](auto& made) { made[1].surgery = "other"; }, "is not in the committed table"},
      {[](auto& made) { made.pop_back(); }, "sag, observation 3: is missing"}};
  for (const auto& [change, text] : changes) {
    auto made = three();
    change(made);
    const ManifestComparison comparison = compare_manifests(three(), made);
    ASSERT_FALSE(comparison.differences.empty()) << text;
    EXPECT_THAT(comparison.differences, testing::Contains(HasSubstr(text)));
  }
}

}  // namespace
}  // namespace brainshift::replays
