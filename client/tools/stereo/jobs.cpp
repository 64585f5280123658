// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/stereo/jobs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <tuple>

#include "client/tools/stereo/pictures.hpp"
#include "common/core/text.hpp"
#include "common/io/config/calibration_file.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/geometry/mesh_file.hpp"
#include "common/io/geometry/mesh_writer.hpp"
#include "common/io/geometry/pose_file.hpp"
#include "common/io/model/model_file.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/values/observation.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::client {
namespace {

// "9x6"
Result<stereo::ChessBoard> parse_board(const std::string& text, double square_mm) {
  stereo::ChessBoard board;
  board.square_mm = square_mm;
  const char* end = text.data() + text.size();
  const auto [cross, wrong] = std::from_chars(text.data(), end, board.columns);
  if (wrong == std::errc() && cross != end && *cross == 'x') {
    const auto [stop, error] = std::from_chars(cross + 1, end, board.rows);
    if (error == std::errc() && stop == end) return board;
  }
  return invalid(fmt::format("--board {}: must be inner corners along and across, e.g. 9x6", text));
}

// A camera looks from some 300 mm: a rotation off by 1e-4 moves the cortex by 0.03 mm.
constexpr double kCameraPoseTolerance = 1e-4;

namespace fs = std::filesystem;

constexpr double kNanosecondsPerSecond = 1e9;
constexpr std::int64_t kDefaultStepNs = 1'000'000'000;
constexpr double kMaxSeconds = 1e6;  // more than a week is no surgery
constexpr std::size_t kMaxSource = 64;

Status check(const ObserveJob& job) {
  if (!(std::isfinite(job.sd_mm) && job.sd_mm > 0.0)) {
    return invalid(fmt::format("--sd-mm {}: must be finite and > 0", job.sd_mm));
  }
  if (job.time_s && !(*job.time_s >= 0.0 && *job.time_s <= kMaxSeconds)) {
    return invalid(
        fmt::format("--time-s {}: must be between 0 and {:g}", *job.time_s, kMaxSeconds));
  }
  if (job.source.empty() || job.source.size() > kMaxSource) {
    return invalid("--source must have 1 to 64 characters");
  }
  return {};
}

// Where the next observation goes: after everything that the surgery holds.
struct Place {
  std::uint64_t last_sequence = 0;
  std::optional<std::int64_t> last_ns;
};

Result<Place> last_place(const io::SurgeryFile& surgery, const fs::path& path) {
  const auto records = surgery.records(io::RecordKind::kObservation);
  if (!records) return tl::unexpected(records.error());
  Place place;
  for (const io::SurgeryRecord& record : *records) {
    const auto observation = wire::decode_observation(record.payload);
    if (!observation) {
      return io::file_error(
          observation.error().code, path,
          "observation " + std::to_string(record.sequence) + ": " + observation.error().message);
    }
    place.last_sequence = std::max(place.last_sequence, observation->sequence);
    place.last_ns =
        std::max(place.last_ns.value_or(observation->acquired_ns), observation->acquired_ns);
  }
  return place;
}

Status check_same(const io::SurgeryFile& surgery, const fs::path& path, const BrainModel& model) {
  const io::SurgeryMeta& meta = surgery.meta();
  for (const auto& [key, theirs, ours] : {std::tuple("case_id", meta.case_id, model.case_id),
                                          std::tuple("model_id", meta.model_id, model.model_id)}) {
    if (theirs == ours) continue;
    return io::invalid_file(path,
                            fmt::format("{} is \"{}\": the model's is \"{}\"", key, theirs, ours));
  }
  return {};
}

// The surgery to write to, new or not, and the place in it.
struct Target {
  io::SurgeryFile file;
  Place place;
};

Result<Target> open_target(const fs::path& path, const io::ModelFile& model) {
  if (fs::exists(path)) {
    auto file = io::SurgeryFile::open_to_append(path);
    if (!file) return tl::unexpected(file.error());
    if (Status ok = check_same(*file, path, model.model); !ok) return tl::unexpected(ok.error());
    auto place = last_place(*file, path);
    if (!place) return tl::unexpected(place.error());
    return Target{std::move(*file), *place};
  }
  auto file = io::SurgeryFile::create(path, {.case_id = model.model.case_id,
                                             .model_id = model.model.model_id,
                                             .case_file = model.config.file.string(),
                                             .scenario = "recorded",
                                             .created_utc = utc_now(),
                                             .software = "brainshift stereo"});
  if (!file) return tl::unexpected(file.error());
  return Target{std::move(*file), {}};
}

Result<std::int64_t> acquired_ns(const ObserveJob& job, const Place& place) {
  if (!job.time_s) return place.last_ns ? *place.last_ns + kDefaultStepNs : 0;
  const auto wanted = static_cast<std::int64_t>(std::llround(*job.time_s * kNanosecondsPerSecond));
  if (!place.last_ns || wanted > *place.last_ns) return wanted;
  return io::invalid_file(
      job.out,
      fmt::format("--time-s {:g}: must be above {:g}, the time of its last observation",
                  *job.time_s, static_cast<double>(*place.last_ns) / kNanosecondsPerSecond));
}

Result<geometry::CheckedSurface> checked_surface(const ObserveJob& job, const BrainModel& model) {
  auto surface = io::read_surface_or_points(job.surface);
  if (!surface) return tl::unexpected(surface.error());
  if (surface->num_vertices() > wire::kMaxPoints || surface->num_triangles() > wire::kMaxPoints) {
    return io::invalid_file(
        job.surface,
        fmt::format("has {} points and {} triangles: at most {} of each", surface->num_vertices(),
                    surface->num_triangles(), wire::kMaxPoints));
  }
  const auto site = geometry::craniotomy_site(model);
  if (!site) return tl::unexpected(site.error());
  auto checked = geometry::check_cortical_surface(std::move(*surface), *site);
  if (!checked) return io::file_error(job.surface, checked.error());
  return checked;
}

}  // namespace

Result<stereo::CalibrationResult> calibrate_files(const CalibrateJob& job,
                                                  const Progress& progress) {
  const auto board = parse_board(job.board, job.square_mm);
  if (!board) return tl::unexpected(board.error());
  if (Status ok = stereo::validate(*board); !ok) return tl::unexpected(ok.error());
  const auto left = expand_patterns(job.left);
  if (!left) return tl::unexpected(left.error());
  const auto right = expand_patterns(job.right);
  if (!right) return tl::unexpected(right.error());
  if (left->size() != right->size()) {
    return invalid(
        fmt::format("{} left and {} right pictures: must be as many", left->size(), right->size()));
  }
  std::vector<stereo::PicturePair> pairs;
  for (std::size_t i = 0; i < left->size(); ++i) {
    report(progress, "read pictures", static_cast<double>(i) / static_cast<double>(left->size()));
    auto first = read_picture((*left)[i]);
    if (!first) return tl::unexpected(first.error());
    auto second = read_picture((*right)[i]);
    if (!second) return tl::unexpected(second.error());
    pairs.push_back({(*left)[i].filename().string(), std::move(*first), std::move(*second)});
  }
  report(progress, "read pictures", 1.0);
  report(progress, "calibrate", 0.0);
  auto result = stereo::calibrate(pairs, *board);
  if (!result) return result;
  if (Status ok = io::write_calibration(job.out, result->calibration); !ok)
    return tl::unexpected(ok.error());
  report(progress, "calibrate", 1.0);
  return result;
}

Result<ReconstructSummary> reconstruct_files(const ReconstructJob& job, const Progress& progress) {
  const auto calibration = io::read_calibration(job.calibration);
  if (!calibration) return tl::unexpected(calibration.error());
  const auto T_ras_camera = io::read_pose(job.pose, "T_ras_camera", kCameraPoseTolerance);
  if (!T_ras_camera) return tl::unexpected(T_ras_camera.error());
  const auto left = read_picture(job.left);
  if (!left) return tl::unexpected(left.error());
  const auto right = read_picture(job.right);
  if (!right) return tl::unexpected(right.error());
  report(progress, "match", 0.0);
  const auto measured = stereo::measure_disparity(*left, *right, *calibration, job.range);
  // What goes wrong with a pair is told with its left picture's name.
  if (!measured) return io::file_error(job.left, measured.error());
  report(progress, "match", 1.0);
  auto made = stereo::reconstruct(measured->map, measured->geometry, *T_ras_camera, job.options);
  if (!made) return io::file_error(job.left, made.error());
  if (Status ok = io::write_surface(
          job.out, made->surface,
          {{"sd_mm", made->sd_mm.transpose()}, {"confidence", made->confidence.transpose()}});
      !ok)
    return tl::unexpected(ok.error());
  if (!job.disparity_picture.empty()) {
    if (Status ok = write_disparity_picture(job.disparity_picture, *measured); !ok)
      return tl::unexpected(ok.error());
  }
  return ReconstructSummary{std::move(*made), measured->map.valid_fraction};
}

Result<ObserveSummary> observe_surface(const ObserveJob& job) {
  if (Status ok = check(job); !ok) return tl::unexpected(ok.error());
  const auto model = io::read_model(job.model, {});
  if (!model) return tl::unexpected(model.error());
  auto checked = checked_surface(job, model->model);
  if (!checked) return tl::unexpected(checked.error());
  auto target = open_target(job.out, *model);
  if (!target) return tl::unexpected(target.error());
  const auto time_ns = acquired_ns(job, target->place);
  if (!time_ns) return tl::unexpected(time_ns.error());
  Observation observation;
  observation.case_id = model->model.case_id;
  observation.source = job.source;
  observation.sequence = target->place.last_sequence + 1;
  observation.acquired_ns = *time_ns;
  observation.body = CorticalSurface{checked->surface, job.sd_mm};
  Status status = target->file.append({io::RecordKind::kObservation, observation.sequence,
                                       observation.acquired_ns, wire::encode(observation)});
  if (status) status = target->file.close();
  if (!status) return tl::unexpected(status.error());
  return ObserveSummary{std::move(*checked), observation.sequence,
                        static_cast<double>(*time_ns) / kNanosecondsPerSecond};
}

}  // namespace brainshift::client
