// SPDX-License-Identifier: GPL-3.0-or-later
// The checks on tables made by hand: what each of them counts, and when it turns red.
#include "tests/evidence/evidence_checks.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "tests/benchmarks/csv_table.hpp"
#include "tests/evidence/evidence_rows.hpp"
#include "tests/evidence/evidence_truths.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::evidence {
namespace {

using Texts = std::map<std::string, std::string>;

// Four seeds of two patients under one truth, as good as must be.
std::vector<Texts> good(const std::string& truth) {
  std::vector<Texts> rows;
  for (const char* patient : {"1", "2"}) {
    for (const char* seed : {"1", "2", "3", "4"}) {
      for (const char* boundary : {"contact", "fixed"}) {
        for (const char* data : {"tumour", "tumour+cortex"}) {
          const bool contact = boundary == std::string("contact");
          const double more = 0.001 * (seed[0] - '0');  // so that no two differences are alike
          rows.push_back({{"head", "h"},
                          {"patient", patient},
                          {"truth", truth},
                          {"seed", seed},
                          {"boundary", boundary},
                          {"data", data},
                          {"status", "converged"},
                          {"nodes", "100"},
                          {"recovered_pct", contact ? "97" : "85"},
                          {"tumour_mm", contact ? std::to_string(0.1 + more) : "0.5"},
                          {"shift_tumour_mm", "0.4"},
                          {"initial_cppd_mm", "4"},
                          {"cppd_mm", contact ? std::to_string(0.4 + more) : "2"},
                          {"coverage_90", "0.9"}});
        }
      }
    }
  }
  return rows;
}

class EvidenceTable : public testing::Test {
 protected:
  // The pass column of the check that begins with `name`; "none" without one.
  std::string verdict(const std::vector<Texts>& rows, const std::string& name) {
    std::ofstream(folder_.path() / "checks.csv", std::ios::trunc).close();
    setenv("BRAINSHIFT_STUDY_DIR", folder_.path().c_str(), 1);
    std::string text;
    const surgeries::Row columns = refused_row({}, "");
    for (const auto& [column, unused] : columns) text += column + ",";
    text.back() = '\n';
    for (const Texts& row : rows) {
      for (const auto& [column, unused] : columns) {
        const auto found = row.find(column);
        text += (found == row.end() ? "" : found->second) + ",";
      }
      text.back() = '\n';
    }
    const auto table = bench::CsvTable::parse(text, "table");
    EXPECT_TRUE(table) << table.error().message;
    check_evidence(surgeries::Rows(*table));
    unsetenv("BRAINSHIFT_STUDY_DIR");
    std::ifstream checks(folder_.path() / "checks.csv");
    for (std::string line; std::getline(checks, line);) {
      if (line.rfind("h," + name, 0) != 0) continue;
      std::vector<std::string> cells;
      std::istringstream stream(line);
      for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
      return cells.at(4);
    }
    return "none";
  }

 private:
  test_support::TemporaryFolder folder_;
};

void set(std::vector<Texts>& rows, const char* boundary, const char* data, const char* column,
         const std::string& value) {
  for (Texts& row : rows) {
    if (row["boundary"] == boundary && row["data"] == data) row[column] = value;
  }
}

TEST(TruthKinds, AreConsistencyEachIngredientAllAndAnotherCode) {
  ASSERT_EQ(truth_kinds().size(), client::all_ingredients().size() + 3);
  EXPECT_TRUE(truth_kinds().front().ingredients.empty());
  EXPECT_EQ(find_truth("all")->ingredients.size(), client::all_ingredients().size());
  EXPECT_TRUE(find_truth("calculix")->calculix);
  EXPECT_FALSE(is_adverse_alone("calculix"));
  EXPECT_TRUE(is_adverse_alone("gap"));
  EXPECT_FALSE(is_adverse_alone("consistency"));
  EXPECT_FALSE(is_adverse_alone("all"));
  EXPECT_EQ(find_truth("weather"), nullptr);
}

TEST_F(EvidenceTable, TheBoundOfTheTumourDependsOnTheTruth) {
  for (const auto& [truth, least] : {std::pair{"consistency", 95}, std::pair{"gap", 88},
                                     std::pair{"all", 80}, std::pair{"calculix", 80}}) {
    auto rows = good(truth);
    const std::string name = std::string(truth) + ": tumour recovered";
    set(rows, "contact", "tumour", "recovered_pct", std::to_string(least));
    EXPECT_EQ(verdict(rows, name), "1") << truth;
    set(rows, "contact", "tumour", "recovered_pct", std::to_string(least - 1));
    EXPECT_EQ(verdict(rows, name), "0") << truth;
  }
}

TEST_F(EvidenceTable, EveryPatientCountsAlike) {
  auto rows = good("consistency");
  rows.resize(20);  // four seeds of patient 1, one of patient 2
  for (Texts& row : rows) row["recovered_pct"] = row["patient"] == "1" ? "100" : "88";
  EXPECT_EQ(verdict(rows, "consistency: tumour recovered"), "0");  // 94, not 97.6
}

TEST_F(EvidenceTable, TheCraniotomyIsBoundWithItsOwnDataAndWithoutThem) {
  auto rows = good("consistency");
  EXPECT_EQ(verdict(rows, "consistency: craniotomy CPPD mm from the tumour alone"), "1");
  EXPECT_EQ(verdict(rows, "consistency: craniotomy CPPD mm from tumour and cortex"), "1");
  set(rows, "contact", "tumour", "cppd_mm", "1.1");
  EXPECT_EQ(verdict(rows, "consistency: craniotomy CPPD mm from the tumour alone"), "0");
  set(rows, "contact", "tumour+cortex", "cppd_mm", "0.6");
  EXPECT_EQ(verdict(rows, "consistency: craniotomy CPPD mm from tumour and cortex"), "0");
  rows = good("gap");
  EXPECT_EQ(verdict(rows, "gap: craniotomy CPPD mm from the tumour alone"), "");  // shown
  set(rows, "contact", "tumour+cortex", "cppd_mm", "0.9");
  EXPECT_EQ(verdict(rows, "gap: craniotomy CPPD mm from tumour and cortex"), "1");
}

TEST_F(EvidenceTable, ContactMayBeWorseThanFixedByChanceAlone) {
  auto rows = good("gap");
  const std::string name = "gap: craniotomy CPPD with contact";
  EXPECT_EQ(verdict(rows, name), "1");
  int i = 0;
  for (Texts& row : rows) row["cppd_mm"] = row["boundary"] == "fixed" ? "0.4" : "0.5";
  EXPECT_EQ(verdict(rows, name), "0");
  for (Texts& row : rows) {  // now worse, now better, on average a little worse
    if (row["boundary"] == "contact") row["cppd_mm"] = ++i % 2 == 0 ? "0.9" : "0.0";
  }
  EXPECT_EQ(verdict(rows, name), "1");
}

TEST_F(EvidenceTable, CoverageIsBoundOverTheAdverseTruthsAlone) {
  const std::string name = "adverse truths: coverage";
  auto rows = good("consistency");
  for (Texts& row : rows) row["coverage_90"] = "0.2";
  EXPECT_EQ(verdict(rows, name), "none");
  auto adverse = good("gap");
  rows.insert(rows.end(), adverse.begin(), adverse.end());
  EXPECT_EQ(verdict(rows, name), "1");
  for (Texts& row : rows) row["coverage_90"] = "0.7";
  EXPECT_EQ(verdict(rows, name), "0");
}

TEST_F(EvidenceTable, FieldsOfAnotherMeshAreLeftOut) {
  auto rows = good("calculix");
  for (Texts& row : rows) row["status"] = "refused";
  EXPECT_EQ(verdict(rows, "calculix: tumour recovered"), "none");
  rows.front()["status"] = "converged";
  EXPECT_NE(verdict(rows, "calculix: tumour recovered"), "none");
}

TEST_F(EvidenceTable, AnUpdateWorseThanARigidShiftIsCounted) {
  auto rows = good("all");
  const std::string name = "all: updates worse at the tumour than a rigid shift";
  EXPECT_EQ(verdict(rows, name), "1");
  rows[0]["tumour_mm"] = "0.5";
  EXPECT_EQ(verdict(rows, name), "0");
}

}  // namespace
}  // namespace brainshift::evidence
