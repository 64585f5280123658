// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/replays/replay_rows.hpp"

#include <limits>

namespace brainshift::replays {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::string outcome_of(const client::PlayedObservation& played) {
  if (played.error) return std::string(to_string(played.error->code));
  if (played.superseded) return "superseded";
  return played.latency_ms ? "field" : "";
}

}  // namespace

std::string_view name_of(client::Speed speed) {
  return speed == client::Speed::kRecorded ? kRecordedSpeed : kFullSpeed;
}

std::string evidence_of(const std::vector<SourceSummary>& sources) {
  std::string text;
  for (const SourceSummary& one : sources) {
    text +=
        (text.empty() ? "" : "; ") + one.source + " " + std::to_string(one.observation_sequence);
  }
  return text;
}

surgeries::Row row_of(const PassFacts& facts, int update, const PlayedRow& row) {
  const client::PlayedObservation& played = row.played;
  const bool field = played.latency_ms.has_value();
  const bool timed = facts.speed == client::Speed::kRecorded;
  surgeries::Cells cells;
  cells.add("head", facts.head);
  cells.add("nodes", facts.nodes);
  cells.add("kernel", facts.kernel);
  cells.add("surgery", facts.surgery);
  cells.add("seed", std::to_string(facts.seed));
  cells.add("speed", std::string(name_of(facts.speed)));
  cells.add("pass", facts.pass);
  cells.add("update", update);
  cells.add("sequence", std::to_string(played.sequence));
  cells.add("source", row.source);
  cells.add("due_ms", timed ? row.due_ms : kNone);
  cells.add("sent_late_ms", timed ? row.sent_ms - row.due_ms : kNone);
  cells.add("outcome", outcome_of(played));
  cells.add("latency_ms", played.latency_ms.value_or(kNone));
  const StageTimings& t = played.timings;
  cells.add("register_ms", field ? t.register_ms : kNone);
  cells.add("invert_ms", field ? t.invert_ms : kNone);
  cells.add("rebuild_ms", field ? t.rebuild_ms : kNone);
  cells.add("encode_ms", field ? t.encode_ms : kNone);
  cells.add("journal_ms", field ? t.journal_ms : kNone);
  cells.add("answer_ms", field ? row.answer.ms : kNone);
  cells.add("usual_ms", field ? row.answer.usual_ms : kNone);
  cells.add("late", field ? double(row.answer.late()) : kNone);
  cells.add("status", field ? std::string(to_string(played.status)) : "");
  cells.add("quality", field ? std::string(to_string(played.quality.quality)) : "");
  cells.add("deadline", field ? double(played.quality.flags.has(QualityFlag::kDeadline)) : kNone);
  cells.add("active", field ? played.active : kNone);
  cells.add("evidence", field ? row.evidence : "");
  cells.add("difference_mm", field ? row.difference_mm.value_or(kNone) : kNone);
  cells.add("t_solve_ms", facts.t_solve_ms);
  return cells.take();
}

}  // namespace brainshift::replays
