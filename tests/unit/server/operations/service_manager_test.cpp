// SPDX-License-Identifier: GPL-3.0-or-later
// What systemd would hear: a datagram socket of the test stands for its own.
#include "server/operations/service_manager.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.hpp"

namespace brainshift::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using Words = std::vector<std::string>;

class ServiceManagerTest : public testing::Test {
 protected:
  ServiceManagerTest() {
    const std::string path = (folder_ / "notify").string();
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    fd_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    EXPECT_EQ(bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    setenv("NOTIFY_SOCKET", path.c_str(), 1);
  }
  ~ServiceManagerTest() override {
    close(fd_);
    for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"}) unsetenv(name);
  }
  static void watch_every(const char* microseconds, long pid = getpid()) {
    setenv("WATCHDOG_USEC", microseconds, 1);
    setenv("WATCHDOG_PID", std::to_string(pid).c_str(), 1);
  }
  // What has been said since the last call. A datagram is there as soon as it was sent.
  Words heard() const {
    Words words;
    std::array<char, 512> buffer{};
    ssize_t size = 0;
    while ((size = recv(fd_, buffer.data(), buffer.size(), 0)) > 0) {
      words.emplace_back(buffer.data(), static_cast<std::size_t>(size));
    }
    return words;
  }
  static WorkerHealth busy_for(double working_s, double limit_s) {
    WorkerHealth health;
    health.working = std::chrono::duration<double>(working_s);
    health.limit = std::chrono::duration<double>(limit_s);
    return health;
  }

  test_support::TemporaryFolder folder_;
  int fd_ = -1;
  ServiceManager::TimePoint now_{seconds(50)};
};

TEST_F(ServiceManagerTest, HearsReadyStatusSignsOfLifeAndStopping) {
  watch_every("15000000");
  auto manager = ServiceManager::from_environment();
  manager.ready();
  EXPECT_TRUE(manager.turn("ready, session 1", busy_for(0.0, 10.0), now_));
  EXPECT_TRUE(manager.turn("ready, session 1", busy_for(9.0, 10.0), now_ + seconds(1)));
  manager.stopping();
  EXPECT_EQ(heard(), (Words{"READY=1", "STATUS=ready, session 1", "WATCHDOG=1", "WATCHDOG=1",
                            "STOPPING=1"}));
}

TEST_F(ServiceManagerTest, AWorkerThatHangsIsNoSignOfLife) {
  watch_every("15000000");
  auto manager = ServiceManager::from_environment();
  EXPECT_FALSE(manager.turn("tracking", busy_for(10.1, 10.0), now_));
  EXPECT_EQ(heard(), Words{"STATUS=tracking"});
  EXPECT_TRUE(manager.turn("tracking", busy_for(0.1, 10.0), now_));
  EXPECT_EQ(heard(), Words{"WATCHDOG=1"}) << "it came back";
}

TEST_F(ServiceManagerTest, SaysItThreeTimesWithinTheLimitOfTheWatchdog) {
  watch_every("600000");
  auto manager = ServiceManager::from_environment();
  ASSERT_EQ(manager.interval(), milliseconds(200));
  EXPECT_TRUE(manager.due(now_));
  manager.turn("", {}, now_);
  EXPECT_FALSE(manager.due(now_ + milliseconds(199)));
  EXPECT_TRUE(manager.due(now_ + milliseconds(200)));
}

TEST_F(ServiceManagerTest, WithoutAWatchdogOnlyTheStatusIsKeptUpToDate) {
  auto manager = ServiceManager::from_environment();
  EXPECT_EQ(manager.interval(), milliseconds(1000));
  manager.turn("empty", {}, now_);
  manager.turn("empty", {}, now_);
  manager.turn("tracking", {}, now_);
  EXPECT_EQ(heard(), (Words{"STATUS=empty", "STATUS=tracking"}));
}

TEST_F(ServiceManagerTest, AWatchdogOfAnotherProcessIsNotFed) {
  watch_every("15000000", getpid() + 1);
  auto manager = ServiceManager::from_environment();
  manager.turn("", {}, now_);
  EXPECT_EQ(heard(), Words{});
}

TEST_F(ServiceManagerTest, WithoutSystemdNothingIsDue) {
  unsetenv("NOTIFY_SOCKET");
  watch_every("15000000");
  auto manager = ServiceManager::from_environment();
  EXPECT_EQ(manager.interval(), std::nullopt);
  EXPECT_FALSE(manager.due(now_));
  manager.ready();
  EXPECT_EQ(heard(), Words{});
}

TEST_F(ServiceManagerTest, ALineBreakInTheStatusSaysNothingElse) {
  watch_every("15000000");
  auto manager = ServiceManager::from_environment();
  manager.turn("degraded: a\nWATCHDOG=1", busy_for(2.0, 1.0), now_);
  EXPECT_EQ(heard(), Words{"STATUS=degraded: a WATCHDOG=1"});
}

}  // namespace
}  // namespace brainshift::server
