// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/import/import.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "common/io/files/file_access.hpp"
#include "common/io/geometry/pose_file.hpp"
#include "common/io/recording/contour_file.hpp"
#include "common/io/recording/fiducial_file.hpp"
#include "common/io/recording/sequence_file.hpp"
#include "common/values/observation.hpp"

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRas = "Ras";
constexpr double kFarthest_mm = 100.0;
// Trackers stand metres away from what they track: a link that stays
// nearer than this is suspicious.
constexpr double kNearTracker_mm = 10.0;
constexpr double kMaxSd_mm = 20.0;

Status check_import(const ImportOptions& options) {
  const auto one_of = [](bool first, bool second, const char* names) -> Status {
    if (first != second) return {};
    return invalid(
        fmt::format("exactly one of {} is required, {} given", names, first ? "both" : "none"));
  };
  for (const auto& [name, path] :
       {std::pair{"--recording", options.recording}, std::pair{"--out", options.out}}) {
    if (path.empty()) return invalid(std::string(name) + " is required");
  }
  Status ok = one_of(!options.contours.empty(), !options.seeds.empty(), "--contours and --seeds");
  if (ok) {
    ok = one_of(!options.registration.empty(), !options.fiducials.empty(),
                "--registration and --fiducials");
  }
  if (ok) ok = check_one_case(options.case_file, options.model);
  if (ok) ok = check_option("--sd-mm", options.sd_mm, 0.01, kMaxSd_mm);
  if (ok) ok = check_option("--latency-ms", options.latency_ms, -1000.0, 1000.0);
  if (ok) ok = check_option("--max-age-ms", options.max_age_ms, 0.0, 60000.0);
  if (ok) ok = check_option("--sweeps", options.sweep_gap_s, 0.0, 86400.0);
  return ok ? check_new(options.out) : ok;
}

// T_ras_reference, from the file or from fiducials.
Result<RigidTransform> patient_registration(const ImportOptions& options,
                                            std::optional<io::FiducialFile>& fiducials) {
  if (options.fiducials.empty()) return io::read_pose(options.registration, "T_ras_reference");
  auto file = io::read_fiducials(options.fiducials);
  if (!file) return tl::unexpected(file.error());
  fiducials = std::move(*file);
  return fiducials->fit.T_image_measured;
}

// Device transforms and the patient registration.
Result<std::vector<tracking::ConstantLink>> constant_links(
    const ImportOptions& options, std::optional<io::FiducialFile>& fiducials) {
  auto links = device_links(options.device);
  if (!links) return links;
  const auto T_ras_reference = patient_registration(options, fiducials);
  if (!T_ras_reference) return tl::unexpected(T_ras_reference.error());
  links->push_back({{options.reference_frame, kRas}, AffineTransform(*T_ras_reference)});
  return links;
}

void note_recording(const tracking::Recording& recording, std::vector<std::string>& notes) {
  std::map<std::string, std::pair<int, const tracking::Defect*>> by_reason;
  for (const tracking::Defect& defect : recording.defects) {
    auto& entry = by_reason[defect.field.substr(defect.field.find('_', 4) + 1)];
    if (entry.first++ == 0) entry.second = &defect;
  }
  for (const auto& [name, entry] : by_reason) {
    notes.push_back(
        fmt::format("{} is not usable on {} frames whose status is OK; the first: {} {}", name,
                    entry.first, entry.second->field, entry.second->what));
  }
  for (const tracking::LinkSeries& series : recording.links) {
    double farthest = 0.0;
    for (const tracking::Link& link : series.samples) {
      if (link.status == tracking::LinkStatus::kOk) {
        farthest = std::max(farthest, link.T_to_from.translation().norm());
      }
    }
    if (series.frames.to == "Tracker" && farthest > 0.0 && farthest < kNearTracker_mm) {
      notes.push_back(
          fmt::format("{} is never farther than {:.3g} from the tracker: metres for mm?",
                      series.frames.name(), farthest));
    }
  }
}

Result<std::vector<Observation>> observations_of(const Boundaries& boundaries,
                                                 const ImportCase& patient, double sd_mm,
                                                 ImportReport& report) {
  std::vector<Observation> observations;
  for (const SweepBoundary& sweep : boundaries.sweeps) {
    ImportedSweep told;
    told.sequence = observations.size() + 1;
    told.first_frame = sweep.first_frame, told.last_frame = sweep.last_frame;
    told.contours = sweep.contours, told.points = sweep.points.cols();
    told.extent_mm = (sweep.points.rowwise().maxCoeff() - sweep.points.rowwise().minCoeff()).norm();
    const Vec3 centroid = sweep.points.rowwise().mean();
    told.tumour_distance_mm = (centroid - patient.tumour_centroid()).norm();
    if (told.tumour_distance_mm > kFarthest_mm) {
      std::string notes;
      for (const std::string& note : report.notes) notes += "; " + note;
      return invalid(
          fmt::format("the boundary of frames {} to {} lies {:.0f} mm from the tumour of "
                      "case {}: must be within {:.0f} mm; is it the right registration{}",
                      sweep.first_frame, sweep.last_frame, told.tumour_distance_mm,
                      patient.model.case_id, kFarthest_mm, notes.empty() ? "?" : notes));
    }
    Observation observation;
    observation.case_id = patient.model.case_id;
    observation.source = "ius";
    observation.sequence = told.sequence;
    observation.acquired_ns = std::llround(1e9 * sweep.time_s);
    observation.body = TumourBoundary{sweep.points, sd_mm};
    observations.push_back(std::move(observation));
    report.sweeps.push_back(told);
  }
  return observations;
}

}  // namespace

Result<ImportReport> import_recording(const ImportOptions& options, const Progress& progress) {
  if (Status ok = check_import(options); !ok) return tl::unexpected(ok.error());
  std::optional<io::FiducialFile> fiducials;
  const auto constants = constant_links(options, fiducials);
  if (!constants) return tl::unexpected(constants.error());
  const auto recording = io::read_sequence(options.recording, {options.orientation});
  if (!recording) return tl::unexpected(recording.error());
  ImportReport told;
  note_recording(*recording, told.notes);
  const auto contours =
      options.seeds.empty()
          ? contours_of_file(options.contours, !options.open_contours, nullptr, told.notes)
          : contours_of_seeds(*recording, options.seeds, told.notes);
  if (!contours) return tl::unexpected(contours.error());

  BoundaryOptions boundary;
  boundary.image_frame = options.image_frame;
  boundary.chain.latency_s = 1e-3 * options.latency_ms;
  boundary.chain.time.max_age_s = 1e-3 * options.max_age_ms;
  boundary.sweep_gap_s = options.sweep_gap_s;
  const auto boundaries = boundaries_in_ras(*recording, *constants, *contours, boundary);
  if (!boundaries) return io::file_error(options.recording, boundaries.error());
  told.frames = recording->num_frames();
  told.frames_used = boundaries->chain.used;
  told.links = boundaries->chain.links;
  told.dropped = boundaries->chain.dropped;
  told.lost_contours = boundaries->lost_contours;
  const auto patient = load_import_case(options.case_file, options.model, progress);
  if (!patient) return tl::unexpected(patient.error());
  if (fiducials) {
    told.fiducials = describe(fiducials->fit, fiducials->matched, patient->tumour_centroid());
  }
  const auto observations = observations_of(*boundaries, *patient, options.sd_mm, told);
  if (!observations) return io::file_error(options.recording, observations.error());
  const auto meta = patient->meta(options.recording.stem().string(), "brainshift import");
  if (Status ok = write_surgery(options.out, meta, *observations); !ok) {
    return tl::unexpected(ok.error());
  }
  return told;
}

std::vector<std::string> report_lines(const ImportReport& report) {
  std::vector<std::string> lines;
  lines.push_back(fmt::format("chain: {}", fmt::join(report.links, ", ")));
  lines.push_back(
      fmt::format("frames: {} of {} with a valid chain", report.frames_used, report.frames));
  const auto tell = [&lines](const char* what, const std::vector<tracking::Dropped>& dropped) {
    for (const tracking::Dropped& entry : dropped) {
      lines.push_back(fmt::format("{}: {} because {} (first: frame {})", what, entry.count,
                                  entry.reason, entry.first_frame));
    }
  };
  if (report.fiducials) {
    const auto told = fiducial_lines(*report.fiducials, {}, "the tumour");
    lines.insert(lines.end(), told.begin(), told.end());
  }
  tell("frames left out", report.dropped);
  tell("contours left out", report.lost_contours);
  for (const std::string& note : report.notes) lines.push_back("note: " + note);
  for (const ImportedSweep& sweep : report.sweeps) {
    lines.push_back(
        fmt::format("sweep {}: frames {} to {}, {} contours, {} boundary points, extent {:.1f} mm, "
                    "{:.1f} mm from the tumour before surgery",
                    sweep.sequence, sweep.first_frame, sweep.last_frame, sweep.contours,
                    sweep.points, sweep.extent_mm, sweep.tumour_distance_mm));
  }
  return lines;
}

}  // namespace brainshift::client
