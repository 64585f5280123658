// SPDX-License-Identifier: Apache-2.0
#include "client/lib/session_watch.hpp"

#include <gmock/gmock.h>

#include <cmath>

namespace brainshift::client {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

const SessionKey kWatchedKey{7, 1, "model"};

SessionState tracking(std::uint64_t newest) {
  SessionState state;
  state.session = kWatchedKey;
  state.phase = SessionPhase::kTracking;
  state.newest_update = state.newest_usable = newest;
  state.age_ms = 100.0;
  state.valid_ms = 1000;
  return state;
}

class SessionWatchTest : public testing::Test {
 protected:
  FieldStatus judge(milliseconds at, std::uint64_t shown = 5,
                    const SessionKey& key = kWatchedKey) const {
    return watch_.judge(std::pair{key, shown}, "tcp://or:1", zero_ + at);
  }
  void hear(milliseconds asked, const SessionState& state) {
    watch_.asked(++id_, zero_ + asked);
    watch_.answered(id_, state);
  }

  SessionWatch watch_;
  SessionWatch::TimePoint zero_{std::chrono::hours(1)};
  std::uint64_t id_ = 0;
};

TEST_F(SessionWatchTest, AFieldIsCurrentForAsLongAsTheAnswerHoldsFromWhenItWasAskedFor) {
  EXPECT_EQ(judge(milliseconds(0)).currency, Currency::kStale);
  hear(milliseconds(0), tracking(5));
  const FieldStatus current = judge(milliseconds(999));
  EXPECT_EQ(current.currency, Currency::kCurrent);
  EXPECT_EQ(current.reason, "");
  EXPECT_NEAR(current.age_s, 0.1 + 0.999, 1e-9);
  const FieldStatus stale = judge(milliseconds(1500));
  EXPECT_EQ(stale.currency, Currency::kStale);
  EXPECT_EQ(stale.reason, "no word from tcp://or:1 for 1.5 s");
  EXPECT_NEAR(stale.age_s, 1.6, 1e-9);
}

// An answer that waited 30 s in a queue proves nothing about now.
TEST_F(SessionWatchTest, AnAnswerThatComesLateMakesNothingLookYounger) {
  watch_.asked(1, zero_);
  watch_.answered(1, tracking(5));
  watch_.asked(2, zero_ + milliseconds(200));
  EXPECT_EQ(judge(milliseconds(30'000)).currency, Currency::kStale);
  watch_.answered(2, tracking(5));
  EXPECT_EQ(judge(milliseconds(30'000)).currency, Currency::kStale);
}

TEST_F(SessionWatchTest, AStateThatNobodyAskedForIsNewsButNoProof) {
  hear(milliseconds(0), tracking(5));
  watch_.told(tracking(6));
  EXPECT_EQ(judge(milliseconds(500)).currency, Currency::kSuperseded);
  EXPECT_EQ(judge(milliseconds(500), 6).currency, Currency::kCurrent);
  EXPECT_EQ(judge(milliseconds(1500), 6).currency, Currency::kStale);
  watch_.answered(99, tracking(7));  // an answer to no question
  EXPECT_EQ(judge(milliseconds(500), 6).currency, Currency::kCurrent);
}

// The limits are the daemon's; a field ages between its answers too.
TEST_F(SessionWatchTest, AnOldFieldIsAgedThenExpiredAndNeverCurrent) {
  SessionState state = tracking(5);
  state.age_ms = 29'500.0;
  state.aged_after_ms = 30'000;
  state.expired_after_ms = 30'300;
  hear(milliseconds(0), state);
  EXPECT_EQ(judge(milliseconds(400)).currency, Currency::kCurrent);
  const FieldStatus aged = judge(milliseconds(600));
  EXPECT_EQ(aged.currency, Currency::kAged);
  EXPECT_EQ(aged.reason, "its data are 30.1 s old: 30 s at most");
  const FieldStatus expired = judge(milliseconds(900));
  EXPECT_EQ(expired.currency, Currency::kExpired);
  EXPECT_EQ(expired.reason, "its data are 30.4 s old: 30.3 s at most");
  state.newest_update = 6;
  state.reason = "no point";
  hear(milliseconds(0), state);
  EXPECT_EQ(judge(milliseconds(600)).currency, Currency::kDegraded);
  EXPECT_EQ(judge(milliseconds(900)).currency, Currency::kExpired);
}

TEST_F(SessionWatchTest, ARecordingIsToldWithEveryStatus) {
  SessionState state = tracking(5);
  hear(milliseconds(0), state);
  EXPECT_FALSE(judge(milliseconds(10)).recorded);
  state.recorded = true;
  hear(milliseconds(0), state);
  EXPECT_TRUE(judge(milliseconds(10)).recorded);
  EXPECT_TRUE(judge(milliseconds(5000)).recorded);
}

TEST_F(SessionWatchTest, AFailureSinceDegradesItWithItsReason) {
  SessionState state = tracking(5);
  state.newest_update = 6;
  state.phase = SessionPhase::kDegraded;
  state.reason = "no point is inside the brain";
  hear(milliseconds(0), state);
  const FieldStatus degraded = judge(milliseconds(10));
  EXPECT_EQ(degraded.currency, Currency::kDegraded);
  EXPECT_EQ(degraded.reason, "no point is inside the brain");
  EXPECT_GT(degraded.age_s, 0.1);
}

TEST_F(SessionWatchTest, AFieldNewerThanTheStateIsCurrentAndItsAgeIsNotKnown) {
  hear(milliseconds(0), tracking(5));
  const FieldStatus newer = judge(milliseconds(10), 6);
  EXPECT_EQ(newer.currency, Currency::kCurrent);
  EXPECT_TRUE(std::isnan(newer.age_s));
}

// Data that were 118 s on their way: nobody has to wait for the daemon's next word.
TEST_F(SessionWatchTest, AFieldNewerThanTheStateIsAsOldAsItsUpdateSays) {
  SessionState state = tracking(5);
  state.aged_after_ms = 30'000;
  hear(milliseconds(0), state);
  const auto judged = [&](double own_age_s) {
    return watch_.judge(std::pair{kWatchedKey, std::uint64_t{6}}, "e", zero_, own_age_s);
  };
  EXPECT_EQ(judged(118.0).currency, Currency::kAged);
  EXPECT_EQ(judged(118.0).age_s, 118.0);
  EXPECT_EQ(judged(1.0).currency, Currency::kCurrent);
}

TEST_F(SessionWatchTest, AFieldOfAnotherSessionOrDaemonIsNone) {
  hear(milliseconds(0), tracking(5));
  for (const SessionKey& key : {SessionKey{7, 2, "model"}, SessionKey{8, 1, "model"}}) {
    const FieldStatus none = judge(milliseconds(10), 5, key);
    EXPECT_EQ(none.currency, Currency::kNone);
    EXPECT_THAT(none.reason, HasSubstr("no usable field of the running session yet (tracking)"));
  }
}

TEST_F(SessionWatchTest, AnotherModelIsToldByName) {
  watch_.expect_model("mine");
  hear(milliseconds(0), tracking(5));
  EXPECT_FALSE(watch_.model_fits("model"));
  const FieldStatus none = judge(milliseconds(10));
  EXPECT_EQ(none.currency, Currency::kNone);
  EXPECT_THAT(none.reason, HasSubstr("serves model model, this viewer has loaded mine"));
}

TEST_F(SessionWatchTest, AnAnswerToARequestOfALostConnectionProvesNothing) {
  watch_.asked(1, zero_);
  watch_.lost();
  watch_.answered(1, tracking(5));
  EXPECT_EQ(judge(milliseconds(10)).currency, Currency::kStale);
}

}  // namespace
}  // namespace brainshift::client
