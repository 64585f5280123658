// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/wire/convert.hpp"

#include <gmock/gmock.h>

#include "brainshift/v1/decision.pb.h"
#include "tests/support/results.hpp"

namespace brainshift::wire {
namespace {

using testing::HasSubstr;

TEST(Decision, ComesBackAsItWasWritten) {
  for (const Outcome outcome :
       {Outcome::kUsed, Outcome::kFailed, Outcome::kSuperseded, Outcome::kSkipped}) {
    const Decision decision{7, "ius", (1ull << 63) - 1, outcome, 12, 657, "the session ended"};
    const auto decoded = value_or_fail(decode_decision(encode(decision)));
    EXPECT_EQ(decoded, decision);
  }
}

TEST(Decision, WhatNobodyDecidesIsRefused) {
  v1::Decision message;
  message.set_outcome("forgotten");
  EXPECT_THAT(refusal_of(decode_decision(message.SerializeAsString()), ErrorCode::kProtocol),
              HasSubstr("decision.outcome: \"forgotten\""));
  message.set_outcome("used");
  message.set_active(1u << 31);
  EXPECT_THAT(decode_decision(message.SerializeAsString()).error().message,
              HasSubstr("decision.active"));
  EXPECT_FALSE(decode_decision("\xff\xff"));
}

}  // namespace
}  // namespace brainshift::wire
