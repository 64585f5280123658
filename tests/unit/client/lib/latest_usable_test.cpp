// SPDX-License-Identifier: Apache-2.0
#include "client/lib/latest_usable.hpp"

#include <gtest/gtest.h>

namespace brainshift::client {
namespace {

SessionKey key(std::uint64_t session, std::uint64_t boot = 1) { return {boot, session, "m"}; }

UpdateMessage update(std::uint64_t session, std::uint64_t sequence,
                     Quality quality = Quality::kGood, bool final = true) {
  UpdateMessage message;
  message.session_id = session;
  message.boot_id = 1;
  message.update.model_id = "m";
  message.update.sequence = sequence;
  message.update.final = final;
  message.update.estimate.quality.quality = quality;
  return message;
}

std::uint64_t sequence_of(const LatestUsable& latest) {
  return latest.get() ? latest.get()->update.sequence : 0;
}

TEST(LatestUsable, IsEmptyUntilAUsableUpdateComes) {
  LatestUsable latest;
  EXPECT_FALSE(latest.get());
  latest.take(update(1, 1, Quality::kUnusable));
  EXPECT_FALSE(latest.get());
  latest.take(update(1, 2, Quality::kCaution));
  EXPECT_EQ(sequence_of(latest), 2u);
}

TEST(LatestUsable, OnlyAnotherUsableUpdateReplacesIt) {
  LatestUsable latest;
  latest.take(update(1, 1));
  latest.take(update(1, 2, Quality::kUnusable));
  latest.take(update(1, 3, Quality::kNotJudged));
  latest.take(update(1, 4, Quality::kGood, false));
  auto failed = update(1, 5);
  failed.error = Error{ErrorCode::kEmptySet, "no point"};
  latest.take(failed);
  EXPECT_EQ(sequence_of(latest), 1u);
  latest.take(update(1, 6));
  EXPECT_EQ(sequence_of(latest), 6u);
}

TEST(LatestUsable, OfAnotherSessionIsForgottenAndDoesNotComeBack) {
  LatestUsable latest;
  latest.begin(key(4));
  latest.take(update(4, 9));
  latest.take(update(5, 1, Quality::kUnusable));  // another client has started session 5
  EXPECT_FALSE(latest.get());
  latest.take(update(4, 10));
  EXPECT_FALSE(latest.get());
  latest.take(update(5, 2));
  EXPECT_EQ(sequence_of(latest), 2u);
}

// Session numbers of a restarted daemon begin again.
TEST(LatestUsable, BeginForgetsWhateverTheNumber) {
  LatestUsable latest;
  latest.begin(key(7));
  latest.take(update(7, 3));
  latest.follow(key(7));  // subscribed again
  EXPECT_EQ(sequence_of(latest), 3u);
  latest.begin(key(7));
  EXPECT_FALSE(latest.get());
  latest.take(update(7, 4));
  latest.follow(key(1));
  EXPECT_FALSE(latest.get());
  latest.take(update(1, 1));
  EXPECT_EQ(sequence_of(latest), 1u);
}

TEST(LatestUsable, OfAnotherDaemonIsNotTakenUntilThatOneIsFollowed) {
  LatestUsable latest;
  latest.begin(key(1));
  latest.take(update(1, 1));
  auto foreign = update(9, 1);
  foreign.boot_id = 2;
  EXPECT_FALSE(latest.belongs(foreign.key()));
  latest.take(foreign);
  EXPECT_EQ(latest.get()->boot_id, 1u);
  latest.follow(key(9, 2));
  EXPECT_FALSE(latest.get());
  latest.take(foreign);
  EXPECT_EQ(latest.get()->boot_id, 2u);
}

}  // namespace
}  // namespace brainshift::client
