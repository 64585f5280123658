// SPDX-License-Identifier: GPL-3.0-or-later
// That programs start themselves again is tested in tests/integration/test_blas_kernel.py.
#include "common/linalg/blas_kernel.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

namespace brainshift::linalg {
namespace {

TEST(BlasKernel, AKernelThatTheUserNamesIsKept) {
  const std::string before = blas_kernel();
  ASSERT_EQ(setenv("OPENBLAS_CORETYPE", "Prescott", 1), 0);
  choose_blas_kernel();  // returns
  EXPECT_EQ(blas_kernel(), before);
  EXPECT_STREQ(std::getenv("OPENBLAS_CORETYPE"), "Prescott");
}

}  // namespace
}  // namespace brainshift::linalg
