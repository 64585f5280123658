// SPDX-License-Identifier: GPL-3.0-or-later
// The checks on tables made by hand: what each of them counts, and when it turns red.
#include "tests/replays/replay_checks.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <functional>

#include "tests/support/temporary_folder.hpp"
#include "tests/unit/replays/made_up_rows.hpp"

namespace brainshift::replays {
namespace {

using surgeries::Rows;
using testing::HasSubstr;

class ReplayChecks : public testing::Test {
 protected:
  // What `check` records, as lines of checks.csv and left_out.csv.
  void record(const std::function<void()>& check) {
    for (const char* name : {"checks.csv", "left_out.csv"}) {
      std::ofstream(folder_ / name, std::ios::trunc).close();
    }
    setenv("BRAINSHIFT_STUDY_DIR", folder_.path().c_str(), 1);
    check();
    unsetenv("BRAINSHIFT_STUDY_DIR");
  }
  // The pass column of the check that begins so; "none" without one.
  std::string verdict(const std::string& begin) const {
    const auto table = bench::CsvTable::parse(
        "study,name,value,bound,pass,source\n" + test_support::content_of(folder_ / "checks.csv"),
        "checks.csv");
    EXPECT_TRUE(table) << table.error().message;
    for (std::size_t row = 0; row < table->rows(); ++row) {
      if ((table->text(row, "study") + "," + table->text(row, "name")).rfind(begin, 0) == 0) {
        return table->text(row, "pass");
      }
    }
    return "none";
  }
  std::string verdict(const std::vector<Texts>& rows, const std::string& begin) {
    const auto table = table_of(rows);
    record([&] { check_replays(Rows(table)); });
    return verdict(begin);
  }
  std::string verdict(const std::vector<Texts>& now, const std::vector<Texts>& committed,
                      const std::string& begin) {
    const auto ours = table_of(now), theirs = table_of(committed);
    record([&] { check_regression(Rows(ours), Rows(theirs)); });
    return verdict(begin);
  }
  std::string checks() const { return test_support::content_of(folder_ / "checks.csv"); }
  std::string left_out() const { return test_support::content_of(folder_ / "left_out.csv"); }

 private:
  test_support::TemporaryFolder folder_;
};

const std::vector<double> kEven = {40, 20, 20, 20, 20};
std::vector<Texts> good() { return joined(pass_of(kEven), pass_of(kEven, "max")); }

TEST_F(ReplayChecks, EverythingSentIsAccountedFor) {
  const std::string name = "1x,observations that nothing accounts for";
  EXPECT_EQ(verdict(good(), name), "1");
  auto rows = good();
  for (const char* accounted : {"superseded", "empty_set"}) {
    rows[2]["outcome"] = accounted;
    EXPECT_EQ(verdict(rows, name), "1") << accounted;
  }
  for (const char* lost : {"", "unavailable"}) {
    rows[2]["outcome"] = lost;
    EXPECT_EQ(verdict(rows, name), "0") << lost;
    EXPECT_EQ(verdict("max,observations that nothing accounts for"), "1");
  }
}

TEST_F(ReplayChecks, AnOldFieldMustBeMarked) {
  const std::string name = "1x,fields later than 3 x the median";
  auto rows = good();
  rows[3]["latency_ms"] = "59";
  EXPECT_EQ(verdict(rows, name), "1");
  rows[3]["latency_ms"] = "61";
  EXPECT_EQ(verdict(rows, name), "0");
  rows[3]["late"] = "1";
  EXPECT_EQ(verdict(rows, name), "1");
  rows[3]["late"] = "0";
  rows[3]["usual_ms"] = "0";  // too few answers before it to tell
  EXPECT_EQ(verdict(rows, name), "1");
  EXPECT_THAT(checks(), HasSubstr("1x,the same before a session has enough answers to tell,1,"));
}

TEST_F(ReplayChecks, TheMedianIsThatOfTheSession) {
  auto rows = joined(good(), pass_of({400, 200, 200, 200, 200}, "1x", "2"));
  EXPECT_EQ(verdict(rows, "1x,fields later than 3 x the median"), "1");
}

TEST_F(ReplayChecks, DeadlinesAreBoundAtTheRecordedTimesAlone) {
  auto rows = good();
  EXPECT_EQ(verdict(rows, "1x,missed deadlines"), "1");
  rows[9]["deadline"] = "1";  // at full speed
  EXPECT_EQ(verdict(rows, "max,missed deadlines"), "");
  EXPECT_EQ(verdict(rows, "1x,missed deadlines"), "1");
  rows[4]["deadline"] = "1";
  EXPECT_EQ(verdict(rows, "1x,missed deadlines"), "0");
}

TEST_F(ReplayChecks, FieldsOfTheSameEvidenceAgree) {
  const std::string name = "both speeds,fields of the same evidence";
  auto rows = good();
  EXPECT_EQ(verdict(rows, name), "1");
  rows[7]["difference_mm"] = "0.011";
  EXPECT_EQ(verdict(rows, name), "0");
  for (Texts& row : rows) row["difference_mm"] = "";
  EXPECT_EQ(verdict(rows, name), "none");
  EXPECT_THAT(left_out(), HasSubstr("both speeds,"));
}

TEST_F(ReplayChecks, NoStageIsMoreThanHalfAsSlowAgain) {
  const auto committed = good();
  auto now = good();
  const std::string name = "sag 1x,slowest stage over the committed run";
  EXPECT_EQ(verdict(now, committed, name), "1");
  for (std::size_t i = 0; i < 5; ++i) now[i]["invert_ms"] = "2.9";
  EXPECT_EQ(verdict(now, committed, name), "1");
  for (std::size_t i = 0; i < 5; ++i) now[i]["invert_ms"] = "3.1";
  EXPECT_EQ(verdict(now, committed, name), "0");
  EXPECT_EQ(verdict("sag max,slowest stage over the committed run"), "1");
  EXPECT_THAT(checks(), HasSubstr("invert p50: 0.31 t_solve now; 0.20 committed"));
  for (Texts& row : now) row["t_solve_ms"] = "20";  // a slower machine
  for (std::size_t i = 0; i < 5; ++i) now[i]["invert_ms"] = "5.9";
  EXPECT_EQ(verdict(now, committed, name), "1");
}

TEST_F(ReplayChecks, OneSlowUpdateOfTwentyIsSeenAtTheTail) {
  const std::vector<double> even(21, 20.0);
  auto now = pass_of(even);
  now[5]["latency_ms"] = now[6]["latency_ms"] = "90";
  EXPECT_EQ(verdict(now, pass_of(even), "sag 1x,slowest stage"), "0");
  EXPECT_THAT(checks(), HasSubstr("latency p95"));
}

TEST_F(ReplayChecks, WithoutComparableRowsTheComparisonIsLeftOut) {
  EXPECT_EQ(verdict(good(), {}, "sag 1x,slowest stage"), "none");
  EXPECT_THAT(left_out(), HasSubstr("regression,no rows of an earlier run"));
  EXPECT_EQ(verdict(good(), pass_of(kEven), "sag 1x,slowest stage"), "1");
  EXPECT_EQ(verdict("sag max,slowest stage"), "none");
  EXPECT_THAT(left_out(), HasSubstr("sag max,regression: no committed rows"));
  auto other = good();
  for (Texts& row : other) row["head"] = "another";
  EXPECT_EQ(verdict(good(), other, "sag 1x,slowest stage"), "none");
  EXPECT_THAT(left_out(), HasSubstr("head is h; that of the committed rows another"));
}

TEST_F(ReplayChecks, AChangedCorpusIsNoticed) {
  ManifestEntry entry;
  entry.surgery = "sag";
  entry.sequence = 1;
  entry.source = "ius";
  record([&] { check_corpus(std::vector{entry}, {entry}); });
  EXPECT_EQ(verdict("corpus,"), "1");
  ManifestEntry changed = entry;
  changed.mean_mm = 1.0;
  record([&] { check_corpus(std::vector{entry}, {changed}); });
  EXPECT_EQ(verdict("corpus,"), "0");
  EXPECT_THAT(checks(), HasSubstr("first: sag; observation 1: mean"));
  record([&] { check_corpus(std::nullopt, {entry}); });
  EXPECT_EQ(verdict("corpus,"), "none");
  EXPECT_THAT(left_out(), HasSubstr("corpus,no table of its observations is kept"));
}

}  // namespace
}  // namespace brainshift::replays
