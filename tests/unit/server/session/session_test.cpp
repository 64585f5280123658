// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/session/session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <stdexcept>
#include <utility>
#include <vector>

#include "server/session/observation_rules.hpp"
#include "tests/unit/server/fake_session.hpp"

namespace brainshift::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using namespace std::chrono_literals;

// Messages as they are published, to wait for.
class Published {
 public:
  void push(UpdateMessage message) {
    const std::lock_guard lock(mutex_);
    messages_.push_back(std::move(message));
    changed_.notify_all();
  }
  // The first `count` messages; fewer when they do not come in time.
  std::vector<UpdateMessage> wait_for(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, 10s, [&] { return messages_.size() >= count; });
    return messages_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<UpdateMessage> messages_;
};

// A gate that a fake inversion waits at.
struct Gate {
  std::promise<void> entered;
  std::promise<void> leave;
};

// Waits until a stop is requested.
void wait_for_stop(const inversion::InversionOptions& options, std::promise<void>& entered) {
  std::promise<void> stopped;
  const std::stop_callback wake(options.stop, [&] { stopped.set_value(); });
  entered.set_value();
  stopped.get_future().wait();
}

class SessionTest : public testing::Test {
 protected:
  // One fake inverter per preparation.
  SessionHooks hooks(FakeInverter::Update update) {
    SessionHooks hooks;
    hooks.make_model = [this, update = std::move(update)](const SessionRequest& request,
                                                          const std::stop_token&) {
      prepared_boundaries_.push_back(request.boundary);
      return fake_session(std::make_unique<FakeInverter>(update), request);
    };
    hooks.publish = [this](UpdateMessage message, const Handled&) {
      published_.push(std::move(message));
    };
    return hooks;
  }

  static Status echo(int, const SparseData& data, const inversion::InversionOptions&,
                     Estimate& estimate) {
    return follow_the_data(data, estimate, 4);
  }

  static Result<SessionInfo> start(Session& session, Boundary boundary = Boundary::kContact,
                                   const std::string& case_id = kCase,
                                   bool publish_iterates = false) {
    auto promise = std::make_shared<std::promise<Result<SessionInfo>>>();
    auto future = promise->get_future();
    session.start({case_id, Method::kPaper, boundary, publish_iterates, false},
                  [promise](Result<SessionInfo> info) { promise->set_value(std::move(info)); });
    if (future.wait_for(10s) != std::future_status::ready) {
      return fail(ErrorCode::kInternal, "start was not answered");
    }
    return future.get();
  }

  std::vector<Boundary> prepared_boundaries_;  // written by the worker, read after its answers
  Published published_;
};

TEST_F(SessionTest, RefusesObservationsBeforeASessionRuns) {
  TestSession session(hooks(echo));
  const auto receipt = session.submit(landmarks(1));
  ASSERT_FALSE(receipt.has_value());
  EXPECT_EQ(receipt.error().code, ErrorCode::kModelNotReady);
  EXPECT_EQ(session.state().shared.session.session_id, 0u);
}

TEST_F(SessionTest, AnswersAnObservationWithItsUpdate) {
  TestSession session(hooks(echo));
  const auto info = start(session);
  ASSERT_TRUE(info.has_value());
  EXPECT_EQ(info->session_id, 1u);
  EXPECT_EQ(info->model_id, "0123456789abcdef");
  const auto receipt = session.submit(landmarks(5));
  ASSERT_TRUE(receipt.has_value());
  EXPECT_EQ(receipt->observation_sequence, 5u);
  EXPECT_FALSE(receipt->replaced_pending);
  const auto messages = published_.wait_for(1);
  ASSERT_EQ(messages.size(), 1u);
  EXPECT_FALSE(messages[0].error.has_value());
  EXPECT_EQ(messages[0].session_id, 1u);
  EXPECT_EQ(messages[0].update.sequence, 1u);
  EXPECT_EQ(messages[0].update.observation_sequence, 5u);
  EXPECT_EQ(session.state().updates, 1u);
}

TEST_F(SessionTest, AStartForAnotherCaseIsRefusedAndTheRunningSessionGoesOn) {
  TestSession session(hooks(echo));
  ASSERT_TRUE(start(session).has_value());
  const auto other = start(session, Boundary::kContact, "someone-else");
  ASSERT_FALSE(other.has_value());
  EXPECT_EQ(other.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(other.error().message, HasSubstr("\"someone-else\""));
  EXPECT_TRUE(session.submit(landmarks(1)).has_value());
}

TEST_F(SessionTest, SequenceNumbersMustGrow) {
  TestSession session(hooks(echo));
  ASSERT_TRUE(start(session).has_value());
  EXPECT_FALSE(session.submit(landmarks(0)).has_value());
  EXPECT_TRUE(session.submit(landmarks(4)).has_value());
  const auto late = session.submit(landmarks(3));
  ASSERT_FALSE(late.has_value());
  EXPECT_THAT(late.error().message, HasSubstr("observation.sequence = 3: must be above 4"));
  EXPECT_TRUE(session.submit(landmarks(9)).has_value());
}

// A camera that counts fast does not shut out the ultrasound.
TEST_F(SessionTest, EverySourceCountsForItself) {
  TestSession session(hooks(echo));
  ASSERT_TRUE(start(session).has_value());
  EXPECT_TRUE(session.submit(landmarks(50, "camera")).has_value());
  EXPECT_TRUE(session.submit(landmarks(6, "ius")).has_value());
  EXPECT_FALSE(session.submit(landmarks(49, "camera")).has_value());
  EXPECT_TRUE(session.submit(landmarks(7, "ius")).has_value());
}

TEST_F(SessionTest, ASequenceThatTheJournalCannotHoldIsRefusedAndLocksNothing) {
  TestSession session(hooks(echo));
  ASSERT_TRUE(start(session).has_value());
  for (const std::uint64_t sequence : {kMaxSequence + 1, ~std::uint64_t{0}}) {
    const auto refused = session.submit(landmarks(sequence));
    ASSERT_FALSE(refused.has_value());
    EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
    EXPECT_THAT(refused.error().message, HasSubstr("must be at most 9223372036854775807"));
  }
  EXPECT_TRUE(session.submit(landmarks(1)).has_value());
  EXPECT_TRUE(session.submit(landmarks(kMaxSequence)).has_value());
}

TEST_F(SessionTest, ANewSessionCountsFromTheStart) {
  TestSession session(hooks(echo));
  ASSERT_TRUE(start(session).has_value());
  ASSERT_TRUE(session.submit(landmarks(4)).has_value());
  published_.wait_for(1);
  const auto second = start(session);
  ASSERT_TRUE(second.has_value());
  EXPECT_EQ(second->session_id, 2u);
  EXPECT_TRUE(session.submit(in_session(2, landmarks(1))).has_value());
  const auto messages = published_.wait_for(2);
  ASSERT_EQ(messages.size(), 2u);
  EXPECT_EQ(messages[1].update.sequence, 1u);
  EXPECT_EQ(messages[1].session_id, 2u);
}

// What an earlier session observed and estimated is not used in the next one.
TEST_F(SessionTest, ANewSessionRemembersNothingOfAnEarlierOne) {
  std::vector<std::size_t> sources;
  FakeInverter* inverter = nullptr;
  SessionHooks watched = hooks(echo);
  watched.make_model = [&](const SessionRequest& request, const std::stop_token&) {
    auto made = std::make_unique<FakeInverter>(
        [&](int, const SparseData& data, const auto&, Estimate& out) {
          sources.push_back(data.sources.size());
          return follow_the_data(data, out, 4);
        });
    inverter = made.get();
    return fake_session(std::move(made), request);
  };
  TestSession session(std::move(watched));
  ASSERT_TRUE(start(session).has_value());
  ASSERT_TRUE(session.submit(landmarks(1, "ius")).has_value());
  published_.wait_for(1);
  ASSERT_TRUE(session.submit(landmarks(2, "pointer")).has_value());
  published_.wait_for(2);
  ASSERT_TRUE(start(session).has_value());
  ASSERT_TRUE(session.submit(in_session(2, landmarks(1, "pointer"))).has_value());
  ASSERT_EQ(published_.wait_for(3).size(), 3u);
  EXPECT_THAT(sources, ElementsAre(1u, 2u, 1u));
  EXPECT_EQ(inverter->resets, 2);  // one model for both sessions
}

TEST_F(SessionTest, TheLatestObservationOfASourceReplacesOneThatHasNotStarted) {
  Gate gate;
  TestSession session(hooks([&](int call, const SparseData& data, const auto&, Estimate& out) {
    if (call == 1) {
      gate.entered.set_value();
      gate.leave.get_future().wait();
    }
    return follow_the_data(data, out, 4);
  }));
  ASSERT_TRUE(start(session).has_value());
  ASSERT_TRUE(session.submit(landmarks(1, "ius")).has_value());
  gate.entered.get_future().wait();
  EXPECT_FALSE(session.submit(landmarks(2, "ius"))->replaced_pending);
  EXPECT_TRUE(session.submit(landmarks(3, "ius"))->replaced_pending);
  EXPECT_FALSE(session.submit(landmarks(4, "pointer"))->replaced_pending);
  EXPECT_TRUE(session.submit(landmarks(5, "ius"))->replaced_pending);
  EXPECT_TRUE(session.state().busy);
  gate.leave.set_value();
  const auto messages = published_.wait_for(3);
  ASSERT_EQ(messages.size(), 3u);
  std::vector<std::uint64_t> answered;
  for (const auto& message : messages) answered.push_back(message.update.observation_sequence);
  EXPECT_THAT(answered, ElementsAre(1, 4, 5));  // oldest first
}

TEST_F(SessionTest, TheNumberOfSourcesIsBounded) {
  Gate gate;
  TestSession session(hooks([&](int call, const SparseData& data, const auto&, Estimate& out) {
    if (call == 1) {
      gate.entered.set_value();
      gate.leave.get_future().wait();
    }
    return follow_the_data(data, out, 4);
  }));
  ASSERT_TRUE(start(session).has_value());
  ASSERT_TRUE(session.submit(landmarks(1)).has_value());
  gate.entered.get_future().wait();
  for (std::uint64_t i = 1; i < Sources::kMaxSources; ++i) {
    EXPECT_TRUE(session.submit(landmarks(2 + i, "source " + std::to_string(i))).has_value());
  }
  const auto refused = session.submit(landmarks(100, "one too many"));
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::kUnavailable);
  gate.leave.set_value();
}

TEST_F(SessionTest, AnErrorIsPublishedAndTheNextObservationIsAnswered) {
  TestSession session(
      hooks([](int call, const SparseData& data, const auto&, Estimate& out) -> Status {
        if (call == 1) return fail(ErrorCode::kNotConverged, "no luck");
        return follow_the_data(data, out, 4);
      }));
  ASSERT_TRUE(start(session).has_value());
  ASSERT_TRUE(session.submit(landmarks(1)).has_value());
  const auto failed = published_.wait_for(1);
  ASSERT_EQ(failed.size(), 1u);
  ASSERT_TRUE(failed[0].error.has_value());
  EXPECT_EQ(failed[0].error->message, "no luck");
  EXPECT_EQ(failed[0].update.observation_sequence, 1u);
  EXPECT_EQ(failed[0].update.case_id, kCase);
  EXPECT_EQ(session.state().updates, 0u);
  ASSERT_TRUE(session.submit(landmarks(2)).has_value());
  const auto messages = published_.wait_for(2);
  ASSERT_EQ(messages.size(), 2u);
  EXPECT_FALSE(messages[1].error.has_value());
}

TEST_F(SessionTest, AnExceptionCostsOneObservationOnly) {
  TestSession session(hooks([](int call, const SparseData& data, const auto&, Estimate& out) {
    if (call == 1) throw std::runtime_error("thrown");
    return follow_the_data(data, out, 4);
  }));
  ASSERT_TRUE(start(session).has_value());
  ASSERT_TRUE(session.submit(landmarks(1)).has_value());
  const auto failed = published_.wait_for(1);
  ASSERT_EQ(failed.size(), 1u);
  ASSERT_TRUE(failed[0].error.has_value());
  EXPECT_EQ(failed[0].error->code, ErrorCode::kInternal);
  ASSERT_TRUE(session.submit(landmarks(2)).has_value());
  EXPECT_EQ(published_.wait_for(2).size(), 2u);
}

TEST_F(SessionTest, ANewSessionEndsTheRunningInversionWhoseResultIsNotPublished) {
  std::promise<void> entered;
  TestSession session(
      hooks([&](int call, const SparseData& data, const auto& options, Estimate& out) {
        if (call == 1) wait_for_stop(options, entered);
        return follow_the_data(data, out, 4);
      }));
  ASSERT_TRUE(start(session).has_value());
  ASSERT_TRUE(session.submit(landmarks(1)).has_value());
  entered.get_future().wait();
  ASSERT_TRUE(start(session).has_value());
  ASSERT_TRUE(session.submit(in_session(2, landmarks(2))).has_value());
  const auto messages = published_.wait_for(1);
  ASSERT_EQ(messages.size(), 1u);
  EXPECT_EQ(messages[0].update.observation_sequence, 2u);
}

TEST_F(SessionTest, StopEndsARunningInversion) {
  std::promise<void> entered;
  TestSession session(hooks([&](int, const SparseData&, const auto& options, Estimate&) -> Status {
    wait_for_stop(options, entered);
    return fail(ErrorCode::kNotConverged, "stopped");
  }));
  ASSERT_TRUE(start(session).has_value());
  ASSERT_TRUE(session.submit(landmarks(1)).has_value());
  entered.get_future().wait();
  session.stop();
  session.stop();
  EXPECT_EQ(session.submit(landmarks(2)).error().code, ErrorCode::kModelNotReady);
  EXPECT_EQ(start(session).error().code, ErrorCode::kUnavailable);
}

TEST_F(SessionTest, EachBoundaryIsPreparedOnce) {
  TestSession session(hooks(echo));
  ASSERT_TRUE(start(session, Boundary::kContact).has_value());
  ASSERT_TRUE(start(session, Boundary::kFixed).has_value());
  ASSERT_TRUE(start(session, Boundary::kContact).has_value());
  EXPECT_THAT(prepared_boundaries_, ElementsAre(Boundary::kContact, Boundary::kFixed));
}

TEST_F(SessionTest, APreparationThatFailsIsReportedAndTriedAgain) {
  int attempts = 0;
  SessionHooks failing = hooks(echo);
  failing.make_model = [&, make = failing.make_model](
                           const SessionRequest& request,
                           const std::stop_token& stop) -> Result<std::unique_ptr<SessionModel>> {
    if (++attempts == 1) return fail(ErrorCode::kFloatingBody, "free to float");
    return make(request, stop);
  };
  TestSession session(std::move(failing));
  const auto first = start(session);
  ASSERT_FALSE(first.has_value());
  EXPECT_EQ(first.error().code, ErrorCode::kFloatingBody);
  EXPECT_EQ(session.submit(landmarks(1)).error().code, ErrorCode::kModelNotReady);
  EXPECT_TRUE(start(session).has_value());
}

TEST_F(SessionTest, ALaterStartAnswersAnEarlierOneThatIsStillPreparing) {
  std::promise<void> entered;
  std::promise<void> leave;
  SessionHooks slow = hooks(echo);
  bool first = true;
  slow.make_model = [&, make = slow.make_model](const SessionRequest& request,
                                                const std::stop_token& stop) {
    if (std::exchange(first, false)) {
      entered.set_value();
      leave.get_future().wait();
    }
    return make(request, stop);
  };
  TestSession session(std::move(slow));
  std::promise<Result<SessionInfo>> preparing;
  session.start({kCase, Method::kPaper, Boundary::kContact},
                [&](Result<SessionInfo> info) { preparing.set_value(std::move(info)); });
  entered.get_future().wait();
  EXPECT_TRUE(session.state().busy);
  std::promise<Result<SessionInfo>> later;
  session.start({kCase, Method::kPaper, Boundary::kFixed},
                [&](Result<SessionInfo> info) { later.set_value(std::move(info)); });
  leave.set_value();
  const auto superseded = preparing.get_future().get();
  ASSERT_FALSE(superseded.has_value());
  EXPECT_EQ(superseded.error().code, ErrorCode::kUnavailable);
  EXPECT_TRUE(later.get_future().get().has_value());
}

// A model that waits in its preparation until it is let go or stopped.
struct SlowPreparation {
  std::promise<void> entered;
  std::promise<void> leave;
  std::shared_future<void> left = leave.get_future().share();
  std::atomic<bool> stopped{false};

  // The second preparation waits.
  MakeSessionModel around(MakeSessionModel make) {
    return [this, make, call = std::make_shared<int>(0)](
               const SessionRequest& request,
               const std::stop_token& stop) -> Result<std::unique_ptr<SessionModel>> {
      if (++*call == 2) {
        const std::stop_callback wake(stop, [this] {
          stopped = true;
          leave.set_value();
        });
        entered.set_value();
        left.wait();
        if (stopped) return fail(ErrorCode::kUnavailable, "stopped");
      }
      return make(request, stop);
    };
  }
};

// One session runs, and the next one is being prepared.
class PreparingTest : public SessionTest {
 protected:
  void SetUp() override {
    SessionHooks watched = hooks(echo);
    watched.make_model = slow_.around(watched.make_model);
    session_ = std::make_unique<TestSession>(std::move(watched));
    std::promise<bool> first;
    session_->start({kCase, Method::kCondensed, Boundary::kContact},
                    [&](const auto& info) { first.set_value(info.has_value()); });
    ASSERT_TRUE(first.get_future().get());
    session_->start(
        {kCase, Method::kCondensed, Boundary::kFixed},
        [this](Result<SessionInfo> info) { next_.set_value(std::move(info)); }, "viewer");
    slow_.entered.get_future().wait();
  }

  SlowPreparation slow_;
  std::promise<Result<SessionInfo>> next_;
  std::unique_ptr<TestSession> session_;
};

TEST_F(PreparingTest, TheRunningSessionGoesOnUntilTheNextIsReady) {
  EXPECT_TRUE(session_->state().shared.preparing);
  ASSERT_TRUE(session_->submit(landmarks(1)).has_value());
  const auto messages = published_.wait_for(1);
  ASSERT_EQ(messages.size(), 1u);
  EXPECT_EQ(messages[0].session_id, 1u);
  slow_.leave.set_value();
  const auto info = next_.get_future().get();
  ASSERT_TRUE(info.has_value());
  EXPECT_EQ(info->key(), (SessionKey{kBootId, 2, kModelId}));
  EXPECT_FALSE(session_->submit(landmarks(2)).has_value()) << "the first session has ended";
  EXPECT_TRUE(session_->submit(in_session(2, landmarks(2))).has_value());
}

TEST_F(PreparingTest, StopEndsAPreparation) {
  session_->stop();
  EXPECT_TRUE(slow_.stopped);
  EXPECT_EQ(next_.get_future().get().error().code, ErrorCode::kUnavailable);
  EXPECT_EQ(session_->state().shared.phase, SessionPhase::kClosed);
}

TEST_F(PreparingTest, EndsWhenItsOwnerLeavesAndTheRunningSessionStays) {
  session_->leave("somebody else");
  EXPECT_FALSE(slow_.stopped);
  session_->leave("viewer");
  const auto refused = next_.get_future().get();
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(refused.error().message, HasSubstr("has left"));
  EXPECT_TRUE(session_->submit(landmarks(1)).has_value());
}

// A client that has lost the first answer asks again: nothing is estimated twice.
TEST_F(SessionTest, TheLastObservationOnceMoreGetsItsReceiptOnceMore) {
  std::atomic<int> calls{0};
  TestSession session(hooks([&](int, const SparseData& data, const auto&, Estimate& out) {
    ++calls;
    return follow_the_data(data, out, 4);
  }));
  ASSERT_TRUE(start(session).has_value());
  const auto first = session.submit(landmarks(4));
  ASSERT_TRUE(first.has_value());
  published_.wait_for(1);
  const auto again = session.submit(landmarks(4));
  ASSERT_TRUE(again.has_value());
  EXPECT_EQ(again->observation_sequence, 4u);
  EXPECT_EQ(again->replaced_pending, first->replaced_pending);
  ASSERT_TRUE(session.submit(landmarks(5)).has_value());
  ASSERT_EQ(published_.wait_for(2).size(), 2u);
  EXPECT_EQ(calls, 2);
  Observation other = landmarks(5);
  other.acquired_ns += 1;
  EXPECT_FALSE(session.submit(other).has_value()) << "the same number for another observation";
}

TEST_F(SessionTest, AnImplausibleClockIsRefusedAndAgesNobodyOut) {
  TestSession session(hooks(echo));
  ASSERT_TRUE(start(session).has_value());
  ASSERT_TRUE(session.submit(landmarks(1, "camera")).has_value());
  ASSERT_TRUE(session.submit(landmarks(1, "ius")).has_value());
  Observation ahead = landmarks(2, "ius");
  ahead.acquired_ns = 3'600'000'000'000;
  const auto refused = session.submit(ahead);
  ASSERT_FALSE(refused.has_value());
  EXPECT_THAT(refused.error().message, HasSubstr("jumped ahead"));
  EXPECT_TRUE(session.submit(landmarks(2, "ius")).has_value()) << "its number is still free";
}

// The clock of one source an hour ahead of the other's: both are as young as they are.
TEST_F(SessionTest, SourcesNeedNotShareAClock) {
  TestSession session(hooks(echo));
  ASSERT_TRUE(start(session).has_value());
  Observation camera = landmarks(1, "camera");
  camera.acquired_ns = 3'600'000'000'000;
  ASSERT_TRUE(session.submit(camera).has_value());
  ASSERT_EQ(published_.wait_for(1).size(), 1u);
  ASSERT_TRUE(session.submit(landmarks(1, "ius")).has_value());
  const auto messages = published_.wait_for(2);
  ASSERT_EQ(messages.size(), 2u);
  for (const Omission& omission : messages[1].update.left_out) {
    EXPECT_EQ(omission.part.find("source"), std::string::npos) << omission.reason;
  }
}

TEST_F(SessionTest, IteratesAreStreamedOnlyWhenAskedForAndCarryTheirUpdatesNumber) {
  const auto iterating = [](int, const SparseData& data, const auto& options, Estimate& out) {
    Estimate iterate;
    (void)follow_the_data(data, iterate, 4);
    iterate.status = EstimateStatus::kIterating;
    if (options.on_iterate) options.on_iterate(iterate);
    return follow_the_data(data, out, 4);
  };
  TestSession session(hooks(iterating));
  ASSERT_TRUE(start(session).has_value());
  ASSERT_TRUE(session.submit(landmarks(1)).has_value());
  ASSERT_EQ(published_.wait_for(1).size(), 1u);
  ASSERT_TRUE(start(session, Boundary::kContact, kCase, true).has_value());
  ASSERT_TRUE(session.submit(in_session(2, landmarks(1))).has_value());
  const auto messages = published_.wait_for(3);
  ASSERT_EQ(messages.size(), 3u);
  EXPECT_TRUE(messages[0].update.final);
  EXPECT_FALSE(messages[1].update.final);
  EXPECT_TRUE(messages[2].update.final);
  EXPECT_EQ(messages[1].update.sequence, messages[2].update.sequence);
}

}  // namespace
}  // namespace brainshift::server
