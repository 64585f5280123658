// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/linalg/blas_threads.hpp"

#include <dlfcn.h>
#include <gtest/gtest.h>

#include "common/linalg/blas.hpp"

namespace brainshift::linalg {
namespace {

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
