// SPDX-License-Identifier: GPL-3.0-or-later
// What the tap notes of messages that pass; the real daemon is in the test replays.smoke.
#include "tests/replays/replay_player.hpp"

#include <gtest/gtest.h>

#include "tests/unit/client/tools/replay/scripted_daemon.hpp"

namespace brainshift::replays {
namespace {

using client::kSession;

UpdateMessage answer(std::uint64_t observation, double displacement_mm) {
  UpdateMessage message = client::update(observation, true);
  message.update.estimate.displacement = Points::Constant(3, 2, displacement_mm);
  SourceSummary source;
  source.source = "ius";
  source.observation_sequence = observation;
  message.update.estimate.sources = {source};
  message.update.answer_time = {10.0 * double(observation), 4.0};
  return message;
}

// One pass of three observations, answered by fields of this displacement.
std::vector<PlayedRow> rows_of(double displacement_mm, KnownFields& fields) {
  client::ScriptedDaemon daemon;
  daemon.script = [&](const Observation& o) {
    UpdateMessage stranger = answer(o.sequence, 99.0);
    stranger.session_id = kSession + 1;
    return std::vector{client::update(o.sequence, false), stranger,
                       answer(o.sequence, displacement_mm)};
  };
  Tap tap(daemon.link(), kSession, fields);
  const auto played = client::play(tap.link(), client::recording(3), client::kOptions);
  std::vector<PlayedRow> rows;
  for (const auto& one : played.observations) rows.push_back(tap.row_of(one));
  return rows;
}

TEST(Tap, NotesWhatTheDaemonSaysOfEveryAnswerOfItsSession) {
  KnownFields fields;
  const auto rows = rows_of(1.0, fields);
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[0].sent_ms, 0.0);
  EXPECT_GE(rows[2].sent_ms, rows[1].sent_ms);
  for (std::uint64_t i = 0; i < 3; ++i) {
    EXPECT_EQ(rows[i].answer.ms, 10.0 * double(i + 1));
    EXPECT_EQ(rows[i].evidence, "ius " + std::to_string(i + 1));
    EXPECT_FALSE(rows[i].difference_mm) << "nothing to compare with yet";
    EXPECT_TRUE(rows[i].played.latency_ms);
  }
}

TEST(Tap, ComparesFieldsOfTheSameEvidenceAcrossPasses) {
  KnownFields fields;
  (void)rows_of(1.0, fields);
  const auto same = rows_of(1.0, fields), other = rows_of(1.5, fields);
  ASSERT_TRUE(same[1].difference_mm);
  EXPECT_EQ(*same[1].difference_mm, 0.0);
  EXPECT_EQ(*other[1].difference_mm, 0.5);
}

TEST(KnownFields, AFieldOfAnotherMeshIsFarOff) {
  KnownFields fields;
  EXPECT_FALSE(fields.compare("ius 1", Points::Zero(3, 2)));
  EXPECT_GT(*fields.compare("ius 1", Points::Zero(3, 3)), 1e6);
}

TEST(KnownFields, TheGreatestComponentCounts) {
  KnownFields fields;
  Points a = Points::Zero(3, 2), b = a;
  b(2, 1) = -0.25;
  b(0, 0) = 0.125;
  (void)fields.compare("ius 1", a);
  EXPECT_EQ(*fields.compare("ius 1", b), 0.25);
  EXPECT_FALSE(fields.compare("ius 2", b)) << "other evidence";
}

}  // namespace
}  // namespace brainshift::replays
