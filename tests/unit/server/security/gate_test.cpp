// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/security/gate.hpp"

#include <gmock/gmock.h>

#include <string>
#include <utility>
#include <vector>

#include "common/wire/convert.hpp"
#include "tests/support/results.hpp"

namespace brainshift::server {
namespace {

using testing::HasSubstr;
using wire::MessageType;

const Gate::TimePoint kNow{};

Roles everyone() {
  std::map<std::string, Role> roles;
  for (const Role role : kAllRoles) roles.emplace(std::string(to_string(role)), role);
  return roles;
}

wire::Frame frame(MessageType type, const std::string& payload = {}) { return {type, 1, payload}; }

std::string start(bool takeover) {
  SessionRequest request;
  request.case_id = "c";
  request.takeover = takeover;
  return wire::encode(request);
}

TEST(Gate, EveryRoleMayDoItsPartAndNoMore) {
  const std::string plain = start(false);
  const std::string takeover = start(true);
  const std::vector<std::pair<wire::Frame, Role>> needs = {
      {frame(MessageType::kStatusRequest), Role::kViewer},
      {frame(MessageType::kModelRequest), Role::kViewer},
      {frame(MessageType::kSubscribeRequest), Role::kViewer},
      {frame(MessageType::kObservation), Role::kSource},
      {frame(MessageType::kStartSessionRequest, plain), Role::kOwner},
      {frame(MessageType::kStartSessionRequest, takeover), Role::kAdmin},
      {frame(MessageType::kUpdate), Role::kAdmin},
      {frame(static_cast<MessageType>(999)), Role::kAdmin}};
  Gate gate(everyone(), {});
  for (const auto& [request, least] : needs) {
    for (const Role role : kAllRoles) {
      const Status status = gate.admit(std::string(to_string(role)), request, kNow);
      EXPECT_EQ(status.has_value(), includes(role, least))
          << to_string(role) << ", type " << static_cast<int>(request.type);
      EXPECT_TRUE(status || status.error().code == ErrorCode::kNotAllowed);
    }
  }
  EXPECT_EQ(gate.refusals().not_allowed, 1u + 2u + 3u + 3u + 3u);
}

TEST(Gate, ARefusalNamesKeyRoleAndWhatItTakes) {
  Gate gate(everyone(), {});
  EXPECT_EQ(sentence_of(gate.admit("viewer", frame(MessageType::kObservation), kNow)),
            "the key viewer has the role viewer: to hand in observations requires the role source");
}

TEST(Gate, ANameThatIsNotInTheListMayNothing) {
  Gate gate(everyone(), {});
  for (const char* name : {"", "stranger"}) {
    EXPECT_FALSE(gate.admit(name, frame(MessageType::kStatusRequest), kNow)) << name;
  }
}

TEST(Gate, WithoutKeysEveryConnectionMayEverything) {
  Gate gate(std::nullopt, {});
  EXPECT_TRUE(gate.admit("peer", frame(MessageType::kStartSessionRequest, start(true)), kNow));
  EXPECT_TRUE(gate.admit("peer", frame(MessageType::kUpdate), kNow)) << "the service answers it";
}

TEST(Gate, ObservationsBeyondTheLimitAreRefusedAndCountedPerKey) {
  Limits limits;
  limits.observations_per_s = 10;
  Gate gate(everyone(), limits);
  const auto sent = [&](const char* key, Gate::TimePoint now) {
    int accepted = 0;
    for (int i = 0; i < 50; ++i) {
      const Status status = gate.admit(key, frame(MessageType::kObservation), now);
      accepted += status ? 1 : 0;
      EXPECT_TRUE(status || status.error().code == ErrorCode::kUnavailable);
    }
    return accepted;
  };
  EXPECT_EQ(sent("source", kNow), 10);
  EXPECT_EQ(sent("owner", kNow), 10) << "another key has its own";
  EXPECT_EQ(sent("source", kNow + std::chrono::milliseconds(500)), 5);
  EXPECT_EQ(gate.refusals().observations, 40u + 40u + 45u);
  EXPECT_TRUE(gate.admit("source", frame(MessageType::kSubscribeRequest), kNow)) << "not counted";
}

TEST(Gate, ASourceOf60HzForAMinuteIsNeverRefused) {
  Gate gate(everyone(), {});
  for (int i = 0; i < 3600; ++i) {
    const auto now = kNow + std::chrono::microseconds(16'667 * i);
    ASSERT_TRUE(gate.admit("source", frame(MessageType::kObservation), now)) << i;
  }
}

TEST(Gate, SessionStartsBeyondTheLimitAreRefusedAlsoAfterAReconnect) {
  Limits limits;
  limits.session_starts_per_min = 3;
  Gate gate(everyone(), limits);
  const std::string payload = start(false);
  int accepted = 0;
  for (int i = 0; i < 20; ++i) {
    accepted +=
        gate.admit("owner", frame(MessageType::kStartSessionRequest, payload), kNow) ? 1 : 0;
    gate.left("owner");
  }
  EXPECT_EQ(accepted, 3);
  EXPECT_EQ(gate.refusals().session_starts, 17u);
}

TEST(Gate, ConnectionsOfAKeyAreLimited) {
  Limits limits;
  limits.connections = 2;
  Gate gate(everyone(), limits);
  EXPECT_TRUE(gate.enter("viewer", 1));
  EXPECT_THAT(refusal_of(gate.enter("viewer", 2), ErrorCode::kUnavailable),
              HasSubstr("viewer has 2 connections"));
  EXPECT_TRUE(Gate(std::nullopt, limits).enter("peer", 5)) << "a connection is its own caller";
}

}  // namespace
}  // namespace brainshift::server
