// SPDX-License-Identifier: GPL-3.0-or-later
// That programs start themselves again is tested in tests/integration/test_blas_kernel.py.
#include <gtest/gtest.h>

#include <dlfcn.h>

#include <cstdlib>

#include "common/linalg/blas.hpp"
#include "common/linalg/openblas.hpp"

namespace brainshift::linalg {
namespace {

TEST(BlasKernel, AKernelThatTheUserNamesIsKept) {
  const std::string before = blas_kernel();
  ASSERT_EQ(setenv("OPENBLAS_CORETYPE", "Prescott", 1), 0);
  choose_blas_kernel();  // returns
  EXPECT_EQ(blas_kernel(), before);
  EXPECT_STREQ(std::getenv("OPENBLAS_CORETYPE"), "Prescott");
}

TEST(BlasThreads, OneThreadWhereTheBlasHasThreads) {
  // A call into BLAS, so that the library is loaded.
  const double x = 1.0;
  double y = 2.0;
  blas::add_scaled(1, 1.0, &x, &y);
  EXPECT_EQ(y, 3.0);
  use_single_threaded_blas();
  void* symbol = dlsym(RTLD_DEFAULT, "openblas_get_num_threads");
  if (symbol == nullptr) GTEST_SKIP() << "the loaded BLAS is not OpenBLAS";
  EXPECT_EQ(reinterpret_cast<int (*)()>(symbol)(), 1);
}

}  // namespace
}  // namespace brainshift::linalg
