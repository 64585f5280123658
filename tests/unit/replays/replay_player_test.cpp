// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "tests/replays/replay_player.hpp"
#include "tests/unit/client/tools/replay/scripted_daemon.hpp"

namespace brainshift::replays {
namespace {

using surgeries::text_of;

PassFacts facts(client::Speed speed) {
  PassFacts facts;
  facts.head = "h";
  facts.surgery = "sag";
  facts.speed = speed;
  facts.t_solve_ms = 50.0;
  return facts;
}

PlayedRow answered() {
  PlayedRow row;
  row.played.sequence = 4;
  row.played.latency_ms = 90.0;
  row.played.timings = {1.0, 2.0, 3.0, 4.0, 5.0};
  row.played.status = EstimateStatus::kConverged;
  row.played.quality.quality = Quality::kGood;
  row.due_ms = 750.0;
  row.sent_ms = 752.5;
  row.answer = {80.0, 30.0};
  row.evidence = "ius 4";
  row.difference_mm = 0.001;
  return row;
}

TEST(ReplayRow, HasEveryStageAndTheDaemonsOwnAccount) {
  const auto row = row_of(facts(client::Speed::kRecorded), 4, answered());
  const std::pair<const char*, const char*> expected[] = {
      {"surgery", "sag"},      {"speed", "1x"},
      {"update", "4"},         {"sequence", "4"},
      {"due_ms", "750"},       {"sent_late_ms", "2.5"},
      {"outcome", "field"},    {"latency_ms", "90"},
      {"register_ms", "1"},    {"invert_ms", "2"},
      {"rebuild_ms", "3"},     {"encode_ms", "4"},
      {"journal_ms", "5"},     {"answer_ms", "80"},
      {"usual_ms", "30"},      {"late", "1"},
      {"quality", "good"},     {"deadline", "0"},
      {"status", "converged"}, {"evidence", "ius 4"},
      {"t_solve_ms", "50"},    {"difference_mm", "0.001"}};
  for (const auto& [column, text] : expected) EXPECT_EQ(text_of(row, column), text) << column;
}

TEST(ReplayRow, NothingIsDueAtFullSpeed) {
  const auto row = row_of(facts(client::Speed::kMax), 4, answered());
  EXPECT_EQ(text_of(row, "speed"), "max");
  EXPECT_EQ(text_of(row, "due_ms"), "");
  EXPECT_EQ(text_of(row, "sent_late_ms"), "");
}

TEST(ReplayRow, TellsHowEveryObservationEnded) {
  PlayedRow row;
  const auto outcome = [&] {
    return text_of(row_of(facts(client::Speed::kMax), 1, row), "outcome");
  };
  EXPECT_EQ(outcome(), "");
  row.played.superseded = true;
  EXPECT_EQ(outcome(), "superseded");
  EXPECT_EQ(text_of(row_of(facts(client::Speed::kMax), 1, row), "invert_ms"), "");
  EXPECT_EQ(text_of(row_of(facts(client::Speed::kMax), 1, row), "quality"), "");
  row.played.superseded = false;
  row.played.error = Error{ErrorCode::kEmptySet, "too few points"};
  EXPECT_EQ(outcome(), "empty_set");
}

TEST(ReplayRow, MarksAMissedDeadline) {
  PlayedRow row = answered();
  row.played.quality.flags.set(QualityFlag::kDeadline);
  EXPECT_EQ(text_of(row_of(facts(client::Speed::kMax), 1, row), "deadline"), "1");
}

TEST(ReplayRow, EveryRowHasTheSameColumns) {
  const auto a = row_of({}, 0, {}), b = row_of(facts(client::Speed::kRecorded), 1, answered());
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i].first, b[i].first);
}

TEST(Evidence, NamesTheObservationOfEverySource) {
  SourceSummary ius, tracks;
  ius.source = "ius";
  ius.observation_sequence = 4;
  tracks.source = "tracks";
  tracks.observation_sequence = 3;
  EXPECT_EQ(evidence_of({ius, tracks}), "ius 4; tracks 3");
  EXPECT_EQ(evidence_of({}), "");
}

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

// What the tap notes of messages that pass; the real daemon is in the test replays.smoke.

}  // namespace brainshift::replays
