// SPDX-License-Identifier: GPL-3.0-or-later
// Programs take a kernel of OpenBLAS that suits the processor, also where OpenBLAS does not know
// the processor and takes its oldest (common/linalg/openblas.hpp).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/integration/process.hpp"
#include "tests/integration/workspace.hpp"

namespace brainshift::integration {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

// The kernels that OpenBLAS says it has chosen, one for each time that the program was started.
std::vector<std::string> kernels(const Finished& finished) {
  std::vector<std::string> result;
  for (const std::string& line : lines(finished.err + finished.out)) {
    if (line.rfind("Core: ", 0) == 0) result.push_back(line.substr(6));
  }
  return result;
}

Finished started(const std::string& kernel_option, const std::vector<std::string>& arguments) {
  std::vector<std::string> argv = {"/usr/bin/env", "-u", "OPENBLAS_CORETYPE", "OPENBLAS_VERBOSE=2"};
  if (!kernel_option.empty()) argv.push_back("OPENBLAS_CORETYPE=" + kernel_option);
  argv.push_back(brainshiftd());
  argv.insert(argv.end(), arguments.begin(), arguments.end());
  return run(argv);
}

TEST(BlasKernel, IsNotTheOldestWhereTheProcessorHasAvx2) {
  const Finished finished = started("", {"--version"});
  EXPECT_EQ(finished.exit_status, 0);
  const auto chosen = kernels(finished);
  if (chosen.empty()) GTEST_SKIP() << "the loaded BLAS is not OpenBLAS";
  if (!__builtin_cpu_supports("avx2")) GTEST_SKIP() << "no AVX2";
  EXPECT_NE(chosen.back(), "Prescott");
  EXPECT_LE(chosen.size(), 2u);
}

TEST(BlasKernel, IsTheUsersWhereOneIsNamed) {
  const Finished finished = started("Prescott", {"--version"});
  EXPECT_EQ(finished.exit_status, 0);
  if (kernels(finished).empty()) GTEST_SKIP() << "the loaded BLAS is not OpenBLAS";
  EXPECT_THAT(kernels(finished), ElementsAre("Prescott"));
}

TEST(BlasKernel, ArgumentsReachAProgramThatStartsItselfAgain) {
  const Finished finished =
      started("", {"prepare", "--case", "no such case.yaml", "--out", "", "--json"});
  EXPECT_EQ(finished.exit_status, 2);
  std::vector<std::string> told;
  for (const std::string& line : lines(finished.err)) {
    if (line.rfind("brainshiftd: ", 0) == 0) told.push_back(line);
  }
  ASSERT_THAT(told, SizeIs(1)) << finished.err;
  EXPECT_THAT(told[0], HasSubstr("--out: \"\" must name a file"));
}

}  // namespace
}  // namespace brainshift::integration
