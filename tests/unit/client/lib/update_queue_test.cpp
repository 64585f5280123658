// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "client/lib/update_queue.hpp"

namespace brainshift::client {
namespace {

UpdateMessage queued_update(std::uint64_t sequence, bool final) {
  UpdateMessage message;
  message.update.sequence = sequence;
  message.update.final = final;
  return message;
}

std::vector<std::uint64_t> drain(UpdateQueue& queue) {
  std::vector<std::uint64_t> sequences;
  while (auto entry = queue.pop()) sequences.push_back(*entry ? (*entry)->update.sequence : 0);
  return sequences;
}

TEST(UpdateQueue, KeepsTheOrderOfArrival) {
  UpdateQueue queue(10);
  for (std::uint64_t i = 1; i <= 5; ++i) queue.push(queued_update(i, i % 2 == 0));
  EXPECT_EQ(drain(queue), (std::vector<std::uint64_t>{1, 2, 3, 4, 5}));
}

TEST(UpdateQueue, WhenFullTheOldestIterateGivesWay) {
  UpdateQueue queue(3);
  queue.push(queued_update(1, true));
  queue.push(queued_update(2, false));
  queue.push(queued_update(3, false));
  queue.push(queued_update(4, false));
  EXPECT_EQ(queue.size(), 3u);
  EXPECT_EQ(drain(queue), (std::vector<std::uint64_t>{1, 3, 4}));
}

TEST(UpdateQueue, FinalUpdatesAndErrorsAreNeverDropped) {
  UpdateQueue queue(2);
  queue.push(queued_update(1, true));
  queue.push(fail(ErrorCode::kProtocol, "bad"));
  auto failed = queued_update(3, false);
  failed.error = Error{ErrorCode::kEmptySet, "no point"};
  queue.push(failed);
  queue.push(queued_update(4, true));
  queue.push(queued_update(5, false));  // the only one that may go
  EXPECT_EQ(drain(queue), (std::vector<std::uint64_t>{1, 0, 3, 4}));
}

TEST(UpdateQueue, WhatTheDaemonHasNewerIsDropped) {
  UpdateQueue queue(10);
  const auto usable = [](std::uint64_t sequence, std::uint64_t session) {
    UpdateMessage message = queued_update(sequence, true);
    message.session_id = session;
    message.update.estimate.quality.quality = Quality::kGood;
    return message;
  };
  UpdateMessage failure = queued_update(4, true);
  failure.session_id = 2;
  failure.error = Error{ErrorCode::kEmptySet, "no point"};
  UpdateMessage last = failure;
  last.update.sequence = 5;
  for (const auto& message : {usable(9, 1), usable(2, 2), usable(3, 2), failure, last}) {
    queue.push(message);
  }
  queue.push(fail(ErrorCode::kProtocol, "bad"));
  SessionState state;
  state.session = {0, 2, ""};
  state.newest_usable = 3;
  state.newest_update = 5;
  queue.drop_older_than(state);
  EXPECT_EQ(drain(queue), (std::vector<std::uint64_t>{3, 5, 0}));
}

TEST(UpdateQueue, IteratesAloneNeverExceedTheCapacity) {
  UpdateQueue queue(4);
  for (std::uint64_t i = 1; i <= 1000; ++i) {
    queue.push(queued_update(i, false));
    EXPECT_LE(queue.size(), 4u);
  }
  EXPECT_EQ(drain(queue), (std::vector<std::uint64_t>{997, 998, 999, 1000}));
}

}  // namespace
}  // namespace brainshift::client
