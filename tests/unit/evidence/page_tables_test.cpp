// SPDX-License-Identifier: GPL-3.0-or-later
// docs/evidence.md and the raw files beside it say the same.
#include "tests/evidence/page_tables.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace brainshift::evidence {
namespace {

using bench::CsvTable;
using testing::ElementsAre;
using testing::HasSubstr;

const std::filesystem::path kDocs = BRAINSHIFT_DOCS;

std::string page() {
  std::ifstream stream(kDocs / "evidence.md");
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

CsvTable raw(const std::string& name) {
  auto table = CsvTable::read(kDocs / "evidence" / name);
  EXPECT_TRUE(table) << name;
  return table ? *table : CsvTable{};
}

CsvTable parsed(const std::string& text) { return *CsvTable::parse(text, "text"); }

TEST(EvidencePage, HasTheClaimsOfItsChecks) {
  const CsvTable checks = raw("checks.csv");
  const auto studies = surgeries::Rows(checks).values("study");
  EXPECT_THAT(studies, ElementsAre("resect-4", "colin27", "mni152"));
  for (const std::string& study : studies) {
    EXPECT_THAT(page(), HasSubstr(claims_table(checks, study))) << study;
  }
}

TEST(EvidencePage, HasTheMeansOfItsRows) {
  for (const char* file : {"rows-colin27.csv", "rows-mni152.csv"}) {
    const CsvTable rows = raw(file);
    ASSERT_GT(rows.rows(), 400u) << file;
    EXPECT_THAT(page(), HasSubstr(truths_table(surgeries::Rows(rows)))) << file;
  }
}

TEST(EvidencePage, HasTheDistancesOfItsLandmarks) {
  const CsvTable landmarks = raw("landmarks-resect-4.csv");
  ASSERT_EQ(landmarks.rows(), 15u);
  EXPECT_THAT(page(), HasSubstr(landmarks_table(landmarks)));
}

TEST(ClaimsTable, NamesWhatMissedItsBoundAndLeavesOutWhatHasNone) {
  const CsvTable checks = parsed(
      "study,name,value,bound,pass,source\n"
      "h,gap: recovered %,96.25,>= 88 (paper 85),1,s\n"
      "h,level: recovered %,80.5,>= 88 (paper 85),0,s\n"
      "h,all: recovered %,81,>= 80 (paper 85),1,s\n"
      "h,all: unusable,4,shown,,s\n"
      "h,coverage,0.9,0.75 to 0.97,1,s\n"
      "another head,level: recovered %,10,>= 88,0,s\n");
  EXPECT_EQ(claims_table(checks, "h"),
            "| figure | bound | measured | |\n|---|---|---|---|\n"
            "| recovered % | >= 88 | 80.5 (`level`) to 96.2 (`gap`) | **missed** in 1 of 2: 80.5 "
            "(`level`) |\n"
            "| recovered % | >= 80 | 81 (`all`) | holds |\n"
            "| coverage | 0.75 to 0.97 | 0.9 | holds |\n");
}

TEST(TruthsTable, AveragesOverPatientsNotOverRows) {
  const CsvTable table = parsed(
      "patient,truth,boundary,data,recovered_pct,quality\n"
      "1,gap,contact,tumour,80,good\n1,gap,contact,tumour,90,unusable\n"
      "2,gap,contact,tumour,95,good\n1,gap,fixed,tumour,60,good\n");
  const std::string text = truths_table(surgeries::Rows(table));
  EXPECT_THAT(text, HasSubstr("| `gap` | 90.0, 60.0 % | – % |"));
  EXPECT_THAT(text, HasSubstr("| 1 of 3 |"));
}

TEST(LandmarksTable, HasRootMeanSquares) {
  const CsvTable table = parsed(
      "landmark,none_mm,rigid_mm,affine_mm,thin_plate_mm,estimate_mm\n1,3,1,1,1,1\n2,4,7,1,1,2\n");
  const std::string text = landmarks_table(table);
  EXPECT_THAT(text, HasSubstr("| no correction | 3.536 mm |"));
  EXPECT_THAT(text, HasSubstr("| rigid | 5.000 mm |"));
  EXPECT_THAT(text, HasSubstr("| **estimate** | 1.581 mm | |"));
}

}  // namespace
}  // namespace brainshift::evidence
