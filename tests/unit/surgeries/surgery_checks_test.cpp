// SPDX-License-Identifier: GPL-3.0-or-later
// The checks on tables made by hand: what each of them counts, and when it turns red.
#include "tests/surgeries/surgery_checks.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <map>
#include <string>

#include "tests/benchmarks/csv_table.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::surgeries {
namespace {

const std::vector<std::string> kColumns = {"head",
                                           "place",
                                           "seed",
                                           "scenario",
                                           "stage",
                                           "status",
                                           "nodes",
                                           "recovered_pct",
                                           "tumour_mm",
                                           "field_mean_mm",
                                           "craniotomy_mm",
                                           "craniotomy_closest_mm",
                                           "worse_nodes",
                                           "worst_excess_mm",
                                           "coverage_90",
                                           "sources",
                                           "contradictions",
                                           "quality",
                                           "inverted",
                                           "contact_decrement",
                                           "contact_violation_mm",
                                           "update_ms",
                                           "t_solve_ms",
                                           "warm_cold_mm",
                                           "swelling_strain",
                                           "volume_strain",
                                           "removed_nodes"};

using Cells = std::map<std::string, std::string>;

Cells good(const std::string& scenario, int seed, const std::string& stage) {
  const bool alone = stage == "tumour";
  return {{"head", "h"},
          {"place", "1"},
          {"seed", std::to_string(seed)},
          {"scenario", scenario},
          {"stage", stage},
          {"status", "converged"},
          {"nodes", "100"},
          {"recovered_pct", "98"},
          {"tumour_mm", "0.1"},
          {"field_mean_mm", "0.2"},
          {"craniotomy_mm", alone ? "1" : "0.3"},
          {"craniotomy_closest_mm", alone ? "1" : "0.4"},
          {"worse_nodes", "0"},
          {"worst_excess_mm", "-1"},
          {"coverage_90", "0.9"},
          {"sources", alone ? "1" : "3"},
          {"contradictions", "0"},
          {"quality", "good"},
          {"inverted", "0"},
          {"contact_decrement", "1e-4"},
          {"contact_violation_mm", "0.001"},
          {"update_ms", "30"},
          {"t_solve_ms", "20"},
          {"warm_cold_mm", alone ? "" : "0.001"},
          {"swelling_strain", "0"},
          {"volume_strain", "0"},
          {"removed_nodes", "0"}};
}

class Checks : public testing::Test {
 protected:
  Checks() {
    for (int seed = 1; seed <= 4; ++seed) {
      cells.push_back(good("joint-sag", seed, "tumour"));
      cells.push_back(good("joint-sag", seed, "tumour+cortex+tracks"));
    }
    setenv("BRAINSHIFT_STUDY_DIR", folder.path().c_str(), 1);
  }
  ~Checks() override { unsetenv("BRAINSHIFT_STUDY_DIR"); }

  static bench::CsvTable table(const std::vector<Cells>& rows) {
    std::string text;
    for (const std::string& column : kColumns) text += (text.empty() ? "" : ",") + column;
    for (const Cells& row : rows) {
      text += "\n";
      for (const std::string& column : kColumns) {
        text += (column == "head" ? "" : ",") + row.at(column);
      }
    }
    return *bench::CsvTable::parse(text, "test");
  }

  // name: pass, of all checks; those without a bound or left out are not in it.
  std::map<std::string, bool> run(const std::optional<std::vector<Cells>>& before = {}) {
    for (const char* file : {"checks.csv", "left_out.csv"}) {
      std::filesystem::remove(folder.path() / file);
    }
    const bench::CsvTable now = table(cells);
    const bench::CsvTable earlier = table(before.value_or(std::vector<Cells>{}));
    check_head(Rows(now), before ? std::optional<Rows>(Rows(earlier)) : std::nullopt);
    std::ifstream file(folder.path() / "checks.csv");
    std::string text = "study,name,value,bound,pass,source\n";
    text.append(std::istreambuf_iterator<char>(file), {});
    const auto checks = *bench::CsvTable::parse(text, "checks.csv");
    std::map<std::string, bool> passes;
    values.clear();
    for (std::size_t i = 0; i < checks.rows(); ++i) {
      const std::string& name = checks.text(i, "name");
      values[name] = checks.number(i, "value");
      if (!checks.text(i, "pass").empty()) passes[name] = checks.text(i, "pass") == "1";
    }
    return passes;
  }
  // The checks that fail.
  std::vector<std::string> red(const std::optional<std::vector<Cells>>& before = {}) {
    std::vector<std::string> names;
    for (const auto& [name, pass] : run(before)) {
      if (!pass) names.push_back(name);
    }
    return names;
  }

  test_support::TemporaryFolder folder;
  std::vector<Cells> cells;
  std::map<std::string, double> values;
};

using Names = std::vector<std::string>;

TEST_F(Checks, AllHoldWhenAllIsWell) {
  EXPECT_EQ(red(cells), Names{});
  EXPECT_EQ(run(cells).size(), 13u);
}

TEST_F(Checks, TheTumourMayMissItsShareWhereTheErrorIsSmall) {
  for (Cells& row : cells) row["recovered_pct"] = "80";
  EXPECT_EQ(red(), Names{});
  for (Cells& row : cells) row["tumour_mm"] = "0.16";
  EXPECT_EQ(red(), Names{"joint-sag: tumour recovered %"});
}

TEST_F(Checks, ARefusedUpdateRecoversAndCoversNothing) {
  for (Cells* row : {&cells[1], &cells[3]}) {
    for (auto& [name, text] : *row) {
      if (name != "head" && name != "place" && name != "seed" && name != "scenario" &&
          name != "stage") {
        text = name == "status" ? "refused" : "";
      }
    }
  }
  const Names names = red();
  EXPECT_EQ(names,
            (Names{"joint-sag: coverage of the 90 % interval", "joint-sag: tumour recovered %",
                   "share of single surgeries with coverage below 0.6 %",
                   "updates without the contact certificate"}));
  EXPECT_DOUBLE_EQ(values["joint-sag: tumour recovered %"], 49.0);
  EXPECT_DOUBLE_EQ(values["share of single surgeries with coverage below 0.6 %"], 50.0);
  EXPECT_DOUBLE_EQ(values["updates that were refused"], 2.0);
}

TEST_F(Checks, EveryUpdateCountsWhereOneIsTooMany) {
  cells[2]["worse_nodes"] = "1";
  cells[2]["inverted"] = "3";
  cells[4]["contact_decrement"] = "0.01";
  EXPECT_EQ(red(), (Names{"fields of quality good with inverted elements",
                          "joint-sag: updates somewhere worse than no correction by more than "
                          "their interval",
                          "updates without the contact certificate"}));
}

TEST_F(Checks, InvertedElementsAreAllowedInFieldsThatAreNotCalledGood) {
  cells[0]["inverted"] = "3";
  EXPECT_EQ(red(), Names{"fields of quality good with inverted elements"});
  EXPECT_DOUBLE_EQ(values["fields of quality good with inverted elements"], 1.0);
  cells[0]["quality"] = "unusable";
  cells[1]["quality"] = "caution";
  EXPECT_EQ(red(), Names{});
  EXPECT_DOUBLE_EQ(values["updates of quality good"], 6.0);
  EXPECT_DOUBLE_EQ(values["updates of quality caution"], 1.0);
  EXPECT_DOUBLE_EQ(values["updates of quality unusable"], 1.0);
}

TEST_F(Checks, CoverageHasTwoSides) {
  for (Cells& row : cells) row["coverage_90"] = "0.98";
  EXPECT_EQ(red(), Names{"joint-sag: coverage of the 90 % interval"});
  for (Cells& row : cells) row["coverage_90"] = "0.79";
  EXPECT_EQ(red(), Names{"joint-sag: coverage of the 90 % interval"});
  cells[1]["coverage_90"] = "0.59";
  EXPECT_EQ(red().size(), 2u);  // and one of four single surgeries
}

TEST_F(Checks, TheCraniotomyIsHeldToTheBetterOfBothEstimatesFromTheTumour) {
  std::vector<Cells> before = cells;
  for (Cells& row : before) row["craniotomy_mm"] = "0.55";
  EXPECT_EQ(red(before),
            Names{"joint-sag: craniotomy error by displacement over that of the tumour alone"});
}

TEST_F(Checks, SagIsHeldToTheEstimateBeforeOnTheSameSurgeriesOnly) {
  std::vector<Cells> before = cells;
  for (Cells& row : before) row["field_mean_mm"] = "0.17";
  EXPECT_EQ(red(before), Names{"joint-sag: field error over that of the estimate before"});
  for (Cells& row : before) row["place"] = "9";
  EXPECT_EQ(red(before), Names{});
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "left_out.csv"));
  for (Cells& row : before) row["place"] = "1";
  for (Cells& row : cells) row["volume_strain"] = "-0.01";
  EXPECT_EQ(red(before), Names{});
}

TEST_F(Checks, WarmColdTimeAndContradictions) {
  cells[1]["warm_cold_mm"] = "0.02";
  cells[1]["contradictions"] = "1";
  for (Cells& row : cells) row["update_ms"] = "41";
  EXPECT_EQ(red(), (Names{"update with three sources over one solve: p50",
                          "updates that call consistent sources contradictory %",
                          "warm against cold mm: largest of any node and surgery"}));
  EXPECT_DOUBLE_EQ(values["updates that call consistent sources contradictory %"], 25.0);
}

TEST_F(Checks, ACertificateThatIsNotPublishedIsLeftOut) {
  for (Cells& row : cells) row["contact_decrement"] = row["contact_violation_mm"] = "";
  EXPECT_EQ(red(), Names{});
  std::ifstream file(folder.path() / "left_out.csv");
  const std::string text(std::istreambuf_iterator<char>(file), {});
  EXPECT_NE(text.find("contact certificate"), std::string::npos);
}

}  // namespace
}  // namespace brainshift::surgeries
