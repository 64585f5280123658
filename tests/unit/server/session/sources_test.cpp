// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/session/sources.hpp"

#include <gmock/gmock.h>

#include <limits>
#include <string>

#include "tests/support/results.hpp"
#include "tests/unit/server/sample_values.hpp"

namespace brainshift::server {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kHour = 3600 * kSecond;
constexpr double kMaxAge_s = 120.0;

// ---------- what is well-formed ----------

TEST(CheckObservation, NamesTheRuleThatIsBroken) {
  const struct {
    void (*spoil)(Observation&);
    const char* says;
  } rows[] = {
      {[](Observation& o) { o.case_id = "x\ny"; }, "case_id = \"x?y\""},
      {[](Observation& o) { o.frame = "lps"; }, "frame = \"lps\""},
      {[](Observation& o) { o.source.clear(); }, "source"},
      {[](Observation& o) { o.source.assign(1000, 'a'); }, "1 to 64 characters"},
      {[](Observation& o) { o.source = "ius\u009b2J"; }, "\"ius?2J\": must have no control"},
      {[](Observation& o) { o.session = {}; }, "session is absent"},
      {[](Observation& o) { o.session.session_id = 0; }, "the running session is 1"},
      {[](Observation& o) { o.session.model_id = "x"; }, "model_id = \"x\""},
      {[](Observation& o) { o.session.boot_id = 1; }, "restarted"},
      {[](Observation& o) {
         o.body = TumourBoundary{Points::Zero(3, kMaxObservedPoints + 1), 0.5};
       },
       "tumour_boundary has 50001 points"},
      {[](Observation& o) {
         o.body = TumourBoundary{Points(3, 0), 0.5};
       },
       "tumour_boundary has 0 points, must be at least 3"},
      {[](Observation& o) {
         o.body = LandmarkPairs{Points::Zero(3, 2), Points::Zero(3, 2), 0.5};
       },
       "landmark_pairs has 2 pairs, must be at least 3"},
      {[](Observation& o) {
         o.body = CorticalSurface{{Points::Zero(3, kMaxObservedPoints + 1), {}}, 0.5};
       },
       "cortical_surface has 50001 points"},
      {[](Observation& o) {
         CorticalSurface surface{{Points::Zero(3, 3), {}}, 0.5};
         surface.surface.triangles.setZero(3, kMaxObservedTriangles + 1);
         o.body = surface;
       },
       "cortical_surface has 100001 triangles"},
      {[](Observation& o) {
         const Points points = Points::Zero(3, kMaxLandmarkPairs + 1);
         o.body = LandmarkPairs{points, points, 0.5};
       },
       "landmark_pairs has 1001 pairs, must be at most 1000"},
      {[](Observation& o) { o.body = PatientPose{}; }, "patient_pose"}};
  const SessionKey running{kBootId, 1, kModelId};
  ASSERT_TRUE(check_observation(landmarks(2), kCase, running));
  for (const auto& row : rows) {
    SCOPED_TRACE(row.says);
    Observation observation = landmarks(2);
    row.spoil(observation);
    EXPECT_THAT(
        refusal_of(check_observation(observation, kCase, running), ErrorCode::kInvalidArgument),
        testing::AllOf(HasSubstr(row.says), testing::Not(HasSubstr("\n"))));
  }
}

// ---------- clocks ----------

Observation seen(std::int64_t acquired_ns, std::int64_t sent_ns = 0) {
  Observation observation = landmarks(1, "ius");
  observation.acquired_ns = acquired_ns;
  observation.sent_ns = sent_ns;
  return observation;
}

void expect_refused(const Result<std::int64_t>& time, const std::string& why) {
  EXPECT_THAT(refusal_of(time, ErrorCode::kInvalidArgument), HasSubstr(why));
}

// Whatever the source's clock shows, only differences count.
TEST(SourceClock, TheFastestMessageSetsTheOffset) {
  for (const std::int64_t zero : {std::int64_t{0}, kHour, -kHour, 100'000 * kHour}) {
    SourceClock clock(kMaxAge_s);
    EXPECT_EQ(clock.to_daemon(seen(zero), 500 * kSecond).value(), 500 * kSecond);
    EXPECT_EQ(clock.to_daemon(seen(zero + 10 * kSecond), 512 * kSecond).value(), 510 * kSecond)
        << "2 s under way";
    EXPECT_EQ(clock.to_daemon(seen(zero + 20 * kSecond), 519 * kSecond).value(), 519 * kSecond)
        << "the first one took 1 s more";
    EXPECT_EQ(clock.to_daemon(seen(zero + 30 * kSecond), 530 * kSecond).value(), 529 * kSecond);
  }
}

TEST(SourceClock, AnOldDatumIsRefusedAndTheNextFreshOneIsTaken) {
  SourceClock clock(kMaxAge_s);
  ASSERT_TRUE(clock.to_daemon(seen(0), 0));
  expect_refused(clock.to_daemon(seen(kSecond), kHour), "3599 s old when it arrived");
  EXPECT_EQ(clock.to_daemon(seen(kHour), kHour + kSecond).value(), kHour);
}

TEST(SourceClock, WithTheTimeOfHandOverTheFirstOneCanBeRefusedToo) {
  SourceClock clock(kMaxAge_s);
  expect_refused(clock.to_daemon(seen(0, kHour), 5 * kSecond), "3600 s old when it arrived");
  expect_refused(clock.to_daemon(seen(kSecond, 0 - kSecond), 5 * kSecond), "2 s after it was sent");
  EXPECT_EQ(clock.to_daemon(seen(kHour, kHour + kSecond), 7 * kSecond).value(), 6 * kSecond);
}

TEST(SourceClock, OneStampThatIsAheadChangesNothing) {
  SourceClock clock(kMaxAge_s);
  ASSERT_TRUE(clock.to_daemon(seen(0), 0));
  expect_refused(clock.to_daemon(seen(kHour), kSecond), "jumped ahead by 3599 s");
  EXPECT_EQ(clock.to_daemon(seen(2 * kSecond), 2 * kSecond).value(), 2 * kSecond);
}

TEST(SourceClock, ASourceThatHasSetItsClockIsFollowed) {
  SourceClock clock(kMaxAge_s);
  ASSERT_TRUE(clock.to_daemon(seen(0), 0));
  EXPECT_FALSE(clock.to_daemon(seen(kHour), kSecond));
  EXPECT_EQ(clock.to_daemon(seen(kHour + kSecond), 2 * kSecond).value(), 2 * kSecond);
}

TEST(SourceClock, WhatWasAcquiredBeforeTheLastOneIsRefused) {
  SourceClock clock(kMaxAge_s);
  ASSERT_TRUE(clock.to_daemon(seen(10 * kSecond), 10 * kSecond));
  expect_refused(clock.to_daemon(seen(8 * kSecond), 11 * kSecond), "2 s before the one before it");
  EXPECT_TRUE(clock.to_daemon(seen(10 * kSecond), 12 * kSecond)) << "the same instant is no error";
}

TEST(SourceClock, StampsThatNoClockShowsAreRefused) {
  using Limits = std::numeric_limits<std::int64_t>;
  for (const std::int64_t stamp : {Limits::min(), Limits::max(), SourceClock::kMaxStamp_ns + 1}) {
    SourceClock clock(kMaxAge_s);
    expect_refused(clock.to_daemon(seen(stamp), 0), "acquired_ns");
    expect_refused(clock.to_daemon(seen(0, stamp), 0), "sent_ns");
    expect_refused(recorded_time(seen(stamp)), "acquired_ns");
  }
  EXPECT_EQ(recorded_time(seen(-kHour)).value(), -kHour);
}

// ---------- sources ----------

Observation with_stamp(Observation observation, std::int64_t acquired_ns) {
  observation.acquired_ns = acquired_ns;
  return observation;
}

TEST(Sources, WhatIsRefusedTakesNoPlaceAndNoNumber) {
  Sources sources(120.0, false);
  const std::int64_t never = std::numeric_limits<std::int64_t>::max();
  for (std::size_t i = 0; i < 3 * Sources::kMaxSources; ++i) {
    const std::string name = "source " + std::to_string(i);
    EXPECT_FALSE(sources.admit(with_stamp(landmarks(5, name), never), 0, false));
    EXPECT_FALSE(sources.admit(landmarks(0, name), 0, false)) << "no receipt of what never came";
  }
  for (std::size_t i = 0; i < Sources::kMaxSources; ++i) {
    EXPECT_TRUE(sources.admit(landmarks(1, "source " + std::to_string(i)), 0, false));
  }
  EXPECT_THAT(
      refusal_of(sources.admit(landmarks(1, "one too many"), 0, false), ErrorCode::kUnavailable),
      HasSubstr("16 other sources"));
  EXPECT_TRUE(sources.admit(landmarks(2, "source 0"), 0, false)) << "those known go on";
}

// Each source counts for itself: a camera that counts fast does not shut out the ultrasound. The
// journal cannot hold numbers above kMaxSequence; one of those locks nothing.
TEST(Sources, ASequenceNumberMustBeAboveTheLastOneOfItsSource) {
  Sources sources(kMaxAge_s, false);
  const auto refused = [&](std::uint64_t sequence, const char* source, const char* says) {
    EXPECT_THAT(refusal_of(sources.admit(landmarks(sequence, source), 0, false),
                           ErrorCode::kInvalidArgument),
                HasSubstr(says))
        << sequence;
  };
  const auto taken = [&](std::uint64_t sequence, const char* source) {
    return sources.admit(landmarks(sequence, source), 0, false).has_value();
  };
  refused(0, "ius", "observation.sequence = 0: must be above 0");
  EXPECT_TRUE(taken(4, "ius"));
  refused(3, "ius", "observation.sequence = 3: must be above 4");
  EXPECT_TRUE(taken(9, "ius"));
  EXPECT_TRUE(taken(50, "camera"));
  EXPECT_TRUE(taken(10, "ius"));
  refused(49, "camera", "must be above 50");
  for (const std::uint64_t beyond : {Sources::kMaxSequence + 1, ~std::uint64_t{0}}) {
    refused(beyond, "ius", "must be at most 9223372036854775807");
  }
  EXPECT_TRUE(taken(11, "ius"));
  EXPECT_TRUE(taken(Sources::kMaxSequence, "ius"));
}

TEST(Sources, ARepetitionGetsTheFirstReceiptAndChangesNothing) {
  Sources sources(120.0, false);
  ASSERT_TRUE(sources.admit(landmarks(4), 0, true));
  const auto again = value_or_fail(sources.admit(landmarks(4), kHour, false));
  EXPECT_TRUE(again.repeated);
  EXPECT_EQ(again.receipt.observation_sequence, 4u);
  EXPECT_TRUE(again.receipt.replaced_pending);
  EXPECT_FALSE(sources.admit(landmarks(3), 0, false));
  EXPECT_FALSE(sources.admit(landmarks(5), 0, false)->repeated);
}

TEST(Sources, EachHasAClockOfItsOwnAndFollowsOneThatWasSet) {
  Sources sources(120.0, false);
  EXPECT_EQ(sources.admit(with_stamp(landmarks(1, "ius"), kHour), 7, false)->daemon_ns, 7);
  EXPECT_EQ(sources.admit(with_stamp(landmarks(1, "camera"), 0), 9, false)->daemon_ns, 9);
  EXPECT_FALSE(sources.admit(with_stamp(landmarks(2, "camera"), kHour), 10, false));
  EXPECT_EQ(sources.admit(with_stamp(landmarks(2, "camera"), kHour + 1), 11, false)->daemon_ns, 11);
}

TEST(Sources, OneThatWasStartedAgainIsToldItsNumberAndHasANewClock) {
  Sources sources(kMaxAge_s, false);
  ASSERT_TRUE(sources.admit(with_stamp(landmarks(57, "ius"), kHour), kHour, false, "first run"));
  EXPECT_THAT(refusal_of(sources.admit(with_stamp(landmarks(1, "ius"), 3), kHour + kSecond, false,
                                       "second run"),
                         ErrorCode::kInvalidArgument),
              HasSubstr("a source that was started again numbers on from 58"));
  EXPECT_FALSE(
      sources.admit(with_stamp(landmarks(58, "ius"), 3), kHour + kSecond, false, "first run"))
      << "a clock that runs backwards in one run";
  const auto admitted = value_or_fail(
      sources.admit(with_stamp(landmarks(58, "ius"), 3), kHour + kSecond, false, "second run"));
  EXPECT_EQ(admitted.daemon_ns, kHour + kSecond);
}

TEST(Sources, InventedNamesKeepNoSourceOut) {
  Sources sources(kMaxAge_s, false);
  const auto admit = [&](const std::string& name, std::int64_t now_ns, const std::string& client) {
    return sources.admit(with_stamp(landmarks(1, name), now_ns), now_ns, false, client);
  };
  for (int i = 0; i < Sources::kMaxSourcesOfOne; ++i) {
    ASSERT_TRUE(admit("invented " + std::to_string(i), i, "joker"));
  }
  EXPECT_THAT(refusal_of(admit("one more", 9, "joker"), ErrorCode::kUnavailable),
              HasSubstr("from this connection"));
  for (int i = 0; i < 8; ++i) {
    ASSERT_TRUE(admit("other " + std::to_string(i), kSecond, "bridge"));
  }
  EXPECT_THAT(refusal_of(admit("real", 2 * kSecond, "camera"), ErrorCode::kUnavailable),
              HasSubstr("in the last 120 s"));
  EXPECT_TRUE(admit("real", 121 * kSecond, "camera")) << "those that are silent make room";
}

TEST(Sources, OfARecordingShareItsClock) {
  Sources sources(120.0, true);
  EXPECT_EQ(sources.admit(with_stamp(landmarks(1, "ius"), kHour), 7, false)->daemon_ns, kHour);
  EXPECT_EQ(sources.admit(with_stamp(landmarks(2, "ius"), 3), 8, false)->daemon_ns, 3)
      << "a replay that begins again";
}

}  // namespace
}  // namespace brainshift::server
