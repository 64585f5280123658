// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/advice/candidates.hpp"

#include <gmock/gmock.h>

#include <set>

#include "tests/support/refusals.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::advice {
namespace {

const BrainModel& toy() {
  static const BrainModel made = test_support::toy_patient(10);
  return made;
}

TEST(Candidates, SectorsPartTheTumourAndPatchesTheOpening) {
  std::set<std::string> names;
  int sweeps = 0, patches = 0, points = 0;
  for (const Candidate& each : default_candidates(toy())) {
    EXPECT_TRUE(names.insert(each.name).second) << each.name;
    sweeps += each.kind == Kind::kSweep ? 1 : 0;
    patches += each.kind == Kind::kCortex ? 1 : 0;
    points += each.kind == Kind::kPoint ? 1 : 0;
    if (each.kind == Kind::kPoint) {
      EXPECT_EQ(each.places.cols(), kTouches);
    }
    if (each.kind == Kind::kCortex) {
      EXPECT_NEAR(each.centre().z(), 60.0, 1e-9);
    }
    if (each.name == "tumour boundary, right posterior superior") {
      EXPECT_GT(each.places.row(0).minCoeff(), 30.0 - 0.5);
      EXPECT_LT(each.places.row(1).maxCoeff(), 30.0 + 0.5);
      EXPECT_GT(each.places.row(2).minCoeff(), 40.0 - 0.5);
    }
  }
  EXPECT_EQ(sweeps, 8);
  EXPECT_EQ(patches, 4);
  EXPECT_EQ(points, 5);
  EXPECT_TRUE(names.contains("tumour boundary, right posterior superior"));
}

TEST(Candidates, WhatIsObservedLiesWhereThePlacesMovedTo) {
  const Candidate sweep{"a", Kind::kSweep, Points::Random(3, 9)};
  const Points u = Vec3(1, 2, 3).replicate(1, 9);
  EXPECT_EQ(std::get<TumourBoundary>(observed(sweep, u).body).points, Points(sweep.places + u));
  const Candidate touch{"b", Kind::kPoint, Points::Random(3, 9)};
  const auto pairs = std::get<LandmarkPairs>(observed(touch, u).body);
  EXPECT_EQ(pairs.undeformed, touch.places);
  EXPECT_EQ(pairs.deformed, Points(touch.places + u));
}

constexpr const char* kTable =
    "name,kind,x,y,z,radius_mm\nleft side,sweep,20,30,40,9\nopening,cortex,30,30,60,12\n"
    "fork,point,30,30,60,\n";

Result<std::vector<Candidate>> read(const std::string& text) {
  const test_support::TemporaryFolder folder;
  return read_candidates(folder.write("c.csv", text), toy());
}

TEST(Candidates, ATableNamesParts) {
  const auto found = value_or_fail(read(kTable));
  ASSERT_EQ(found.size(), 3u);
  EXPECT_EQ(found[0].name, "left side");
  EXPECT_EQ(found[0].kind, Kind::kSweep);
  EXPECT_LE((found[0].places.colwise() - Vec3(20, 30, 40)).colwise().norm().maxCoeff(), 9.0);
  EXPECT_EQ(found[1].kind, Kind::kCortex);
  EXPECT_EQ(found[2].places, Points(Vec3(30, 30, 60).replicate(1, kTouches)));
}

TEST(Candidates, ATableThatIsWrongIsRefusedByLine) {
  test_support::expect_edits_refused(
      read, kTable,
      {{"name,kind,x,y,z,radius_mm\n", "", "has no heading"},
       {"radius_mm", "width_mm", "must be name,kind,x,y,z,radius_mm"},
       {"sweep", "swipe", "line 2: kind is \"swipe\": must be sweep, cortex or point"},
       {"40,9", "40,-9", "line 2: radius_mm is \"-9\""},
       {"20,30,40", "20,x,40", "line 2: "},
       {"opening", "left side", "line 3: the name \"left side\" is there twice"},
       {"20,30,40,9", "20,30,10,9", "line 2: 0 mm2 of the tumour's boundary lie within 9 mm"},
       {"40,9", "40", "line 2: \"left side,sweep,20,30,40\" has 5 of 6 cells"}});
  EXPECT_THAT(refusal_of(read("name,kind,x,y,z,radius_mm\n"), ErrorCode::kEmptySet),
              testing::HasSubstr("names no candidate"));
}

}  // namespace
}  // namespace brainshift::advice
