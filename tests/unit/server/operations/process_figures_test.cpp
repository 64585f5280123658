// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/operations/process_figures.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <future>
#include <thread>
#include <vector>

namespace brainshift::server {
namespace {

TEST(ProcessFigures, AnOpenFileIsOneDescriptorMore) {
  const auto before = process_figures();
  const int fd = open("/dev/null", O_RDONLY | O_CLOEXEC);
  ASSERT_GE(fd, 0);
  const auto after = process_figures();
  close(fd);
  EXPECT_EQ(after.descriptors, before.descriptors + 1);
  EXPECT_EQ(process_figures().descriptors, before.descriptors);
  EXPECT_GT(before.descriptor_limit, before.descriptors);
}

TEST(ProcessFigures, AThreadIsOneMore) {
  std::thread([] {}).join();  // with the first one the thread sanitizer starts one of its own
  const auto before = process_figures();
  std::promise<void> leave;
  const std::jthread thread([&] { leave.get_future().wait(); });
  const auto after = process_figures();
  leave.set_value();
  EXPECT_EQ(after.threads, before.threads + 1);
}

TEST(ProcessFigures, MemoryThatIsWrittenIsResidentAndItsPeakStays) {
  constexpr std::size_t kBytes = 64u << 20;
  const auto before = process_figures();
  ASSERT_GT(before.resident_bytes, 0u);
  {
    const std::vector<char> written(kBytes, 'x');
    EXPECT_EQ(written.back(), 'x');
    EXPECT_GE(process_figures().resident_bytes, before.resident_bytes + kBytes / 2);
  }
  EXPECT_GE(process_figures().peak_bytes, before.resident_bytes + kBytes / 2);
}

}  // namespace
}  // namespace brainshift::server
