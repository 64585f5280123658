// SPDX-License-Identifier: GPL-3.0-or-later
// A program of its own, because it counts every allocation of the process.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>

#include "tests/unit/inversion/condensed_fixture.hpp"

namespace {
std::atomic<bool> counting{false};
std::atomic<long> allocations{0};
}  // namespace

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
extern "C" {
void* __libc_malloc(std::size_t);
void* malloc(std::size_t size) {
  if (counting) ++allocations;
  return __libc_malloc(size);
}
}
#endif

namespace brainshift::inversion {
namespace {

class AllocationFree : public Condensed {
 protected:
  void updates(bool estimate_strengths);
};

TEST_F(AllocationFree, UpdatesWithStrengthsOfTheCase) { updates(false); }
TEST_F(AllocationFree, UpdatesWithEstimatedStrengths) { updates(true); }

void AllocationFree::updates(bool estimate_strengths) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a sanitizer has its own malloc";
#endif
  CondensedOptions options;
  options.threads = 2;
  CaseConfig with = config();
  with.prior.estimate_scales = estimate_strengths;
  auto inverter = Condensed::inverter(Boundary::kContact, options, with);
  std::vector<SparseData> data;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    data.push_back(sagging_data(Boundary::kContact, 0.3, seed));
  }
  Estimate estimate;
  for (const SparseData& d : data) ASSERT_TRUE(inverter.update(d, estimate));
  constexpr int kUpdates = 12;
  const int active = estimate.contact.active;
  ASSERT_GT(active, 0);

  allocations = 0;
  counting = true;
  std::free(std::malloc(1));
  const long own = allocations;
  int failed = 0;
  for (int i = 0; i < kUpdates; ++i) failed += !inverter.update(data[3], estimate);
  const long same_data = allocations - own;
  for (int i = 0; i < kUpdates; ++i) {
    failed += !inverter.update(data[static_cast<std::size_t>(i % 4)], estimate);
  }
  const long changing_data = allocations - own - same_data;
  counting = false;
  EXPECT_EQ(own, 1) << "the counter does not count";
  ASSERT_EQ(failed, 0);
  EXPECT_EQ(same_data, 0);
  // The active slaves and their forces, whose number changes: at most one new array each.
  EXPECT_LE(changing_data, 2 * kUpdates);
}

}  // namespace
}  // namespace brainshift::inversion
