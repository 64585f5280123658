// SPDX-License-Identifier: GPL-3.0-or-later
// What a subscriber gets, and when: credit instead of queues.
#include <gmock/gmock.h>

#include <memory>
#include <string>
#include <vector>

#include "server/delivery/viewer.hpp"

namespace brainshift::server {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

Bytes bytes(const std::string& text) { return std::make_shared<const std::string>(text); }

// Everything that goes out now.
std::vector<std::string> sent_by(Viewer& viewer) {
  std::vector<std::string> texts;
  while (const Bytes next = viewer.next()) {
    texts.push_back(*next);
    viewer.sent();
  }
  return texts;
}

Viewer viewer_with(std::uint32_t window) {
  Viewer viewer;
  EXPECT_TRUE(viewer.renew({1, window, 0}));
  return viewer;
}

TEST(Viewer, GetsOneUpdateAndThenTheNewestOnlyOnceItHasReceivedThat) {
  Viewer viewer = viewer_with(1);
  viewer.owe_usable(bytes("1"));
  EXPECT_THAT(sent_by(viewer), ElementsAre("1"));
  for (const char* text : {"2", "3", "4"}) viewer.owe_usable(bytes(text));
  EXPECT_THAT(sent_by(viewer), IsEmpty());
  EXPECT_FALSE(viewer.renew({1, 1, 0}));  // has not received it yet
  EXPECT_THAT(sent_by(viewer), IsEmpty());
  EXPECT_FALSE(viewer.renew({1, 1, 1}));
  EXPECT_THAT(sent_by(viewer), ElementsAre("4"));
}

TEST(Viewer, GetsEveryUpdateWhileItsWindowHasRoom) {
  Viewer viewer = viewer_with(3);
  for (const char* text : {"1", "2", "3", "4", "5"}) {
    viewer.owe_usable(bytes(text));
    const auto texts = sent_by(viewer);
    EXPECT_EQ(texts.size(), *text <= '3' ? 1u : 0u) << text;
  }
  viewer.renew({1, 3, 2});
  EXPECT_THAT(sent_by(viewer), ElementsAre("5"));
}

TEST(Viewer, IsOwedTheNewestUsableFieldHoweverManyFailuresFollow) {
  Viewer viewer = viewer_with(1);
  viewer.owe_usable(bytes("f0"));
  EXPECT_THAT(sent_by(viewer), ElementsAre("f0"));
  viewer.owe_usable(bytes("f1"));
  for (const char* text : {"e2", "e3", "e4"}) viewer.owe_failure(bytes(text));
  viewer.renew({1, 2, 1});
  EXPECT_THAT(sent_by(viewer), ElementsAre("f1", "e4"));
  viewer.owe_failure(bytes("e5"));
  viewer.owe_usable(bytes("f6"));  // the failure before it is over
  viewer.renew({1, 2, 3});
  EXPECT_THAT(sent_by(viewer), ElementsAre("f6"));
}

TEST(Viewer, AnotherSubscriptionBeginsAnewAndIsOwedNothing) {
  Viewer viewer = viewer_with(1);
  viewer.owe_usable(bytes("1"));
  EXPECT_THAT(sent_by(viewer), ElementsAre("1"));
  viewer.owe_usable(bytes("2"));
  EXPECT_TRUE(viewer.renew({2, 1, 0}));
  EXPECT_THAT(sent_by(viewer), IsEmpty());
  viewer.owe_usable(bytes("3"));
  EXPECT_THAT(sent_by(viewer), ElementsAre("3"));
}

TEST(Viewer, AnotherChoiceBeginsAnewAndHoldsNothing) {
  const auto chosen = std::make_shared<const Selection>();
  Viewer viewer;
  const Subscription subscription{1, 1, 0, {.tolerance_mm = 0.1}};
  EXPECT_TRUE(viewer.renew(subscription, chosen));
  viewer.owe_usable(bytes("field"));
  viewer.sent(std::make_shared<const HeldField>());
  EXPECT_FALSE(viewer.renew(subscription, chosen));
  EXPECT_EQ(viewer.selection(), chosen);
  EXPECT_TRUE(viewer.held());
  EXPECT_TRUE(viewer.renew({1, 1, 0, {.tolerance_mm = 0.2}}, chosen));
  EXPECT_FALSE(viewer.held());
  viewer.owe_usable(bytes("field"));
  viewer.sent(std::make_shared<const HeldField>());
  EXPECT_TRUE(viewer.renew({2, 1, 0, {.tolerance_mm = 0.2}}, chosen));
  EXPECT_FALSE(viewer.held());
}

TEST(Viewer, CannotClaimMoreThanWasSentNorTakeBackWhatItReceived) {
  Viewer viewer = viewer_with(1);
  viewer.renew({1, 1, 1000});
  viewer.owe_usable(bytes("1"));
  EXPECT_THAT(sent_by(viewer), ElementsAre("1"));
  viewer.owe_usable(bytes("2"));
  EXPECT_THAT(sent_by(viewer), IsEmpty());
  viewer.renew({1, 1, 1});
  EXPECT_THAT(sent_by(viewer), ElementsAre("2"));
  viewer.renew({1, 1, 2});
  viewer.renew({1, 1, 0});
  viewer.owe_usable(bytes("3"));
  EXPECT_THAT(sent_by(viewer), ElementsAre("3"));
}

TEST(Viewer, AnIterateNeverTakesTheLastCreditOfAFinalUpdate) {
  Viewer viewer = viewer_with(3);
  EXPECT_TRUE(viewer.may_iterate());
  viewer.iterate_sent();
  viewer.iterate_sent();
  EXPECT_FALSE(viewer.may_iterate());
  viewer.owe_usable(bytes("f"));
  EXPECT_THAT(sent_by(viewer), ElementsAre("f"));
  viewer.renew({1, 3, 3});
  viewer.owe_usable(bytes("g"));
  EXPECT_FALSE(viewer.may_iterate()) << "nothing may overtake what is owed";
}

}  // namespace
}  // namespace brainshift::server
