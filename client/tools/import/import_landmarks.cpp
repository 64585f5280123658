// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/import/import_landmarks.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "client/tools/import/import_case.hpp"
#include "common/geometry/misplacement.hpp"
#include "common/geometry/tet_locator.hpp"
#include "common/io/landmarks/pair_file.hpp"
#include "common/registration/fiducials.hpp"
#include "common/values/observation.hpp"

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMinPairs = 3;  // as the daemon needs
constexpr double kMinSd_mm = 0.01, kMaxLandmarkSd_mm = 20.0;

Status check_landmark_import(const LandmarkOptions& options) {
  if (options.landmarks.empty()) return invalid("--landmarks is required");
  if (options.out.empty()) return invalid("--out is required");
  if (Status ok = check_one_case(options.case_file, options.model); !ok) return ok;
  const Status ok = check_option("--sd-mm", options.sd_mm, kMinSd_mm, kMaxLandmarkSd_mm);
  return ok ? check_new(options.out) : ok;
}

// "landmark 3", and its name where it has one.
std::string called(const io::NamedPairs& pairs, std::size_t i) {
  const std::string& name = pairs.names[i];
  return name.empty() ? fmt::format("landmark {}", i + 1) : fmt::format("landmark \"{}\"", name);
}

Status measure_motion(const io::NamedPairs& pairs, LandmarkReport& report) {
  double sum = 0.0, squares = 0.0;
  for (std::size_t i = 0; i < pairs.names.size(); ++i) {
    const double moved = (pairs.second[i] - pairs.first[i]).norm();
    if (moved > kLargestMotion_mm) {
      return invalid(
          fmt::format("{} moved {:.0f} mm: must be within {:.0f} mm; are both its places mm RAS?",
                      called(pairs, i), moved, kLargestMotion_mm));
    }
    sum += moved, squares += moved * moved;
    if (moved >= report.largest_mm) report.largest_mm = moved, report.largest = called(pairs, i);
  }
  const auto count = static_cast<double>(pairs.names.size());
  report.pairs = static_cast<int>(pairs.names.size());
  report.mean_mm = sum / count;
  report.rms_mm = std::sqrt(squares / count);
  return {};
}

void split_off_rigid_part(const io::NamedPairs& pairs, LandmarkReport& report) {
  const Points before = columns_of(pairs.first), during = columns_of(pairs.second);
  const auto fit = registration::register_fiducials(before, during);
  if (!fit) {
    report.no_rigid = fit.error().message;
    return;
  }
  RigidPart part;
  part.rotation_deg =
      Eigen::AngleAxisd(fit->T_image_measured.linear()).angle() * 180.0 / std::numbers::pi;
  part.translation_mm = (during.rowwise().mean() - before.rowwise().mean()).norm();
  part.residual_mm = fit->fre_mm;
  report.rigid = part;
}

Status check_place(const io::NamedPairs& pairs, const BrainModel& model, LandmarkReport& report) {
  const geometry::TetLocator brain(model.mesh);
  for (std::size_t i = 0; i < pairs.names.size(); ++i) {
    const double outside = brain.locate(pairs.first[i]).distance_mm;
    if (outside > kLargestOutside_mm) {
      const Vec3& at = pairs.first[i];
      const std::string mistake =
          geometry::likely_mistake(columns_of(pairs.first), [&](const Points& meant) {
            for (const auto point : meant.colwise()) {
              if (brain.locate(point).distance_mm > kLargestOutside_mm) return false;
            }
            return true;
          });
      return invalid(fmt::format(
          "{} lies at ({:.1f}, {:.1f}, {:.1f}) before surgery, {:.0f} mm outside the brain of "
          "case {}: must be within {:.0f} mm{}",
          called(pairs, i), at.x(), at.y(), at.z(), outside, model.case_id, kLargestOutside_mm,
          mistake.empty() ? "; is it mm RAS, and of this patient?" : mistake));
    }
    if (outside <= 0.0) continue;
    ++report.outside;
    if (outside > report.farthest_outside_mm) {
      report.farthest_outside_mm = outside, report.farthest_outside = called(pairs, i);
    }
  }
  return {};
}

Observation observation_of(const io::NamedPairs& pairs, const std::string& case_id, double sd_mm) {
  Observation observation;
  observation.case_id = case_id;
  observation.source = "landmarks";
  observation.sequence = 1;
  observation.body = LandmarkPairs{columns_of(pairs.first), columns_of(pairs.second), sd_mm};
  return observation;
}

// The files, as a sentence about both names them.
std::string files_of(const LandmarkOptions& options) {
  std::string files = options.landmarks.string();
  if (!options.landmarks_moved.empty()) files += " and " + options.landmarks_moved.string();
  return files;
}

}  // namespace

Result<LandmarkReport> import_landmarks(const LandmarkOptions& options, const Progress& progress) {
  if (Status ok = check_landmark_import(options); !ok) return tl::unexpected(ok.error());
  const auto pairs = options.landmarks_moved.empty()
                         ? io::read_pairs(options.landmarks)
                         : io::read_pairs(options.landmarks, options.landmarks_moved);
  if (!pairs) return tl::unexpected(pairs.error());
  const auto failed = [&](const Error& error) {
    return fail(error.code, files_of(options) + ": " + error.message);
  };
  LandmarkReport report;
  report.left_out = pairs->left_out;
  if (pairs->names.size() < kMinPairs) {
    return failed(
        {ErrorCode::kInvalidArgument,
         fmt::format("{} landmark pairs: at least {} are needed", pairs->names.size(), kMinPairs)});
  }
  if (Status ok = measure_motion(*pairs, report); !ok) return failed(ok.error());
  split_off_rigid_part(*pairs, report);
  const auto known = load_import_case(options.case_file, options.model, progress);
  if (!known) return tl::unexpected(known.error());
  if (Status ok = check_place(*pairs, known->model, report); !ok) return failed(ok.error());
  const auto meta = known->meta(options.landmarks.stem().string(), "brainshift import");
  const Status written = write_surgery(
      options.out, meta, {observation_of(*pairs, known->model.case_id, options.sd_mm)});
  if (!written) return tl::unexpected(written.error());
  return report;
}

std::vector<std::string> report_lines(const LandmarkReport& report) {
  std::vector<std::string> lines = {fmt::format(
      "landmarks: {} pairs, moved {:.2f} mm on average ({:.2f} rms), at most {:.2f} mm ({})",
      report.pairs, report.mean_mm, report.rms_mm, report.largest_mm, report.largest)};
  if (report.rigid) {
    lines.push_back(fmt::format(
        "rigid part: rotation {:.2f} degrees, translation {:.2f} mm (of the landmarks' centroid); "
        "without it {:.2f} mm rms remain",
        report.rigid->rotation_deg, report.rigid->translation_mm, report.rigid->residual_mm));
    lines.emplace_back(
        "note: a misregistration of the second image would be such a rigid part; it is kept, and "
        "the daemon takes it for motion of the tissue unless the case says how well that image is "
        "registered (sensing.landmark_pose_sd_mm, sensing.landmark_pose_sd_deg)");
  } else {
    lines.emplace_back("note: no rigid part can be computed: " + report.no_rigid);
  }
  if (report.outside > 0) {
    lines.emplace_back(
        fmt::format("note: {} landmarks lie outside the mesh of the brain, at most {:.1f} mm ({})",
                    report.outside, report.farthest_outside_mm, report.farthest_outside));
  }
  for (const std::string& name : report.left_out) {
    lines.emplace_back("note: left out, since only one file has it: \"" + name + "\"");
  }
  return lines;
}

}  // namespace brainshift::client
