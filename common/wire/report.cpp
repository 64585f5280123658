// SPDX-License-Identifier: Apache-2.0
#include "common/wire/report.hpp"

#include <algorithm>
#include <functional>

#include "brainshift/v1/operations.pb.h"
#include "common/core/text.hpp"
#include "common/wire/checked_values.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/payload_scan.hpp"

namespace brainshift::wire {
namespace {

void set(const LatencyFigures& figures, pb::LatencyFigures* out) {
  out->set_count(figures.count);
  out->set_p50_ms(figures.p50_ms);
  out->set_p95_ms(figures.p95_ms);
  out->set_p99_ms(figures.p99_ms);
  out->set_max_ms(figures.max_ms);
}

void set(const StageLatency& stage, pb::StageLatency* out) {
  out->set_stage(to_utf8(stage.stage));
  set(stage.recent, out->mutable_recent());
  set(stage.all, out->mutable_all());
  out->set_sum_ms(stage.sum_ms);
  out->mutable_bucket_counts()->Add(stage.bucket_counts.begin(), stage.bucket_counts.end());
}

void set(const SourceCounts& counts, pb::SourceCounts* out) {
  out->set_source(to_utf8(counts.source));
  out->set_received(counts.received);
  out->set_answered(counts.answered);
  out->set_failed(counts.failed);
  out->set_replaced(counts.replaced);
  out->set_skipped(counts.skipped);
  out->set_refused(counts.refused);
  out->set_repeated(counts.repeated);
  out->set_waiting(counts.waiting);
  out->set_age_ms(counts.age_ms);
}

void set(const ViewerFigures& viewer, pb::ViewerFigures* out) {
  out->set_peer(to_utf8(viewer.peer));
  out->set_window(viewer.window);
  out->set_sent(viewer.sent);
  out->set_received(viewer.received);
  out->set_owed(viewer.owed);
  out->set_replies_waiting(viewer.replies_waiting);
}

void set(const JournalFigures& journal, pb::JournalFigures* out) {
  out->set_recording(journal.recording);
  out->set_reason(to_utf8(journal.reason));
  out->set_file(to_utf8(journal.file));
  out->set_bytes(journal.bytes);
  out->set_records(journal.records);
  out->set_lost(journal.lost);
}

void set(const ProcessFigures& process, pb::ProcessFigures* out) {
  out->set_resident_bytes(process.resident_bytes);
  out->set_peak_bytes(process.peak_bytes);
  out->set_descriptors(process.descriptors);
  out->set_descriptor_limit(process.descriptor_limit);
  out->set_threads(process.threads);
}

void set(const DoorFigures& door, pb::DoorFigures* out) {
  out->set_accepted(door.accepted);
  out->set_closed_for_breach(door.closed_for_breach);
  out->set_closed_for_memory(door.closed_for_memory);
  out->set_closed_for_silence(door.closed_for_silence);
  out->set_closed_for_room(door.closed_for_room);
  out->set_held_bytes(door.held_bytes);
  out->set_unknown_keys(door.unknown_keys);
  out->set_refused_role(door.refused_role);
  out->set_refused_connections(door.refused_connections);
  out->set_refused_observations(door.refused_observations);
  out->set_refused_starts(door.refused_starts);
}

LatencyFigures figures_from(Checked& checked, const pb::LatencyFigures& value) {
  return {value.count(), checked.non_negative(value.p50_ms(), "report.stages.p50_ms"),
          checked.non_negative(value.p95_ms(), "report.stages.p95_ms"),
          checked.non_negative(value.p99_ms(), "report.stages.p99_ms"),
          checked.non_negative(value.max_ms(), "report.stages.max_ms")};
}

StageLatency stage_from(Checked& checked, const pb::StageLatency& value, int bounds) {
  checked.require(value.bucket_counts_size() == bounds + 1, "report.stages.bucket_counts",
                  "must be one more than bounds_ms");
  return {one_line(value.stage()),
          figures_from(checked, value.recent()),
          figures_from(checked, value.all()),
          checked.non_negative(value.sum_ms(), "report.stages.sum_ms"),
          {value.bucket_counts().begin(), value.bucket_counts().end()}};
}

SourceCounts counts_from(Checked& checked, const pb::SourceCounts& value) {
  return {one_line(value.source()), value.received(),
          value.answered(),         value.failed(),
          value.replaced(),         value.skipped(),
          value.refused(),          value.repeated(),
          value.waiting(),          checked.non_negative(value.age_ms(), "report.sources.age_ms")};
}

}  // namespace

std::string encode(const DaemonReport& report) {
  pb::DaemonReport message;
  message.set_version(to_utf8(report.version));
  message.set_build(to_utf8(report.build));
  message.set_machine(to_utf8(report.machine));
  message.set_blas_kernel(to_utf8(report.blas_kernel));
  message.set_uptime_ms(report.uptime_ms);
  message.set_model_ready(report.model_ready);
  message.set_case_id(to_utf8(report.case_id));
  message.mutable_session()->ParseFromString(encode(report.session));
  message.set_owner(to_utf8(report.owner));
  message.set_max_age_s(report.max_age_s);
  message.set_working_ms(report.working_ms);
  message.set_limit_ms(report.limit_ms);
  message.set_usable(report.usable);
  message.set_unusable(report.unusable);
  message.set_late(report.late);
  message.set_failures(report.failures);
  message.set_iterates(report.iterates);
  for (const SourceCounts& source : report.sources) set(source, message.add_sources());
  message.set_clients(report.clients);
  for (const ViewerFigures& viewer : report.viewers) set(viewer, message.add_viewers());
  message.set_recent_updates(report.recent_updates);
  message.mutable_bounds_ms()->Add(report.bounds_ms.begin(), report.bounds_ms.end());
  for (const StageLatency& stage : report.stages) set(stage, message.add_stages());
  if (report.journal) set(*report.journal, message.mutable_journal());
  message.set_log_lines_lost(report.log_lines_lost);
  set(report.process, message.mutable_process());
  set(report.door, message.mutable_door());
  return message.SerializeAsString();
}

Result<DaemonReport> decode_report(std::string_view payload) {
  pb::DaemonReport message;
  if (Status status = parse(payload, message); !status) return tl::unexpected(status.error());
  const auto session = decode_session_state(message.session().SerializeAsString());
  if (!session) return tl::unexpected(session.error());
  Checked checked;
  DaemonReport report;
  report.version = one_line(message.version());
  report.build = one_line(message.build());
  report.machine = one_line(message.machine());
  report.blas_kernel = one_line(message.blas_kernel());
  report.uptime_ms = message.uptime_ms();
  report.model_ready = message.model_ready();
  report.case_id = one_line(message.case_id());
  report.session = *session;
  report.owner = one_line(message.owner());
  report.max_age_s = checked.non_negative(message.max_age_s(), "report.max_age_s");
  report.working_ms = checked.non_negative(message.working_ms(), "report.working_ms");
  report.limit_ms = checked.non_negative(message.limit_ms(), "report.limit_ms");
  report.usable = message.usable();
  report.unusable = message.unusable();
  report.late = message.late();
  report.failures = message.failures();
  report.iterates = message.iterates();
  for (const auto& source : message.sources()) {
    report.sources.push_back(counts_from(checked, source));
  }
  report.clients = message.clients();
  for (const auto& viewer : message.viewers()) {
    report.viewers.push_back({one_line(viewer.peer()), viewer.window(), viewer.sent(),
                              viewer.received(), viewer.owed(), viewer.replies_waiting()});
  }
  report.recent_updates = message.recent_updates();
  for (const double bound : message.bounds_ms()) {
    report.bounds_ms.push_back(checked.non_negative(bound, "report.bounds_ms"));
  }
  const auto& bounds = report.bounds_ms;
  const bool grow =
      std::adjacent_find(bounds.begin(), bounds.end(), std::greater_equal<>()) == bounds.end();
  checked.require(grow, "report.bounds_ms", "must grow");
  for (const auto& stage : message.stages()) {
    report.stages.push_back(stage_from(checked, stage, message.bounds_ms_size()));
  }
  if (message.has_journal()) {
    const auto& journal = message.journal();
    report.journal =
        JournalFigures{journal.recording(), one_line(journal.reason()), one_line(journal.file()),
                       journal.bytes(),     journal.records(),          journal.lost()};
  }
  report.log_lines_lost = message.log_lines_lost();
  const auto& process = message.process();
  report.process = {process.resident_bytes(), process.peak_bytes(), process.descriptors(),
                    process.descriptor_limit(), process.threads()};
  const auto& door = message.door();
  report.door = {door.accepted(),
                 door.closed_for_breach(),
                 door.closed_for_memory(),
                 door.closed_for_silence(),
                 door.closed_for_room(),
                 door.held_bytes(),
                 door.unknown_keys(),
                 door.refused_role(),
                 door.refused_connections(),
                 door.refused_observations(),
                 door.refused_starts()};
  if (!checked.ok()) return tl::unexpected(checked.status().error());
  return report;
}

}  // namespace brainshift::wire
