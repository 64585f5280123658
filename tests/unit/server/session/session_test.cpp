// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/session/session.hpp"

#include <gmock/gmock.h>

#include <utility>
#include <vector>

#include "tests/support/results.hpp"
#include "tests/unit/server/fake_session.hpp"

namespace brainshift::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using namespace std::chrono_literals;

// Drives a session as the service does: one call after the other, by a clock of its own.
class SessionTest : public testing::Test {
 protected:
  static Status echo(int, const SparseData& data, const inversion::InversionOptions&,
                     Estimate& estimate) {
    return follow_the_data(data, estimate, 4);
  }

  // ----- what the session says, in words: "used ius 1", "begun 1", "changed tracking 1",
  // "answer viewer: session 1"
  void act() {
    const SessionEvents events = session_.take_events();
    for (const Decision& decision : events.decisions) {
      told_.push_back(std::string(to_string(decision.outcome)) + " " + decision.source + " " +
                      std::to_string(decision.observation_sequence));
      decisions_.push_back(decision);
    }
    if (events.begun) told_.push_back("begun " + std::to_string(events.begun->info.session_id));
    if (events.changed) {
      const SessionState now = state().shared;
      told_.push_back("changed " + std::string(to_string(now.phase)) + " " +
                      std::to_string(now.session.session_id) + (now.preparing ? " preparing" : ""));
    }
    for (const SessionEvents::Answer& answer : events.answers) {
      told_.push_back("answer " + answer.ticket.client + ": " +
                      (answer.info ? "session " + std::to_string(answer.info->session_id)
                                   : answer.info.error().message));
      answers_.push_back(answer.info);
    }
  }
  std::vector<std::string> told() { return std::exchange(told_, {}); }

  // ----- what clients do
  void ask(const SessionRequest& request, const std::string& client = "viewer") {
    session_.start(request, {client, 7});
    act();
  }
  Result<Admission> submit(Observation observation) {
    auto admission = session_.submit(std::move(observation), now_, {}, 0s);
    act();
    return admission;
  }

  // ----- what the service's threads do
  std::optional<Preparation> next_preparation() {
    auto preparation = session_.next_preparation();
    act();
    if (preparation) prepared_boundaries_.push_back(preparation->request.boundary);
    return preparation;
  }
  void prepare(const Preparation& preparation) {
    auto inverter = std::make_unique<FakeInverter>(
        [this](int call, const SparseData& data, const auto& options, Estimate& estimate) {
          return update_(call, data, options, estimate);
        });
    inverter_ = inverter.get();
    session_.prepared(fake_session(std::move(inverter), preparation.request));
    act();
  }
  void fail_to_prepare(const Error& error) {
    session_.prepared(tl::unexpected(error));
    act();
  }
  std::optional<Job> next_job() {
    auto job = session_.next_job(now_);
    act();
    return job;
  }
  static Result<Update> run(const Job& job) {
    return job.model->pipeline.run(job.observation, {{}, job.stop});
  }
  std::optional<UpdateMessage> finish(const Job& job, Result<Update> result) {
    auto message = session_.finish(job, std::move(result));
    act();
    if (message) told_.push_back("update " + std::to_string(message->update.sequence));
    return message;
  }
  // The next observation's message.
  UpdateMessage answer() {
    const auto job = next_job();
    EXPECT_TRUE(job.has_value());
    if (!job) return {};
    return finish(*job, run(*job)).value_or(UpdateMessage{});
  }
  // That of this one, when nothing else waits.
  UpdateMessage answer(const Observation& observation) {
    EXPECT_TRUE(submit(observation).has_value());
    return answer();
  }
  Session::State state() const { return session_.state(now_, 0s); }
  // A session that is asked for, made ready and begun.
  Result<SessionInfo> start(Boundary boundary = Boundary::kContact) {
    ask(request(boundary));
    if (const auto preparation = next_preparation()) prepare(*preparation);
    next_job();
    return answers_.empty() ? fail(ErrorCode::kInternal, "not answered") : answers_.back();
  }
  static SessionRequest request(Boundary boundary = Boundary::kContact,
                                Method method = Method::kPaper) {
    SessionRequest request;
    request.case_id = kCase;
    request.method = method;
    request.boundary = boundary;
    return request;
  }

  Session session_{kCase, kBootId, kModelId};
  Session::TimePoint now_{1h};
  FakeInverter::Update update_ = echo;
  FakeInverter* inverter_ = nullptr;  // of the newest model
  std::vector<Boundary> prepared_boundaries_;
  std::vector<std::string> told_;
  std::vector<Decision> decisions_;
  std::vector<Result<SessionInfo>> answers_;
};

class RunningSession : public SessionTest {
 protected:
  void SetUp() override {
    ASSERT_TRUE(start().has_value());
    told();
  }
};

TEST_F(SessionTest, RefusesObservationsBeforeASessionRuns) {
  EXPECT_EQ(submit(landmarks(1)).error().code, ErrorCode::kModelNotReady);
  EXPECT_EQ(state().shared.session.session_id, 0u);
  EXPECT_FALSE(next_preparation());
  EXPECT_FALSE(next_job());
  EXPECT_FALSE(state().busy);
  EXPECT_THAT(told(), IsEmpty());
}

TEST_F(RunningSession, AnswersAnObservationWithItsUpdate) {
  EXPECT_EQ(answers_.back()->key(), (SessionKey{kBootId, 1, kModelId}));
  const auto admission = value_or_fail(submit(landmarks(5)));
  EXPECT_EQ(admission.receipt.observation_sequence, 5u);
  EXPECT_FALSE(admission.receipt.replaced_pending);
  const UpdateMessage message = answer();
  EXPECT_FALSE(message.error.has_value());
  EXPECT_EQ(message.session_id, 1u);
  EXPECT_EQ(message.boot_id, kBootId);
  EXPECT_EQ(message.update.sequence, 1u);
  EXPECT_EQ(message.update.observation_sequence, 5u);
  EXPECT_EQ(state().updates, 1u);
}

// The journal begins before the state is told, and the state is told before the answer.
TEST_F(SessionTest, SaysWhatHappensInItsOrder) {
  ask(request());
  EXPECT_THAT(told(), ElementsAre("changed preparing 0"));
  const auto preparation = next_preparation();
  ASSERT_TRUE(preparation.has_value());
  EXPECT_FALSE(next_preparation()) << "it is handed out once";
  prepare(*preparation);
  EXPECT_THAT(told(), ElementsAre("begun 1", "changed ready 1", "answer viewer: session 1"));
  EXPECT_EQ(answer(landmarks(1)).update.sequence, 1u);
  EXPECT_THAT(told(), ElementsAre("used pointer 1", "update 1"));
  EXPECT_FALSE(next_job());
  EXPECT_THAT(told(), ElementsAre("changed tracking 1")) << "after the update that changed it";
}

TEST_F(RunningSession, AStartForAnotherCaseIsRefusedAndTheRunningSessionGoesOn) {
  SessionRequest other = request();
  other.case_id = "someone-else";
  ask(other);
  ASSERT_FALSE(answers_.back().has_value());
  EXPECT_EQ(answers_.back().error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(answers_.back().error().message, HasSubstr("\"someone-else\""));
  EXPECT_TRUE(submit(landmarks(1)).has_value());
}

TEST_F(RunningSession, AnotherClientEndsASessionOnlyByTakeoverOrWhenItsOwnerHasLeft) {
  SessionRequest again = request();
  ask(again, "another");
  EXPECT_EQ(answers_.back().error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(answers_.back().error().message, HasSubstr("belongs to another client"));
  EXPECT_EQ(state().owner, "viewer");
  again.takeover = true;
  ask(again, "another");
  EXPECT_FALSE(next_preparation()) << "its model is at hand";
  EXPECT_EQ(state().owner, "another");
  again.takeover = false;
  ask(again, "viewer");
  EXPECT_EQ(answers_.back().error().code, ErrorCode::kUnavailable);
  session_.leave("another");
  EXPECT_EQ(state().owner, "");
  ask(again, "viewer");
  EXPECT_FALSE(next_preparation());
  EXPECT_EQ(state().owner, "viewer");
  EXPECT_EQ(state().shared.session.session_id, 3u);
}

// ---------- what is accepted ----------

// The rules are those of sources.hpp.
TEST_F(RunningSession, WhatIsRefusedIsNotDecidedAndItsNumberIsStillFree) {
  Observation wrong = landmarks(1, "ius");
  wrong.acquired_ns = SourceClock::kMaxStamp_ns + 1;
  for (const Observation& refused : {landmarks(0, "ius"), wrong}) EXPECT_FALSE(submit(refused));
  EXPECT_FALSE(next_job());
  EXPECT_THAT(told(), IsEmpty());
  EXPECT_TRUE(submit(landmarks(1, "ius")));
}

// The clock of one source an hour ahead of the other's: both are as young as they are.
TEST_F(RunningSession, SourcesNeedNotShareAClock) {
  Observation camera = landmarks(1, "camera");
  camera.acquired_ns = 3'600'000'000'000;
  answer(camera);
  now_ += 1s;
  for (const Omission& omission : answer(landmarks(1, "ius")).update.left_out) {
    EXPECT_EQ(omission.part.find("source"), std::string::npos) << omission.reason;
  }
}

// A client that has lost the first answer asks again: nothing is estimated or decided twice.
TEST_F(RunningSession, TheLastObservationOnceMoreGetsItsReceiptOnceMore) {
  ASSERT_TRUE(submit(landmarks(3)));
  const auto first = value_or_fail(submit(landmarks(4)));
  EXPECT_TRUE(first.receipt.replaced_pending);
  answer();
  told();
  const auto again = value_or_fail(submit(landmarks(4)));
  EXPECT_TRUE(again.repeated);
  EXPECT_EQ(again.receipt.observation_sequence, 4u);
  EXPECT_TRUE(again.receipt.replaced_pending);
  EXPECT_FALSE(next_job());
  EXPECT_THAT(told(), ElementsAre("changed tracking 1"));
  Observation other = landmarks(4);
  other.acquired_ns += 1;
  EXPECT_FALSE(submit(other).has_value()) << "the same number for another observation";
}

// ---------- boxes and decisions ----------

TEST_F(RunningSession, TheLatestObservationOfASourceReplacesOneThatHasNotStarted) {
  ASSERT_TRUE(submit(landmarks(1, "ius")));
  const auto first = next_job();
  told();
  EXPECT_FALSE(submit(landmarks(2, "ius"))->receipt.replaced_pending);
  EXPECT_TRUE(submit(landmarks(3, "ius"))->receipt.replaced_pending);
  EXPECT_FALSE(submit(landmarks(4, "pointer"))->receipt.replaced_pending);
  EXPECT_TRUE(submit(landmarks(5, "ius"))->receipt.replaced_pending);
  EXPECT_TRUE(state().busy);
  finish(*first, run(*first));
  answer();
  answer();
  EXPECT_FALSE(next_job());
  EXPECT_THAT(told(), ElementsAre("superseded ius 2", "superseded ius 3", "used ius 1", "update 1",
                                  "changed tracking 1", "used pointer 4", "update 2", "used ius 5",
                                  "update 3"));
  EXPECT_THAT(decisions_[0].reason, HasSubstr("observation 3"));
  EXPECT_EQ(decisions_[0].update_sequence, 0u);
  EXPECT_EQ(decisions_[2].session_id, 1u);
  EXPECT_EQ(decisions_[2].update_sequence, 1u);
  EXPECT_TRUE(decisions_[2].reason.empty());
}

TEST_F(RunningSession, ASourceThatSendsOftenHasItsTurnToo) {
  std::vector<std::string> order;
  std::uint64_t sequence = 0;
  ASSERT_TRUE(submit(landmarks(++sequence, "left")));
  ASSERT_TRUE(submit(landmarks(++sequence, "right")));
  for (int i = 0; i < 10; ++i) {
    const auto job = next_job();
    order.push_back(job->observation.source);
    if (order.back() != "ius") {
      ASSERT_TRUE(submit(landmarks(++sequence, order.back())));
    }
    ASSERT_TRUE(submit(landmarks(++sequence, "ius")));
    finish(*job, run(*job));
  }
  EXPECT_THAT(order, ElementsAre("left", "right", "left", "ius", "right", "left", "ius", "right",
                                 "left", "ius"));
}

TEST_F(RunningSession, WhoWaitsForItsAnswersComesAfterOneJobOfThoseThatFlood) {
  std::vector<std::string> order;
  std::uint64_t sequence = 0;
  const auto flood = [&] {
    for (int i = 0; i < 2; ++i) {
      for (const char* source : {"a", "b", "c", "d"}) {
        ASSERT_TRUE(submit(landmarks(++sequence, source)));
      }
    }
  };
  flood();
  for (int i = 0; i < 8; ++i) {
    const auto job = next_job();
    order.push_back(job->observation.source);
    flood();
    if (order.back() != "z") {
      ASSERT_TRUE(submit(landmarks(++sequence, "z")));
    }
    finish(*job, run(*job));
  }
  EXPECT_THAT(order, ElementsAre("a", "z", "b", "z", "c", "z", "d", "z"));
}

TEST_F(RunningSession, AnErrorIsPublishedWithItsReasonAndTheNextObservationIsAnswered) {
  update_ = [](int call, const SparseData& data, const auto&, Estimate& out) -> Status {
    if (call == 1) return fail(ErrorCode::kNotConverged, "no luck");
    return follow_the_data(data, out, 4);
  };
  const UpdateMessage failed = answer(landmarks(1, "ius"));
  ASSERT_TRUE(failed.error.has_value());
  EXPECT_EQ(failed.error->message, "no luck");
  EXPECT_EQ(failed.update.observation_sequence, 1u);
  EXPECT_EQ(failed.update.case_id, kCase);
  EXPECT_EQ(failed.update.model_id, kModelId);
  EXPECT_TRUE(failed.update.final);
  EXPECT_THAT(told(), ElementsAre("failed ius 1", "update 1"));
  EXPECT_THAT(decisions_[0].reason, HasSubstr("no luck"));
  EXPECT_EQ(state().updates, 0u);
  EXPECT_EQ(state().shared.phase, SessionPhase::kDegraded);
  EXPECT_FALSE(answer(landmarks(2, "ius")).error.has_value());
  EXPECT_EQ(state().shared.phase, SessionPhase::kTracking);
}

TEST_F(RunningSession, AFieldThatCouldNotBePublishedIsAFailure) {
  answer(landmarks(1));
  ASSERT_TRUE(submit(landmarks(2)));
  const auto job = next_job();
  ASSERT_TRUE(job);
  ASSERT_TRUE(finish(*job, run(*job)));
  EXPECT_EQ(state().shared.newest_usable, 2u);
  const auto again = finish(*job, fail(ErrorCode::kInternal, "no memory"));
  ASSERT_TRUE(again);
  EXPECT_EQ(again->error->message, "no memory");
  EXPECT_EQ(state().shared.newest_update, 2u);
  EXPECT_EQ(state().shared.newest_usable, 1u) << "the one that was published";
}

TEST_F(RunningSession, AnUnusableFieldIsUsedUpAndTheOneBeforeItStays) {
  answer(landmarks(1));
  EXPECT_FALSE(answer(landmarks(2, "pointer", kMaxMotion_mm + 1.0)).update.usable());
  const SessionState now = state().shared;
  EXPECT_EQ(now.phase, SessionPhase::kDegraded);
  EXPECT_THAT(now.reason, HasSubstr("motion 51 mm"));
  EXPECT_EQ(now.newest_update, 2u);
  EXPECT_EQ(now.newest_usable, 1u);
  EXPECT_EQ(decisions_.back().outcome, Outcome::kUsed);
  EXPECT_EQ(decisions_.back().reason, now.reason);
  EXPECT_EQ(state().updates, 2u);
}

class LeavingTest : public RunningSession {
 protected:
  // One observation is at work and one waits while `end` ends the session.
  template <typename End>
  void skips_both(const End& end) {
    ASSERT_TRUE(submit(landmarks(1, "ius")));
    const auto job = next_job();
    ASSERT_TRUE(submit(landmarks(2, "ius")));
    end();
    EXPECT_TRUE(job->stop.stop_requested()) << "it ends early";
    EXPECT_FALSE(finish(*job, run(*job)).has_value()) << "nobody hears of its result";
    ASSERT_EQ(decisions_.size(), 2u);
    EXPECT_EQ(decisions_[0].observation_sequence, 2u);
    EXPECT_EQ(decisions_[1].observation_sequence, 1u);
    for (const Decision& decision : decisions_) {
      EXPECT_EQ(decision.outcome, Outcome::kSkipped);
      EXPECT_EQ(decision.session_id, 1u);
      EXPECT_EQ(decision.reason, "the session ended");
    }
    next_preparation();
    EXPECT_FALSE(next_job());
  }
};

TEST_F(LeavingTest, WhatANewSessionFindsIsSkippedAndNotPublished) {
  skips_both([&] { ask(request()), next_preparation(); });
  EXPECT_EQ(state().shared.session.session_id, 2u);
}

TEST_F(LeavingTest, WhatStopFindsIsSkippedAndNotPublished) {
  skips_both([&] { session_.stop(), session_.stop(), act(); });
  EXPECT_EQ(state().shared.phase, SessionPhase::kClosed);
}

// ---------- one session after the other ----------

TEST_F(RunningSession, ANewSessionCountsFromTheStart) {
  answer(landmarks(4));
  ASSERT_TRUE(start().has_value());
  EXPECT_EQ(answers_.back()->session_id, 2u);
  EXPECT_FALSE(submit(landmarks(5)).has_value()) << "the first session has ended";
  const UpdateMessage message = answer(in_session(2, landmarks(1)));
  EXPECT_EQ(message.update.sequence, 1u);
  EXPECT_EQ(message.session_id, 2u);
}

// What an earlier session observed and estimated is not used in the next one.
TEST_F(RunningSession, ANewSessionRemembersNothingOfAnEarlierOne) {
  std::vector<std::size_t> sources;
  update_ = [&](int, const SparseData& data, const auto&, Estimate& out) {
    sources.push_back(data.sources.size());
    return follow_the_data(data, out, 4);
  };
  answer(landmarks(1, "ius"));
  answer(landmarks(2, "pointer"));
  ASSERT_TRUE(start().has_value());
  answer(in_session(2, landmarks(1, "pointer")));
  EXPECT_THAT(sources, ElementsAre(1u, 2u, 1u));
  EXPECT_EQ(inverter_->resets, 2);  // one model for both sessions
}

TEST_F(SessionTest, EachBoundaryIsPreparedOnce) {
  for (const Boundary boundary : {Boundary::kContact, Boundary::kFixed, Boundary::kContact}) {
    ASSERT_TRUE(start(boundary).has_value());
  }
  EXPECT_THAT(prepared_boundaries_, ElementsAre(Boundary::kContact, Boundary::kFixed));
}

TEST_F(SessionTest, APreparationThatFailsIsReportedAndTriedAgain) {
  ask(request());
  ASSERT_TRUE(next_preparation());
  fail_to_prepare({ErrorCode::kFloatingBody, "free to float"});
  EXPECT_EQ(answers_.back().error().code, ErrorCode::kFloatingBody);
  EXPECT_EQ(state().shared.phase, SessionPhase::kEmpty);
  EXPECT_EQ(submit(landmarks(1)).error().code, ErrorCode::kModelNotReady);
  EXPECT_TRUE(start().has_value());
}

TEST_F(SessionTest, ALaterStartStopsAPreparationAndAnswersIt) {
  ask(request(Boundary::kContact));
  const auto first = next_preparation();
  EXPECT_TRUE(state().busy);
  ask(request(Boundary::kFixed));
  EXPECT_TRUE(first->stop.stop_requested());
  EXPECT_FALSE(next_preparation()) << "one at a time";
  ask(request(Boundary::kFixed));
  EXPECT_THAT(answers_.back().error().message, HasSubstr("another session was started"));
  told();
  prepare(*first);
  EXPECT_EQ(answers_.back().error().code, ErrorCode::kUnavailable);
  const auto second = next_preparation();
  ASSERT_TRUE(second.has_value());
  prepare(*second);
  EXPECT_TRUE(answers_.back().has_value());
  EXPECT_EQ(answers_.size(), 3u) << "each start is answered once";
}

// The update that is on its way to the viewers is told before the session that follows.
TEST_F(RunningSession, AReadySessionWaitsForTheJobAndALaterOneOvertakesIt) {
  answer(landmarks(1));
  ask(request());
  next_preparation();
  EXPECT_EQ(answers_.size(), 1u);
  ask(request(), "viewer");
  next_preparation();
  ASSERT_EQ(answers_.size(), 2u);
  EXPECT_EQ(answers_.back().error().code, ErrorCode::kUnavailable);
  told();
  EXPECT_FALSE(next_job());
  EXPECT_THAT(told(), ElementsAre("begun 2", "changed ready 2", "answer viewer: session 2"));
}

// ---------- while the next session is prepared ----------

class PreparingTest : public SessionTest {
 protected:
  void SetUp() override {
    ask(request(Boundary::kContact, Method::kCondensed), "first");
    prepare(*next_preparation());
    session_.leave("first");
    ask(request(Boundary::kFixed, Method::kCondensed));
    preparation_ = next_preparation();
    ASSERT_TRUE(preparation_.has_value());
    answers_.clear(), told_.clear();
  }
  std::optional<Preparation> preparation_;
};

TEST_F(PreparingTest, TheRunningSessionGoesOnUntilTheNextIsReady) {
  EXPECT_TRUE(state().shared.preparing);
  EXPECT_EQ(answer(landmarks(1)).session_id, 1u);
  next_job();
  prepare(*preparation_);
  ASSERT_TRUE(answers_.at(0).has_value());
  EXPECT_EQ(answers_[0]->key(), (SessionKey{kBootId, 2, kModelId}));
  EXPECT_FALSE(submit(landmarks(2)).has_value()) << "the first session has ended";
  EXPECT_TRUE(submit(in_session(2, landmarks(2))).has_value());
}

TEST_F(PreparingTest, StopEndsAPreparation) {
  session_.stop();
  act();
  EXPECT_TRUE(preparation_->stop.stop_requested());
  EXPECT_EQ(state().shared.phase, SessionPhase::kClosed);
  fail_to_prepare({ErrorCode::kUnavailable, "stopped"});
  EXPECT_EQ(answers_.at(0).error().code, ErrorCode::kUnavailable);
  EXPECT_EQ(submit(landmarks(1)).error().code, ErrorCode::kModelNotReady);
  ask(request());
  EXPECT_THAT(told(), ElementsAre("changed closed 0", "answer viewer: the daemon is stopping",
                                  "answer viewer: the daemon is stopping"));
}

TEST_F(PreparingTest, EndsWhenItsOwnerLeavesAndTheRunningSessionStays) {
  session_.leave("somebody else");
  EXPECT_FALSE(preparation_->stop.stop_requested());
  session_.leave("viewer");
  EXPECT_TRUE(preparation_->stop.stop_requested());
  fail_to_prepare({ErrorCode::kUnavailable, "stopped"});
  EXPECT_EQ(answers_.at(0).error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(answers_[0].error().message, HasSubstr("has left"));
  EXPECT_TRUE(submit(landmarks(1)).has_value());
}

TEST_F(PreparingTest, AStartThatWaitsForItIsAnsweredWhenItsOwnerLeaves) {
  ask(request(Boundary::kFixed), "viewer");
  session_.leave("viewer");
  act();
  EXPECT_THAT(answers_.at(0).error().message, HasSubstr("has left"));
  prepare(*preparation_);
  EXPECT_EQ(answers_.size(), 2u);
  EXPECT_FALSE(next_preparation());
}

// Only the condensed method needs no factor: every other session ends before the next is prepared.
TEST_F(RunningSession, AMethodWithAFactorEndsBeforeTheNextSessionIsPrepared) {
  ASSERT_TRUE(submit(landmarks(1)).has_value());
  const auto job = next_job();
  ask(request(Boundary::kFixed));
  EXPECT_FALSE(next_preparation()) << "the job still uses the factor";
  EXPECT_TRUE(job->stop.stop_requested());
  EXPECT_EQ(state().shared.phase, SessionPhase::kPreparing);
  EXPECT_FALSE(finish(*job, run(*job)).has_value());
  EXPECT_TRUE(next_preparation().has_value());
  session_.stop();
  act();
  EXPECT_EQ(answers_.size(), 1u) << "the second is answered when its preparation has ended";
}

// ---------- what is told of it ----------

// 118 s on the way, then waiting here, then the computer asleep: each is age.
TEST_F(RunningSession, AgeCountsFromAcquisitionAndWhileTheComputerSleeps) {
  Observation first = landmarks(1);
  first.acquired_ns = first.sent_ns = 1'000'000'000;
  answer(first);
  Observation late = landmarks(2);
  late.acquired_ns = 2'000'000'000;
  late.sent_ns = late.acquired_ns + 100'000'000'000;
  now_ += 101s;
  ASSERT_TRUE(session_.submit(late, now_, {}, 5s).has_value());
  act();
  answer();
  now_ += 3s;
  EXPECT_NEAR(session_.state(now_, 5s).shared.age_ms, 103e3, 1.0);
  EXPECT_NEAR(session_.state(now_, 605s).shared.age_ms, 703e3, 1.0);
}

TEST_F(SessionTest, ARecordingSaysSoAndItsMethodAndBoundary) {
  SessionRequest recorded = request(Boundary::kFixed);
  recorded.recorded_clock = true;
  ask(recorded);
  prepare(*next_preparation());
  next_job();
  const SessionState said = state().shared;
  EXPECT_TRUE(said.recorded);
  EXPECT_EQ(said.kind(), "RECORDED, paper, fixed");
  Observation old = landmarks(1);
  old.acquired_ns = 5;
  answer(old);
  now_ += 2s;
  EXPECT_EQ(state().shared.age_ms, 2e3) << "since it was played";
}

TEST_F(RunningSession, WorkIsTimedFromWhenItIsHandedOutUntilItIsPublished) {
  EXPECT_EQ(state().working_s, 0.0);
  EXPECT_GT(state().max_age_s, 0.0);
  ASSERT_TRUE(submit(landmarks(1)).has_value());
  now_ += 2s;
  const auto job = next_job();
  EXPECT_EQ(job->begun - job->arrived, 2s);
  now_ += 3s;
  EXPECT_EQ(state().working_s, 3.0);
  EXPECT_EQ(state().deadline_s, kNoDeadline_s);
  finish(*job, run(*job));
  EXPECT_EQ(state().working_s, 3.0) << "it is being published";
  next_job();
  EXPECT_EQ(state().working_s, 0.0);
  EXPECT_EQ(state().deadline_s, 0.0);
  EXPECT_EQ(state().shared.age_ms, 5000.0) << "since the observation arrived";
}

}  // namespace
}  // namespace brainshift::server
