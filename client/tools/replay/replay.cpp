// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/replay/replay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <set>

#include "client/tools/replay/leave_one_out.hpp"
#include "client/tools/replay/score.hpp"
#include "common/contact/forward_model.hpp"
#include "common/io/config/config_file.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/geometry/mesh_writer.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/linalg/openblas.hpp"

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;

struct Surgery {
  io::SurgeryFile file;
  io::SurgeryMeta meta;  // the scenario is the file's name where none is recorded
  std::vector<RecordedObservation> observations;
  std::vector<std::string> notes;  // what is remarkable about the files
};

Status check_given(const fs::path& path, const char* key, const std::string& value) {
  if (!value.empty()) return {};
  return io::unreadable(path, fmt::format("meta.{} is missing", key));
}

Result<std::vector<RecordedObservation>> read_observations(const io::SurgeryFile& file,
                                                           const fs::path& path) {
  const auto records = file.records(io::RecordKind::kObservation);
  if (!records) return tl::unexpected(records.error());
  std::vector<RecordedObservation> observations;
  for (const io::SurgeryRecord& record : *records) {
    auto observation = wire::decode_observation(record.payload);
    if (!observation) {
      return io::unreadable(
          path, fmt::format("observation {}: {}", record.sequence, observation.error().message));
    }
    observations.push_back({record.recorded_ns, for_replay(std::move(*observation))});
  }
  if (observations.empty()) {
    return io::file_error(ErrorCode::kEmptySet, path, "holds no observation");
  }
  return observations;
}

Status keep_sources(const fs::path& path, const std::vector<std::string>& wanted,
                    std::vector<RecordedObservation>& observations) {
  if (wanted.empty()) return {};
  std::set<std::string> recorded;
  for (const auto& one : observations) recorded.insert(one.observation.source);
  const auto missing = std::find_if(wanted.begin(), wanted.end(), [&](const std::string& source) {
    return recorded.count(source) == 0;
  });
  if (missing != wanted.end()) {
    return io::file_error(ErrorCode::kEmptySet, path,
                          fmt::format("holds no observation of source \"{}\"; it has: {}", *missing,
                                      fmt::join(recorded, ", ")));
  }
  std::erase_if(observations, [&](const RecordedObservation& one) {
    return std::find(wanted.begin(), wanted.end(), one.observation.source) == wanted.end();
  });
  return {};
}

// Leaves what the interrupted session has not recorded.
Status resume(const ReplayOptions& options, const io::SurgeryMeta& meta,
              std::vector<RecordedObservation>& observations, std::vector<std::string>& notes) {
  if (options.resume.empty()) return {};
  const auto point = read_resume_point(options.resume);
  if (!point) return tl::unexpected(point.error());
  if (point->meta.model_id != meta.model_id) {
    return io::invalid_file(options.resume, "meta.model_id is \"" + point->meta.model_id +
                                                "\", that of " + options.surgery.string() +
                                                " is \"" + meta.model_id + "\"");
  }
  if (point->broken) notes.push_back(point->broken->message);
  notes.push_back(options.resume.string() + ": " + describe(*point));
  auto left = remaining(observations, *point);
  if (!left) return io::invalid_file(options.resume, left.error().message);
  observations = *std::move(left);
  return {};
}

Result<Surgery> open_surgery(const ReplayOptions& options) {
  const fs::path& path = options.surgery;
  auto file = io::SurgeryFile::open(path);
  if (!file) return tl::unexpected(file.error());
  const io::SurgeryState& state = file->state();
  std::vector<std::string> notes;
  if (!state.closed) notes.push_back(path.string() + ": " + describe(state));
  io::SurgeryMeta meta = file->meta();
  Status ok = check_given(path, "case_id", meta.case_id);
  if (ok) ok = check_given(path, "model_id", meta.model_id);
  if (!ok) return tl::unexpected(ok.error());
  auto observations = read_observations(*file, path);
  if (!observations) return tl::unexpected(observations.error());
  ok = keep_sources(path, options.sources, *observations);
  if (ok) ok = resume(options, meta, *observations, notes);
  if (!ok) return tl::unexpected(ok.error());

  if (meta.scenario.empty()) meta.scenario = path.stem().string();
  return Surgery{std::move(*file), std::move(meta), std::move(*observations), std::move(notes)};
}

// Its status, when it serves the surgery's case and model.
Result<DaemonStatus> check_daemon(Client& client, const Surgery& surgery,
                                  const ReplayOptions& options) {
  auto status = client.status();
  if (!status) return status;
  if (!status->model_ready) {
    return fail(ErrorCode::kModelNotReady, options.endpoint + ": the daemon has no model loaded");
  }
  const auto differs = [&](const char* key, const std::string& recorded,
                           const std::string& served) {
    return io::invalid_file(
        options.surgery, fmt::format("meta.{} is \"{}\", but the daemon at {} serves \"{}\"", key,
                                     recorded, options.endpoint, served));
  };
  if (status->case_id != surgery.meta.case_id)
    return differs("case_id", surgery.meta.case_id, status->case_id);
  if (status->model_id != surgery.meta.model_id) {
    return differs("model_id", surgery.meta.model_id, status->model_id);
  }
  return status;
}

struct Session {
  Client client;
  DaemonStatus daemon;
  SessionInfo info;
  BrainModel model;
};

// A client of its own per boundary: nothing of an earlier session can still be queued in it.
Result<Session> start_session(const Surgery& surgery, const ReplayOptions& options,
                              Boundary boundary) {
  auto client = Client::connect(options.endpoint, {.keys = options.keys});
  if (!client) return tl::unexpected(client.error());
  auto daemon = check_daemon(*client, surgery, options);
  if (!daemon) return tl::unexpected(daemon.error());
  auto info = client->start_session({.case_id = surgery.meta.case_id,
                                     .method = options.method,
                                     .boundary = boundary,
                                     .publish_iterates = options.repeat == 1,
                                     .takeover = options.takeover,
                                     .recorded_clock = true});
  if (!info) return tl::unexpected(info.error());
  auto model = client->model();
  if (!model) return tl::unexpected(model.error());
  // Every update counts here, and every iterate.
  if (Status ok = client->subscribe(Subscription::kMaxWindow); !ok) {
    return tl::unexpected(ok.error());
  }
  return Session{std::move(*client), std::move(*daemon), std::move(*info), std::move(*model)};
}

Status write_fields(const fs::path& path, const BrainModel& model, const Estimate& estimate,
                    const std::optional<io::SurgeryTruth>& truth) {
  const Points& estimated = estimate.displacement;
  std::vector<io::NodeField> fields;
  fields.push_back({"displacement_estimated", estimated});
  if (estimate.sd_mm.size() > 0) fields.push_back({"sd_mm", estimate.sd_mm.transpose()});
  if (estimate.known.size() > 0) fields.push_back({"known", estimate.known.transpose()});
  if (truth) {
    fields.push_back({"displacement_true", truth->displacement});
    fields.push_back({"error_mm", (estimated - truth->displacement).colwise().norm()});
  }
  return io::write_vtu(path, model.mesh, fields);
}

RunReport describe_run(const Surgery& surgery, const Session& session, const ReplayOptions& options,
                       Boundary boundary) {
  RunReport run;
  run.case_id = surgery.meta.case_id;
  run.scenario = surgery.meta.scenario;
  run.method = to_string(options.method);
  run.boundary = to_string(boundary);
  run.seed = surgery.meta.seed;
  run.model_id = surgery.meta.model_id;
  run.case_file = surgery.meta.case_file;
  run.surgery_file = options.surgery.string();
  run.mesh = {session.info.nodes, session.info.tets, session.info.slaves};
  run.prepare_s = session.info.prepare_s;
  run.model_bytes = session.info.model_bytes;
  return run;
}

// Everything that the last usable update says, with truth where the surgery carries it.
Status evaluate(const Surgery& surgery, const BrainModel& model, const PlayedSession& played,
                const fs::path& field_file, RunReport& run) {
  const Update& update = *played.last;
  if (update.estimate.displacement.cols() != model.mesh.num_nodes()) {
    return fail(
        ErrorCode::kProtocol,
        fmt::format("update {}: displacement of {} nodes, the model has {}", update.sequence,
                    update.estimate.displacement.cols(), model.mesh.num_nodes()));
  }
  const auto truth = read_truth(surgery.file, played.last_recorded_sequence, model);
  if (!truth) return tl::unexpected(truth.error());
  describe(model, update.estimate, run);
  run.left_out = update.left_out;
  run.sources = update.estimate.sources;
  if (*truth) {
    if (Status ok = score(model, **truth, update.estimate, run); !ok) return ok;
  }
  run.trace = trace_of(played, [&](const Points& displacement) {
    return *truth ? cross_error(**truth, displacement) : std::nullopt;
  });
  run.field_file = field_file.filename().string();
  return write_fields(field_file, model, update.estimate, *truth);
}

// Of the recording's last cycle.
Result<std::vector<CoursePoint>> course_of(const Surgery& surgery, const BrainModel& model,
                                           const PlayedSession& played,
                                           const std::vector<NodeIndex>& tumour) {
  std::vector<CoursePoint> course;
  const std::size_t first = played.observations.size() - surgery.observations.size();
  for (std::size_t i = 0; i < surgery.observations.size(); ++i) {
    const RecordedObservation& recorded = surgery.observations[i];
    const PlayedObservation& answer = played.observations[first + i];
    CoursePoint& point = course.emplace_back();
    point.time_s =
        1e-9 * static_cast<double>(recorded.recorded_ns - surgery.observations[0].recorded_ns);
    point.source = recorded.observation.source;
    const auto truth = read_truth(surgery.file, recorded.observation.sequence, model);
    if (!truth) return tl::unexpected(truth.error());
    if (*truth && !tumour.empty()) {
      point.true_tumour_mm = (*truth)->displacement(Eigen::all, tumour).colwise().norm().mean();
    }
    if (!answer.latency_ms) {
      point.quality = answer.superseded ? "superseded" : "failed";
      if (answer.error) point.reason = answer.error->message;
      continue;
    }
    point.quality = to_string(answer.quality.quality);
    point.reason = answer.quality.reason;
    point.latency_ms = answer.latency_ms;
    point.misfit_mm = answer.misfit_mm;
    if (!answer.tumour) continue;
    point.tumour_mm = answer.tumour->mm;
    point.tumour_sd_mm = answer.tumour->sd_mm;
  }
  return course;
}

// A session of its own. What it cannot tell is a note, no failure of the replay.
std::vector<LeftOutScore> left_out_scores(const Surgery& surgery, const ReplayOptions& options,
                                          Boundary boundary, const Progress& progress) {
  auto session = start_session(surgery, options, boundary);
  auto scores =
      session ? leave_one_out(link_to(session->client),
                              {.session_id = session->info.session_id, .timeout = options.timeout},
                              surgery.observations, session->model, progress)
              : Result<std::vector<LeftOutScore>>(tl::unexpected(session.error()));
  if (scores) return *std::move(scores);
  if (options.on_note) options.on_note("nothing was left out to score: " + scores.error().message);
  return {};
}

fs::path csv_path(const ReplayOptions& options, Boundary boundary) {
  if (options.boundaries.size() == 1) return options.latency_csv;
  fs::path path = options.latency_csv;
  path.replace_filename(path.stem().string() + "-" + std::string(to_string(boundary)) +
                        path.extension().string());
  return path;
}

Result<RunReport> run_boundary(const Surgery& surgery, const ReplayOptions& options,
                               Boundary boundary, const Progress& progress) {
  report(progress, "prepare " + std::string(to_string(boundary)), 0.0);
  auto session = start_session(surgery, options, boundary);
  if (!session) return tl::unexpected(session.error());
  report(progress, "prepare " + std::string(to_string(boundary)), 1.0);

  const std::vector<NodeIndex> tumour = geometry::tumour_nodes(session->model);
  const PlayOptions play_options{session->info.session_id, options.speed, options.timeout,
                                 options.repeat, tumour};
  const std::string stage = "replay " + std::string(to_string(boundary));
  const PlayedSession played =
      play(link_to(session->client), surgery.observations, play_options,
           [&](std::string_view, double fraction) { report(progress, stage, fraction); });

  RunReport run = describe_run(surgery, *session, options, boundary);
  summarise(played, run);
  run.lost = played.lost;
  report(progress, "measure " + run.boundary, 0.0);
  if (const auto unit = measure_run_unit(options.endpoint, session->daemon, session->model,
                                         surgery.meta.case_file, boundary)) {
    run.factor_s = unit->factor_s;
    run.full_solve_ms = unit->full_solve_ms;
  } else if (options.on_note) {
    options.on_note("full_solve_ms is not measured: " + unit.error().message);
  }
  report(progress, "measure " + run.boundary, 1.0);
  if (!options.latency_csv.empty()) {
    if (Status ok = io::write_file(csv_path(options, boundary), latency_csv(played)); !ok) {
      return tl::unexpected(ok.error());
    }
  }
  auto course = course_of(surgery, session->model, played, tumour);
  if (!course) return tl::unexpected(course.error());
  run.course = std::move(*course);
  if (played.last) {
    const fs::path field_file =
        options.report.parent_path() /
        (options.report.stem().string() + "-" + run.scenario + "-" + run.boundary + ".vtu");
    if (Status ok = evaluate(surgery, session->model, played, field_file, run); !ok) {
      return tl::unexpected(ok.error());
    }
    if (const auto motion = geometry::tumour_motion(*played.last, tumour)) {
      run.tumour_shift_mm = TumourShift{motion->mm, motion->sd_mm};
    }
    const bool has_truth = run.error_mm.cross || run.largest_true_displacement_mm;
    if (!has_truth && options.method == Method::kCondensed && options.repeat == 1) {
      run.leave_one_out = left_out_scores(surgery, options, boundary, progress);
    }
  }
  return run;
}

Status check_repeat(const ReplayOptions& options, const Surgery& surgery) {
  const auto refuse = [&](const std::string& why) {
    return invalid(fmt::format("repeat = {}: {}", options.repeat, why));
  };
  if (options.repeat < 1) return refuse("must be at least 1");
  if (options.repeat == 1) return {};
  if (!options.resume.empty()) return refuse("a surgery that goes on is played once");
  if (options.speed != Speed::kMax) return refuse("--repeat requires --speed max");
  // Without this the cycles would overlap or leave the range of a surgery file's sequences.
  const std::uint64_t first = surgery.observations.front().observation.sequence;
  const std::uint64_t last = surgery.observations.back().observation.sequence;
  const std::uint64_t limit = std::numeric_limits<std::int64_t>::max();
  const auto more_cycles = static_cast<std::uint64_t>(options.repeat - 1);
  if (last < first || last > limit || more_cycles > (limit - last) / (last - first + 1)) {
    return refuse(fmt::format("observation sequences {} to {} of {} cannot go on counting up",
                              first, last, options.surgery.string()));
  }
  return {};
}

bool is_local(const std::string& endpoint) {
  const auto starts = {"ipc://", "tcp://127.", "tcp://localhost:", "tcp://[::1]:"};
  return std::any_of(starts.begin(), starts.end(),
                     [&](const char* start) { return endpoint.starts_with(start); });
}

}  // namespace

Status replay(const ReplayOptions& options, const Progress& progress,
              const std::function<void(const RunReport&)>& on_run) {
  const auto surgery = open_surgery(options);
  if (!surgery) return tl::unexpected(surgery.error());
  if (Status ok = check_repeat(options, *surgery); !ok) return ok;
  for (const std::string& note : surgery->notes) {
    if (options.on_note) options.on_note(note);
  }
  std::vector<RunReport> runs;
  for (const Boundary boundary : options.boundaries) {
    auto run = run_boundary(*surgery, options, boundary, progress);
    if (!run) return tl::unexpected(run.error());
    if (on_run) on_run(*run);
    runs.push_back(std::move(*run));
    if (runs.back().lost) break;
  }
  if (Status ok = write_reports(options.report, runs); !ok) return ok;
  for (const RunReport& run : runs) {
    if (run.updates > 0) continue;
    const std::string cause = run.failures.empty() ? "" : ": " + run.failures.front().message;
    return io::file_error(
        ErrorCode::kNotConverged, options.surgery,
        fmt::format("no observation was answered with an estimate under the {} boundary{}",
                    run.boundary, cause));
  }
  if (const RunReport& last = runs.back(); last.lost) {
    return io::file_error(
        last.lost->code, options.surgery,
        fmt::format("played in part, {} observations have no answer: {}; {} holds "
                    "what came before, --resume JOURNAL goes on",
                    last.failures.size(), last.lost->message, options.report.string()));
  }
  return {};
}

Result<RunUnit> measure_run_unit(const std::string& endpoint, const DaemonStatus& daemon,
                                 const BrainModel& model, const std::filesystem::path& case_file,
                                 Boundary boundary) {
  if (!is_local(endpoint)) {
    return fail(ErrorCode::kUnavailable, endpoint + ": the daemon may be on another machine");
  }
  if (const std::string own = linalg::blas_kernel(); own != daemon.blas_kernel) {
    return fail(ErrorCode::kUnavailable,
                fmt::format("OpenBLAS kernel {} here, {} in the daemon", own, daemon.blas_kernel));
  }
  const auto config = io::read_case_config(case_file);
  if (!config) return tl::unexpected(config.error());
  linalg::use_single_threaded_blas();
  const auto forward = contact::ForwardModel::build(model, *config, boundary);
  if (!forward) return tl::unexpected(forward.error());
  return RunUnit{forward->factor().factor_seconds(), contact::measure_full_solve_ms(*forward)};
}

}  // namespace brainshift::client
