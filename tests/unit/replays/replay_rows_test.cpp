// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/replays/replay_rows.hpp"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace brainshift::replays
