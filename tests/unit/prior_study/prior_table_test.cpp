// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/prior_study/prior_table.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "tests/benchmarks/csv_table.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::prior_study {
namespace {

// 101 draws, 0 to 100 times `scale` mm: the q % quantile is q * scale.
PartDraws ramp(const std::string& part, double scale) {
  PartDraws draws;
  draws.part = part;
  for (int i = 0; i <= 100; ++i) {
    for (auto& motion : draws.motion_mm) motion.push_back(scale * i);
  }
  return draws;
}

std::vector<Target> targets_around(double scale) {
  std::vector<Target> targets;
  for (int place = 0; place < kPlaces; ++place) {
    for (const double q : kTargetQuantiles) {
      targets.push_back({place, q, scale * q, 0.9 * scale * q, 1.1 * scale * q, "S"});
    }
  }
  return targets;
}

TEST(PriorTable, HasQuantilesPerPartAndTargetsOfTheTotal) {
  const test_support::TemporaryFolder folder;
  const auto file = folder.path() / "quantiles.csv";
  ASSERT_TRUE(write_quantiles(file, {ramp("total", 0.1), ramp("fine", 0.01)}, targets_around(0.2)));
  const auto table = bench::CsvTable::read(file);
  ASSERT_TRUE(table) << table.error().message;
  ASSERT_EQ(table->rows(), 6u);
  EXPECT_EQ(table->text(2, "place"), "far side");
  EXPECT_EQ(table->number(2, "draws"), 101.0);
  EXPECT_NEAR(table->number(0, "q5_mm"), 0.5, 1e-9);
  EXPECT_NEAR(table->number(0, "q75_mm"), 7.5, 1e-9);
  EXPECT_NEAR(table->number(3, "q95_mm"), 0.95, 1e-9);
  EXPECT_NEAR(table->number(0, "target_q50_mm"), 10.0, 1e-9);
  EXPECT_EQ(table->text(0, "bracket_q50_mm"), "9 to 11");
  EXPECT_EQ(table->text(0, "source"), "S");
  EXPECT_EQ(table->text(3, "target_q50_mm") + table->text(3, "source"), "");
  EXPECT_FALSE(write_quantiles("/nowhere/quantiles.csv", {ramp("total", 1.0)}, {}));
}

class RecordedChecks : public ::testing::Test {
 protected:
  RecordedChecks() {
    file_ = folder_.write("checks.csv", "study,name,value,bound,pass,source\n");
    setenv("BRAINSHIFT_STUDY_DIR", folder_.path().c_str(), 1);
  }
  ~RecordedChecks() override { unsetenv("BRAINSHIFT_STUDY_DIR"); }
  bench::CsvTable table() const { return bench::CsvTable::read(file_).value(); }

  test_support::TemporaryFolder folder_;
  std::filesystem::path file_;
};

TEST_F(RecordedChecks, HoldWhereEveryQuantileIsInside) {
  EXPECT_TRUE(check_quantiles({ramp("total", 0.1)}, targets_around(0.1)));
  ASSERT_EQ(table().rows(), 9u);
  EXPECT_EQ(table().text(8, "name"), "far side 95 % quantile mm");
  EXPECT_EQ(table().text(8, "pass"), "1");
}

TEST_F(RecordedChecks, TurnRedForOneQuantileOutside) {
  auto targets = targets_around(0.1);
  targets[4].low_mm = 5.4;  // tumour, 50 %: 5.0
  EXPECT_FALSE(check_quantiles({ramp("total", 0.1)}, targets));
  for (std::size_t row = 0; row < 9; ++row) {
    EXPECT_EQ(table().text(row, "pass"), row == 4 ? "0" : "1") << row;
  }
}

TEST_F(RecordedChecks, TurnRedWithoutDraws) {
  PartDraws none;
  none.part = "total";
  EXPECT_FALSE(check_quantiles({none}, targets_around(0.1)));
}

TEST_F(RecordedChecks, FiguresHaveNoVerdict) {
  PartDraws total = ramp("total", 0.1);
  total.min_volume_ratio = {-0.1, 0.4, 0.6, 0.9};
  record_figures(total);
  EXPECT_EQ(table().number(0, "value"), 25.0);
  EXPECT_EQ(table().number(1, "value"), 50.0);
  for (std::size_t row = 0; row < table().rows(); ++row) EXPECT_EQ(table().text(row, "pass"), "");
}

TEST(PriorTable, CountsVolumeRatiosThatAreNoNumber) {
  const double nan = std::nan("");
  EXPECT_EQ(share_at_most({nan, 1.0}, 0.0), 0.5);
  EXPECT_EQ(share_at_most({0.0, 1.0}, 0.0), 0.5);
  EXPECT_TRUE(std::isnan(share_at_most({}, 0.0)));
}

TEST(PriorTable, CorrelatesAsPearsonDoes) {
  EXPECT_NEAR(correlation({1, 2, 3}, {2, 4, 6}), 1.0, 1e-12);
  EXPECT_NEAR(correlation({1, 2, 3}, {3, 2, 1}), -1.0, 1e-12);
  EXPECT_NEAR(correlation({1, 2, 3}, {1, 3, 1}), 0.0, 1e-12);
  EXPECT_TRUE(std::isnan(correlation({1, 1}, {1, 2})));
}

}  // namespace
}  // namespace brainshift::prior_study
