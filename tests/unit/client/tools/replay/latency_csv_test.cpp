// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "client/tools/replay/replay.hpp"
#include "tests/unit/client/tools/replay/scripted_daemon.hpp"

namespace brainshift::client {
namespace {

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

TEST(LatencyCsv, HasOneRowPerObservationSent) {
  ScriptedDaemon daemon;
  daemon.script = [](const Observation& o) { return std::vector{update(o.sequence, true)}; };
  const auto lines = lines_of(latency_csv(play(daemon.link(), recording(2), repeated(1000))));
  ASSERT_EQ(lines.size(), 2001u);
  EXPECT_THAT(lines[1], testing::StartsWith("1,1,"));
  EXPECT_THAT(lines[2000], testing::StartsWith("2000,2000,"));
  for (const std::string& line : lines) EXPECT_EQ(std::count(line.begin(), line.end(), ','), 9);
}

TEST(LatencyCsv, TellsTimesContactAndOutcome) {
  PlayedSession session;
  session.observations.resize(3);
  PlayedObservation& good = session.observations[0];
  good.sequence = 41;
  good.latency_ms = 1234.5;
  good.timings = {0.25, 20.0, 3.5, 0.125, 99.0};
  good.active = 612;
  good.contact_iterations = 7;
  good.status = EstimateStatus::kDeadline;
  session.observations[1].sequence = 42;
  session.observations[1].error = Error{ErrorCode::kEmptySet, "too few, points"};
  session.observations[2].sequence = 43;
  session.observations[2].superseded = true;
  EXPECT_THAT(lines_of(latency_csv(session)),
              testing::ElementsAre(
                  "update,observation_sequence,latency_ms,register_ms,invert_ms,rebuild_ms,"
                  "encode_ms,active,contact_iterations,status",
                  "1,41,1234.5000,0.2500,20.0000,3.5000,0.1250,612,7,deadline",
                  "2,42,,,,,,,,empty_set", "3,43,,,,,,,,superseded"));
}

}  // namespace
}  // namespace brainshift::client
