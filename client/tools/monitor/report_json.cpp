// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/monitor/report_json.hpp"

#include <nlohmann/json.hpp>

#include "client/tools/monitor/page.hpp"

namespace brainshift::client {
namespace {

using Json = nlohmann::ordered_json;

Json to_json(const wire::LatencyFigures& figures) {
  return {{"count", figures.count},
          {"p50_ms", figures.p50_ms},
          {"p95_ms", figures.p95_ms},
          {"p99_ms", figures.p99_ms},
          {"max_ms", figures.max_ms}};
}

Json to_json(const wire::SourceCounts& counts) {
  return {{"source", counts.source},   {"received", counts.received}, {"answered", counts.answered},
          {"failed", counts.failed},   {"replaced", counts.replaced}, {"skipped", counts.skipped},
          {"refused", counts.refused}, {"repeated", counts.repeated}, {"waiting", counts.waiting},
          {"age_ms", counts.age_ms}};
}

Json to_json(const wire::ViewerFigures& viewer) {
  return {{"peer", viewer.peer}, {"window", viewer.window},
          {"sent", viewer.sent}, {"received", viewer.received},
          {"owed", viewer.owed}, {"replies_waiting", viewer.replies_waiting}};
}

Json to_json(const wire::StageLatency& stage) {
  return {{"stage", stage.stage},
          {"recent", to_json(stage.recent)},
          {"all", to_json(stage.all)},
          {"sum_ms", stage.sum_ms},
          {"bucket_counts", stage.bucket_counts}};
}

Json to_json(const SessionState& state) {
  return {{"boot_id", state.session.boot_id},
          {"session_id", state.session.session_id},
          {"model_id", state.session.model_id},
          {"phase", to_string(state.phase)},
          {"newest_update", state.newest_update},
          {"newest_usable", state.newest_usable},
          {"age_ms", state.newest_usable > 0 ? Json(state.age_ms) : Json(nullptr)},
          {"reason", state.reason},
          {"preparing", state.preparing}};
}

Json to_json(const wire::JournalFigures& journal) {
  return {{"recording", journal.recording}, {"reason", journal.reason},   {"file", journal.file},
          {"bytes", journal.bytes},         {"records", journal.records}, {"lost", journal.lost}};
}

template <typename Value>
Json list(const std::vector<Value>& values) {
  Json result = Json::array();
  for (const Value& value : values) result.push_back(to_json(value));
  return result;
}

}  // namespace

std::string report_json(const wire::DaemonReport& report) {
  const auto trouble = complaint(report);
  Json out;
  out["well"] = !trouble;
  out["complaint"] = trouble.value_or("");
  out["version"] = report.version;
  out["build"] = report.build;
  out["machine"] = report.machine;
  out["blas_kernel"] = report.blas_kernel;
  out["uptime_ms"] = report.uptime_ms;
  out["model_ready"] = report.model_ready;
  out["case_id"] = report.case_id;
  out["session"] = to_json(report.session);
  out["owner"] = report.owner;
  out["max_age_s"] = report.max_age_s;
  out["working_ms"] = report.working_ms;
  out["limit_ms"] = report.limit_ms;
  out["usable"] = report.usable;
  out["unusable"] = report.unusable;
  out["late"] = report.late;
  out["failures"] = report.failures;
  out["iterates"] = report.iterates;
  out["sources"] = list(report.sources);
  out["clients"] = report.clients;
  out["viewers"] = list(report.viewers);
  out["recent_updates"] = report.recent_updates;
  out["bounds_ms"] = report.bounds_ms;
  out["stages"] = list(report.stages);
  out["journal"] = report.journal ? to_json(*report.journal) : Json(nullptr);
  out["log_lines_lost"] = report.log_lines_lost;
  out["process"] = {{"resident_bytes", report.process.resident_bytes},
                    {"peak_bytes", report.process.peak_bytes},
                    {"descriptors", report.process.descriptors},
                    {"descriptor_limit", report.process.descriptor_limit},
                    {"threads", report.process.threads}};
  const wire::DoorFigures& door = report.door;
  out["door"] = {{"accepted", door.accepted},
                 {"closed_for_breach", door.closed_for_breach},
                 {"closed_for_memory", door.closed_for_memory},
                 {"closed_for_silence", door.closed_for_silence},
                 {"closed_for_room", door.closed_for_room},
                 {"held_bytes", door.held_bytes},
                 {"unknown_keys", door.unknown_keys},
                 {"refused_role", door.refused_role},
                 {"refused_connections", door.refused_connections},
                 {"refused_observations", door.refused_observations},
                 {"refused_starts", door.refused_starts}};
  return out.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace brainshift::client
