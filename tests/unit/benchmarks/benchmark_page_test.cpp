// SPDX-License-Identifier: GPL-3.0-or-later
// BENCHMARK.md and the raw files in docs/benchmark say the same.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "tests/benchmarks/bench_checks.hpp"
#include "tests/benchmarks/bench_results.hpp"

namespace brainshift::bench {
namespace {

const std::filesystem::path kSource = BRAINSHIFT_SOURCE_DIR;

TEST(BenchmarkPage, HasTheTablesOfItsRawFiles) {
  const auto results = read_results(kSource / "docs/benchmark");
  ASSERT_TRUE(results) << results.error().message;
  std::stringstream page;
  page << std::ifstream(kSource / "BENCHMARK.md").rdbuf();
  // The folder stands in commands only, which the page does not tell.
  EXPECT_THAT(page.str(), testing::HasSubstr(tables(*results, checks(*results, "out/bench"))));
}

}  // namespace
}  // namespace brainshift::bench
