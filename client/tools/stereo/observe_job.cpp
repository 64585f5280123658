// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "client/tools/stereo/jobs.hpp"
#include "common/core/utc_time.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/geometry/mesh_file.hpp"
#include "common/io/model/model_file.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/values/observation.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;

constexpr double kNanosecondsPerSecond = 1e9;
constexpr std::int64_t kDefaultStepNs = 1'000'000'000;
constexpr double kMaxSeconds = 1e6;  // more than a week is no surgery
constexpr std::size_t kMaxSource = 64;

Status check(const ObserveJob& job) {
  if (!(std::isfinite(job.sd_mm) && job.sd_mm > 0.0)) {
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("--sd-mm {}: must be finite and > 0", job.sd_mm));
  }
  if (job.time_s && !(*job.time_s >= 0.0 && *job.time_s <= kMaxSeconds)) {
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("--time-s {}: must be between 0 and {:g}", *job.time_s, kMaxSeconds));
  }
  if (job.source.empty() || job.source.size() > kMaxSource) {
    return fail(ErrorCode::kInvalidArgument, "--source must have 1 to 64 characters");
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
    return io::file_error(ErrorCode::kInvalidArgument, path,
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
  io::SurgeryMeta meta;
  meta.case_id = model.model.case_id;
  meta.model_id = model.model.model_id;
  meta.case_file = model.config.file.string();
  meta.scenario = "recorded";
  meta.created_utc = utc_now();
  meta.software = "brainshift stereo";
  auto file = io::SurgeryFile::create(path, meta);
  if (!file) return tl::unexpected(file.error());
  return Target{std::move(*file), {}};
}

Result<std::int64_t> acquired_ns(const ObserveJob& job, const Place& place) {
  if (!job.time_s) return place.last_ns ? *place.last_ns + kDefaultStepNs : 0;
  const auto wanted = static_cast<std::int64_t>(std::llround(*job.time_s * kNanosecondsPerSecond));
  if (!place.last_ns || wanted > *place.last_ns) return wanted;
  return io::file_error(
      ErrorCode::kInvalidArgument, job.out,
      fmt::format("--time-s {:g}: must be above {:g}, the time of its last observation",
                  *job.time_s, static_cast<double>(*place.last_ns) / kNanosecondsPerSecond));
}

Result<geometry::CheckedSurface> checked_surface(const ObserveJob& job, const BrainModel& model) {
  auto surface = io::read_surface_or_points(job.surface);
  if (!surface) return tl::unexpected(surface.error());
  if (surface->num_vertices() > wire::kMaxPoints || surface->num_triangles() > wire::kMaxPoints) {
    return io::file_error(
        ErrorCode::kInvalidArgument, job.surface,
        fmt::format("has {} points and {} triangles: at most {} of each", surface->num_vertices(),
                    surface->num_triangles(), wire::kMaxPoints));
  }
  const auto site = geometry::craniotomy_site(model);
  if (!site) return tl::unexpected(site.error());
  auto checked = geometry::check_cortical_surface(std::move(*surface), *site);
  if (!checked) return io::file_error(checked.error().code, job.surface, checked.error().message);
  return checked;
}

}  // namespace

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
