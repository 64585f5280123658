// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/monitor/page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace brainshift::client {
namespace {

constexpr const char* kUnnamed = "(not known)";

double rate(std::uint64_t now, std::uint64_t before, double seconds) {
  return seconds > 0.0 && now >= before ? static_cast<double>(now - before) / seconds : 0.0;
}

// Between the reports; 0 when there is none before, or it is of another process.
double seconds_between(const Reports& reports) {
  if (!reports.before ||
      reports.before->session.session.boot_id != reports.now.session.session.boot_id ||
      reports.before->uptime_ms >= reports.now.uptime_ms) {
    return 0.0;
  }
  return 1e-3 * static_cast<double>(reports.now.uptime_ms - reports.before->uptime_ms);
}

const wire::SourceCounts* find(const wire::DaemonReport& report, const std::string& source) {
  const auto found = std::find_if(report.sources.begin(), report.sources.end(),
                                  [&](const auto& counts) { return counts.source == source; });
  return found == report.sources.end() ? nullptr : &*found;
}

std::uint64_t final_updates(const wire::DaemonReport& report) {
  return report.usable + report.unusable + report.failures;
}

// Of a daemon that keeps a journal.
bool waits_for_a_session(const wire::DaemonReport& report) {
  return report.journal->file.empty() && report.session.session.session_id == 0;
}
std::string recording_text(const wire::DaemonReport& report) {
  if (waits_for_a_session(report)) return "waits for a session";
  return report.journal->recording ? "recording" : "NOT RECORDING: " + report.journal->reason;
}

std::string mebibytes(std::uint64_t bytes) {
  return fmt::format("{:.1f} MiB", static_cast<double>(bytes) / 1048576.0);
}

FieldAge age_of(const SessionState& state) {
  return state.newest_usable > 0 ? state.age_of(state.age_ms) : FieldAge::kFresh;
}

std::string age_text(const wire::DaemonReport& report) {
  if (report.session.newest_usable == 0) return "none yet";
  std::string text = duration_text(1e-3 * report.session.age_ms) + " old";
  const FieldAge age = age_of(report.session);
  if (age == FieldAge::kAged) text += ", AGED";
  if (age == FieldAge::kExpired) text += ", EXPIRED";
  return text;
}

const wire::StageLatency* total_of(const wire::DaemonReport& report) {
  const auto found = std::find_if(report.stages.begin(), report.stages.end(),
                                  [](const auto& stage) { return stage.stage == "total"; });
  return found == report.stages.end() ? nullptr : &*found;
}

class Page {
 public:
  explicit Page(const Reports& reports)
      : now_(reports.now), before_(reports.before), elapsed_s_(seconds_between(reports)) {}

  std::vector<Line> take(const std::string& endpoint) {
    add_daemon(endpoint);
    add_session();
    add_updates();
    add_sources();
    add_stages();
    add_viewers();
    add_door();
    add_journal();
    add_process();
    return std::move(lines_);
  }

 private:
  void add(const std::string& name, const std::string& text, bool alarm = false) {
    lines_.push_back({fmt::format("{:<9} {}", name, text), alarm});
  }
  bool has_rates() const { return elapsed_s_ > 0.0; }
  std::string per_second(std::uint64_t now, std::uint64_t before) const {
    return fmt::format("{:.1f}/s", rate(now, before, elapsed_s_));
  }

  void add_daemon(const std::string& endpoint) {
    add("daemon", fmt::format("{} at {}, up {}", now_.version, endpoint,
                              duration_text(1e-3 * static_cast<double>(now_.uptime_ms))));
    add("", fmt::format("build {}, {}, BLAS {}", now_.build, now_.machine,
                        now_.blas_kernel.empty() ? "not known" : now_.blas_kernel));
    const auto trouble = complaint(now_);
    const bool recorded = now_.session.recorded;
    add("verdict",
        (recorded ? "RECORDED, " : "") + (trouble ? "ATTENTION: " + *trouble : std::string("well")),
        recorded || trouble.has_value());
  }

  void add_session() {
    const SessionState& state = now_.session;
    add("model",
        now_.model_ready ? fmt::format("case {}, model {}", now_.case_id, state.session.model_id)
                         : "NONE is loaded",
        !now_.model_ready);
    std::string text(to_string(state.phase));
    if (state.session.session_id > 0) {
      text += fmt::format(", session {}, owner {}", state.session.session_id,
                          now_.owner.empty() ? "nobody" : now_.owner);
    }
    if (const std::string kind = state.kind(); !kind.empty()) text += ", " + kind;
    if (state.preparing) text += ", another one is being prepared";
    add("session", text, state.phase == SessionPhase::kDegraded || state.recorded);
    if (!state.reason.empty()) add("", "reason: " + state.reason, true);
    std::string field = age_text(now_);
    if (state.newest_usable > 0) field = fmt::format("update {}, {}", state.newest_usable, field);
    add("field", field, age_of(state) != FieldAge::kFresh);
    std::string worker = "waits";
    if (now_.working_ms > 0.0) worker = "busy for " + duration_text(1e-3 * now_.working_ms);
    if (now_.worker_hangs()) {
      worker += fmt::format(", HANGS: at most {}", duration_text(1e-3 * now_.limit_ms));
    }
    add("worker", worker, now_.worker_hangs());
  }

  void add_updates() {
    std::string text =
        fmt::format("{} usable, {} unusable, {} failed", now_.usable, now_.unusable, now_.failures);
    if (now_.late > 0) text += fmt::format(", {} late", now_.late);
    if (now_.iterates > 0) text += fmt::format(", {} iterates", now_.iterates);
    if (has_rates()) text += ", " + per_second(final_updates(now_), final_updates(*before_));
    add("updates", text);
  }

  void add_sources() {
    if (now_.sources.empty()) return add("sources", "none has observed yet");
    add("sources", fmt::format("{:<14}{:>9}{:>9}{:>8}{:>9}{:>8}{:>8}{:>9}{:>8}  {}", "", "received",
                               "answered", "failed", "replaced", "skipped", "refused", "repeated",
                               "waiting", "last"));
    for (const wire::SourceCounts& counts : now_.sources) {
      std::string text = fmt::format(
          "{:<14}{:>9}{:>9}{:>8}{:>9}{:>8}{:>8}{:>9}{:>8}  {} ago",
          counts.source.empty() ? kUnnamed : counts.source, counts.received, counts.answered,
          counts.failed, counts.replaced, counts.skipped, counts.refused, counts.repeated,
          counts.waiting, duration_text(1e-3 * counts.age_ms));
      if (has_rates()) {
        const wire::SourceCounts* earlier = find(*before_, counts.source);
        text += ", " + per_second(counts.received, earlier != nullptr ? earlier->received : 0);
      }
      add("", text);
    }
  }

  void add_stages() {
    const wire::StageLatency* total = total_of(now_);
    if (total == nullptr || total->all.count == 0) return add("latency", "no update yet");
    add("latency", fmt::format("{:<14}{:>9}{:>9}{:>9}{:>9}   of all{:>9}{:>9}{:>9}{:>9}",
                               fmt::format("last {}, ms", total->recent.count), "p50", "p95", "p99",
                               "max", "p50", "p95", "p99", "max"));
    for (const wire::StageLatency& stage : now_.stages) {
      const wire::LatencyFigures& recent = stage.recent;
      const wire::LatencyFigures& all = stage.all;
      add("", fmt::format(
                  "{:<14}{:>9.2f}{:>9.2f}{:>9.2f}{:>9.2f}         {:>9.2f}{:>9.2f}{:>9.2f}{:>9.2f}",
                  stage.stage, recent.p50_ms, recent.p95_ms, recent.p99_ms, recent.max_ms,
                  all.p50_ms, all.p95_ms, all.p99_ms, all.max_ms));
    }
  }

  void add_viewers() {
    add("clients", fmt::format("{} connected, {} of them view", now_.clients, now_.viewers.size()));
    for (const wire::ViewerFigures& viewer : now_.viewers) {
      add("", fmt::format("{:<14}window {}, sent {}, received {}, owed {}, replies waiting {}",
                          viewer.peer, viewer.window, viewer.sent, viewer.received, viewer.owed,
                          viewer.replies_waiting));
    }
  }

  void add_door() {
    const wire::DoorFigures& door = now_.door;
    add("door",
        fmt::format("{} accepted, closed for breach {}, memory {}, silence {}, room {}, {} held",
                    door.accepted, door.closed_for_breach, door.closed_for_memory,
                    door.closed_for_silence, door.closed_for_room, mebibytes(door.held_bytes)));
    add("", fmt::format("refused: unknown keys {}, beyond a role {}, connections {}, observations "
                        "{}, session starts {}",
                        door.unknown_keys, door.refused_role, door.refused_connections,
                        door.refused_observations, door.refused_starts));
  }

  void add_journal() {
    if (!now_.journal) return add("journal", "none is configured");
    const wire::JournalFigures& journal = *now_.journal;
    if (waits_for_a_session(now_)) return add("journal", recording_text(now_));
    const std::string file = journal.file.empty() ? "no file" : journal.file;
    add("journal", recording_text(now_), !journal.recording);
    add("",
        fmt::format("{}, {}, {} records, {} lost", file, mebibytes(journal.bytes), journal.records,
                    journal.lost),
        journal.lost > 0);
  }

  void add_process() {
    add("log", fmt::format("{} lines lost", now_.log_lines_lost), now_.log_lines_lost > 0);
    const wire::ProcessFigures& process = now_.process;
    add("process", fmt::format("{} resident, {} at most, {} of {} descriptors, {} threads",
                               mebibytes(process.resident_bytes), mebibytes(process.peak_bytes),
                               process.descriptors, process.descriptor_limit, process.threads));
  }

  const wire::DaemonReport& now_;
  const std::optional<wire::DaemonReport>& before_;
  double elapsed_s_;
  std::vector<Line> lines_;
};

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
          {"preparing", state.preparing},
          {"aged_after_ms", state.aged_after_ms},
          {"expired_after_ms", state.expired_after_ms},
          {"recorded", state.recorded},
          {"method", state.method},
          {"boundary", state.boundary}};
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

std::string duration_text(double seconds) {
  if (seconds < 60.0) return fmt::format("{:.1f} s", seconds);
  const auto whole = static_cast<long long>(seconds);
  if (whole < 3600) return fmt::format("{} min {} s", whole / 60, whole % 60);
  return fmt::format("{} h {} min", whole / 3600, whole / 60 % 60);
}

std::optional<std::string> complaint(const wire::DaemonReport& report) {
  if (!report.model_ready) return "no model is loaded";
  if (report.worker_hangs()) {
    return fmt::format("the worker hangs: busy for {}, at most {}",
                       duration_text(1e-3 * report.working_ms),
                       duration_text(1e-3 * report.limit_ms));
  }
  switch (report.session.phase) {
    case SessionPhase::kEmpty: return "no session is running";
    case SessionPhase::kPreparing: return "the session is still being prepared";
    case SessionPhase::kClosed: return "the daemon is stopping";
    case SessionPhase::kDegraded: return "degraded: " + report.session.reason;
    case SessionPhase::kReady:
    case SessionPhase::kTracking: break;
  }
  if (const FieldAge age = age_of(report.session); age != FieldAge::kFresh) {
    return (age == FieldAge::kAged ? "the field is aged: " : "the field has expired: ") +
           report.session.age_reason(report.session.age_ms);
  }
  if (report.journal && !report.journal->recording) {
    return "not recording: " + report.journal->reason;
  }
  return std::nullopt;
}

std::vector<Line> page(const Reports& reports, const std::string& endpoint) {
  return Page(reports).take(endpoint);
}

std::string summary(const Reports& reports) {
  const wire::DaemonReport& now = reports.now;
  const double seconds = seconds_between(reports);
  std::string text = fmt::format("{}, field {}", to_string(now.session.phase), age_text(now));
  if (const std::string kind = now.session.kind(); !kind.empty()) text += ", " + kind;
  if (const std::string& id = now.session.session.model_id; !id.empty()) text += ", model " + id;
  if (seconds > 0.0) {
    text += fmt::format(", {:.1f} updates/s",
                        rate(final_updates(now), final_updates(*reports.before), seconds));
  }
  if (const wire::StageLatency* total = total_of(now); total != nullptr && total->all.count > 0) {
    const wire::LatencyFigures& recent = total->recent;
    text += fmt::format(", total p50 {:.2f} p95 {:.2f} p99 {:.2f} max {:.2f} ms", recent.p50_ms,
                        recent.p95_ms, recent.p99_ms, recent.max_ms);
  }
  if (now.journal) {
    text += (waits_for_a_session(now) ? ", journal " : ", ") + recording_text(now);
  }
  if (const auto trouble = complaint(now)) text += ", ATTENTION: " + *trouble;
  return text;
}

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
