// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/replays/replay_player.hpp"

#include <limits>

#include "client/tools/replay/replay.hpp"

namespace brainshift::replays {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::string outcome_of(const client::PlayedObservation& played) {
  if (played.error) return std::string(to_string(played.error->code));
  if (played.superseded) return "superseded";
  return played.latency_ms ? "field" : "";
}

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kPatience{120000};  // without any answer
constexpr double kOtherMesh_mm = 1e9;

Result<SessionInfo> start(client::Client& client, const std::string& endpoint,
                          const Recording& recording, PassFacts& facts) {
  const auto status = client.status();
  if (!status) return tl::unexpected(status.error());
  const io::SurgeryMeta& meta = recording.meta;
  if (status->case_id != meta.case_id || status->model_id != meta.model_id) {
    return invalid(facts.surgery + ": of case \"" + meta.case_id + "\" and model \"" +
                   meta.model_id + "\", but the daemon at " + endpoint + " serves \"" +
                   status->case_id + "\" and \"" + status->model_id + "\"");
  }
  auto info = client.start_session({.case_id = meta.case_id, .recorded_clock = true});
  if (!info) return info;
  if (Status ok = client.subscribe(Subscription::kMaxWindow); !ok) {
    return tl::unexpected(ok.error());
  }
  facts.head = status->case_id;
  facts.kernel = status->blas_kernel;
  facts.nodes = info->nodes;
  return info;
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

std::optional<double> KnownFields::compare(const std::string& evidence,
                                           const Points& displacement) {
  const auto known = fields_.find(evidence);
  if (known == fields_.end()) {
    fields_.emplace(evidence, displacement);
    return std::nullopt;
  }
  if (known->second.cols() != displacement.cols()) return kOtherMesh_mm;
  return (known->second - displacement).cwiseAbs().maxCoeff();
}

client::DaemonLink Tap::link() {
  return {[this](const Observation& observation) {
            const auto now = Clock::now();
            if (!start_) start_ = now;
            passed_[observation.sequence].sent_ms =
                std::chrono::duration<double, std::milli>(now - *start_).count();
            return link_.submit(observation);
          },
          [this](std::chrono::milliseconds timeout) {
            auto message = link_.next_update(timeout);
            if (message) note(*message);
            return message;
          }};
}

void Tap::note(const UpdateMessage& message) {
  const Update& update = message.update;
  if (message.session_id != session_id_ || message.error || !update.final) return;
  Passed& passed = passed_[update.observation_sequence];
  passed.answer = update.answer_time;
  passed.evidence = evidence_of(update.estimate.sources);
  passed.difference_mm = fields_.compare(passed.evidence, update.estimate.displacement);
}

PlayedRow Tap::row_of(const client::PlayedObservation& played) const {
  PlayedRow row;
  row.played = played;
  const auto found = passed_.find(played.sequence);
  if (found == passed_.end()) return row;
  row.sent_ms = found->second.sent_ms;
  row.answer = found->second.answer;
  row.evidence = found->second.evidence;
  row.difference_mm = found->second.difference_mm;
  return row;
}

Result<double> measure_t_solve_ms(const std::string& endpoint, const Recording& recording) {
  auto client = client::Client::connect(endpoint);
  if (!client) return tl::unexpected(client.error());
  const auto status = client->status();
  if (!status) return tl::unexpected(status.error());
  const auto model = client->model();
  if (!model) return tl::unexpected(model.error());
  const auto unit = client::measure_run_unit(endpoint, *status, *model, recording.meta.case_file,
                                             Boundary::kContact);
  if (!unit) return tl::unexpected(unit.error());
  return unit->full_solve_ms;
}

Result<std::vector<surgeries::Row>> play_pass(const std::string& endpoint,
                                              const Recording& recording, PassFacts facts,
                                              KnownFields& fields) {
  auto client = client::Client::connect(endpoint);
  if (!client) return tl::unexpected(client.error());
  const auto info = start(*client, endpoint, recording, facts);
  if (!info) return tl::unexpected(info.error());
  Tap tap(client::link_to(*client), info->session_id, fields);
  client::PlayOptions options;
  options.session_id = info->session_id;
  options.speed = facts.speed;
  options.timeout = kPatience;
  const client::PlayedSession played = client::play(tap.link(), recording.observations, options);

  std::vector<surgeries::Row> rows;
  const std::int64_t first_ns = recording.observations.front().recorded_ns;
  for (std::size_t i = 0; i < played.observations.size(); ++i) {
    PlayedRow row = tap.row_of(played.observations[i]);
    row.source = recording.observations[i].observation.source;
    row.due_ms = 1e-6 * static_cast<double>(recording.observations[i].recorded_ns - first_ns);
    rows.push_back(replays::row_of(facts, static_cast<int>(i) + 1, row));
  }
  return rows;
}

}  // namespace brainshift::replays
