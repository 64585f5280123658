// SPDX-License-Identifier: Apache-2.0
#include "common/wire/published_update.hpp"

#include <gtest/gtest.h>

#include "brainshift/v1/brainshift.pb.h"
#include "tests/support/results.hpp"
#include "tests/unit/wire/refusals.hpp"
#include "tests/unit/wire/same_values.hpp"
#include "tests/unit/wire/sample_values.hpp"

namespace brainshift::wire {
namespace {

UpdateMessage usable_update() {
  UpdateMessage message = sample_judged_update();
  message.boot_id = 77;
  message.update.estimate.quality = {};
  message.update.estimate.quality.quality = Quality::kGood;
  return message;
}

PublishedUpdate opened(const UpdateMessage& message) {
  return value_or_fail(PublishedUpdate::open(encode(message)));
}

TEST(PublishedUpdate, SaysWhoseItIsAndWhetherItIsUsable) {
  const UpdateMessage message = usable_update();
  const PublishedUpdate update = opened(message);
  EXPECT_EQ(update.session(), message.key());
  EXPECT_EQ(update.sequence(), message.update.sequence);
  EXPECT_EQ(update.nodes(), 4);
  EXPECT_TRUE(update.usable());
  EXPECT_FALSE(opened(sample_judged_update()).usable()) << "unusable";
  EXPECT_FALSE(opened(sample_update()).usable()) << "an iterate";
  const PublishedUpdate failure = opened(sample_failure());
  EXPECT_FALSE(failure.usable());
  EXPECT_EQ(failure.nodes(), 0);
}

TEST(PublishedUpdate, APartHoldsItsColumnsAndEverythingElseOfTheUpdate) {
  UpdateMessage expected = usable_update();
  const PublishedUpdate update = opened(expected);
  const Estimate whole = expected.update.estimate;
  Estimate& part = expected.update.estimate;
  expected.update.part = FieldPart{4, {0, 3}, 0};
  part.displacement = whole.displacement(Eigen::all, std::vector<int>{0, 3});
  part.sd_mm = whole.sd_mm(std::vector<int>{0, 3});
  part.known = whole.known(std::vector<int>{0, 3});
  const auto received = value_or_fail(decode_update(update.cut(expected.update.part, true)));
  expect_same(received, expected);

  part.sd_mm.resize(0);
  part.known.resize(0);
  const auto without = value_or_fail(decode_update(update.cut(expected.update.part, false)));
  expect_same(without, expected);
}

TEST(PublishedUpdate, TheWholeFieldWithoutUncertaintyNamesNoNodes) {
  UpdateMessage expected = usable_update();
  const PublishedUpdate update = opened(expected);
  const auto whole = value_or_fail(decode_update(update.cut(std::nullopt, true)));
  expect_same(whole, expected);
  expected.update.estimate.sd_mm.resize(0);
  expected.update.estimate.known.resize(0);
  const auto received = value_or_fail(decode_update(update.cut(std::nullopt, false)));
  expect_same(received, expected);
}

TEST(PublishedUpdate, IsNotOpenedWhenItIsAPartOrMalformed) {
  UpdateMessage message = usable_update();
  const std::string payload = encode(message);
  expect_refused(PublishedUpdate::open(payload.substr(0, payload.size() - 3)), ErrorCode::kProtocol,
                 "payload");
  expect_refused(
      PublishedUpdate::open(changed<v1::Update>(payload, [](auto& m) { m.add_sd_mm(1.0f); })),
      ErrorCode::kProtocol, "12 displacement components, 5 standard deviations, 4 bytes");
  expect_refused(
      PublishedUpdate::open(changed<v1::Update>(payload, [](auto& m) { m.set_known("abc"); })),
      ErrorCode::kProtocol, "4 standard deviations, 3 bytes of what is known");
  expect_refused(PublishedUpdate::open(changed<v1::Update>(
                     payload, [](auto& m) { m.mutable_displacement()->add_xyz_mm(1.0f); })),
                 ErrorCode::kProtocol, "13 displacement components");
  message.update.part = FieldPart{9, {0, 1, 2, 8}, 0};
  expect_refused(PublishedUpdate::open(encode(message)), ErrorCode::kProtocol, "update.part");
}

}  // namespace
}  // namespace brainshift::wire
