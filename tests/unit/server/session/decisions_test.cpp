// SPDX-License-Identifier: GPL-3.0-or-later
// Every accepted observation is decided once: what a replay needs to know.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <future>
#include <mutex>
#include <vector>

#include "server/session/session.hpp"
#include "tests/unit/server/fake_session.hpp"

namespace brainshift::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class Decisions : public testing::Test {
 protected:
  SessionHooks hooks(FakeInverter::Update update) {
    SessionHooks hooks;
    hooks.make_model = [update = std::move(update)](const SessionRequest& request,
                                                    const std::stop_token&) {
      return fake_session(std::make_unique<FakeInverter>(update), request);
    };
    hooks.publish = [this](const UpdateMessage& message, const Handled&) {
      const std::lock_guard lock(mutex_);
      told_.push_back("update " + std::to_string(message.update.sequence));
      changed_.notify_all();
    };
    hooks.decided = [this](const Decision& decision) {
      const std::lock_guard lock(mutex_);
      decisions_.push_back(decision);
      told_.push_back(std::string(to_string(decision.outcome)) + " " + decision.source + " " +
                      std::to_string(decision.observation_sequence));
      changed_.notify_all();
    };
    return hooks;
  }
  static void start(Session& session) {
    std::promise<Result<SessionInfo>> ready;
    session.start({kCase, Method::kPaper, Boundary::kContact, false, false},
                  [&](Result<SessionInfo> info) { ready.set_value(std::move(info)); });
    ASSERT_TRUE(ready.get_future().get());
  }
  std::vector<std::string> wait_for(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::seconds(10), [&] { return told_.size() >= count; });
    return told_;
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Decision> decisions_;
  std::vector<std::string> told_;  // decisions and updates in their order
};

TEST_F(Decisions, UsedAndSupersededStandInTheOrderInWhichTheyHappened) {
  std::promise<void> entered, leave;
  TestSession session(hooks([&](int call, const SparseData& data, const auto&, Estimate& out) {
    if (call == 1) entered.set_value(), leave.get_future().wait();
    return follow_the_data(data, out, 4);
  }));
  start(session);
  ASSERT_TRUE(session.submit(landmarks(1, "ius")));
  entered.get_future().wait();
  ASSERT_TRUE(session.submit(landmarks(2, "ius")));
  ASSERT_TRUE(session.submit(landmarks(1, "pointer")));
  ASSERT_TRUE(session.submit(landmarks(3, "ius")));
  leave.set_value();
  EXPECT_THAT(wait_for(7), ElementsAre("superseded ius 2", "used ius 1", "update 1",
                                       "used pointer 1", "update 2", "used ius 3", "update 3"));
  EXPECT_EQ(decisions_[1].session_id, 1u);
  EXPECT_EQ(decisions_[1].update_sequence, 1u);
  EXPECT_TRUE(decisions_[1].reason.empty());
  EXPECT_EQ(decisions_[0].update_sequence, 0u);
  EXPECT_THAT(decisions_[0].reason, HasSubstr("observation 3"));
}

TEST_F(Decisions, AFailureCarriesItsReason) {
  TestSession session(hooks([](int, const SparseData&, const auto&, Estimate& estimate) -> Status {
    estimate.contact.active = 3;
    return fail(ErrorCode::kNotConverged, "no luck");
  }));
  start(session);
  ASSERT_TRUE(session.submit(landmarks(4, "ius")));
  EXPECT_THAT(wait_for(2), ElementsAre("failed ius 4", "update 1"));
  EXPECT_THAT(decisions_[0].reason, HasSubstr("no luck"));
}

TEST_F(Decisions, WhatASessionLeavesIsSkipped) {
  for (const bool restart : {false, true}) {
    decisions_.clear(), told_.clear();
    std::promise<void> entered;
    TestSession session(
        hooks([&](int call, const SparseData& data, const auto& options, Estimate& out) -> Status {
          if (call > 1) return follow_the_data(data, out, 4);
          std::promise<void> stopped;
          const std::stop_callback wake(options.stop, [&] { stopped.set_value(); });
          entered.set_value();
          stopped.get_future().wait();
          return fail(ErrorCode::kNotConverged, "stopped");
        }));
    start(session);
    ASSERT_TRUE(session.submit(landmarks(1, "ius")));
    entered.get_future().wait();
    ASSERT_TRUE(session.submit(landmarks(2, "ius")));
    restart ? start(session) : session.stop();
    EXPECT_THAT(wait_for(2), ElementsAre("skipped ius 2", "skipped ius 1"));
    for (const Decision& decision : decisions_) {
      EXPECT_EQ(decision.session_id, 1u);
      EXPECT_EQ(decision.reason, "the session ended");
    }
  }
}

TEST_F(Decisions, WhatIsRefusedIsNotDecided) {
  TestSession session(hooks([](int, const SparseData& data, const auto&, Estimate& out) {
    return follow_the_data(data, out, 4);
  }));
  start(session);
  EXPECT_FALSE(session.submit(landmarks(0, "ius")));
  EXPECT_THAT(told_, IsEmpty());
}

}  // namespace
}  // namespace brainshift::server
