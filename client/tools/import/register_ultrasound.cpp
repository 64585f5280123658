// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/import/register_ultrasound.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "client/tools/import/import_case.hpp"
#include "client/tools/import/register_picture.hpp"
#include "common/anatomy/given_inputs.hpp"
#include "common/core/small_matrices.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/geometry/distance_volume.hpp"
#include "common/geometry/mask.hpp"
#include "common/geometry/surface.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/geometry/label_map_file.hpp"
#include "common/io/geometry/pose_file.hpp"
#include "common/io/recording/sequence_file.hpp"
#include "common/ultrasound/frame_samples.hpp"

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;

constexpr double kRegion_mm = 2.0;  // voxels of the mask that a model's surface becomes

Status check_ultrasound_options(const UltrasoundRegisterOptions& options) {
  for (const auto& [name, path] :
       {std::pair{"--ultrasound", options.ultrasound}, std::pair{"--mri", options.mri},
        std::pair{"--registration", options.registration}, std::pair{"--out", options.out}}) {
    if (path.empty()) return invalid(std::string(name) + " is required with --ultrasound");
  }
  Status place = check_error_place(options.case_file, options.model, options.target);
  if (!place) return place;
  if (!options.picture.empty() &&
      options.picture.lexically_normal() == options.out.lexically_normal()) {
    return invalid("--picture and --out are one file: " + options.out.string());
  }
  if (options.picture.empty() && options.out.extension() == ".png") {
    return invalid("--out: " + options.out.string() +
                   ": is the name of the picture; the transform is a text file");
  }
  if (options.target && options.brain.empty()) {
    return invalid(
        "--target needs --brain, the brain's mask: skull and scalp, which ultrasound does not "
        "show, would draw the pose away");
  }
  Status ok = check_option("--latency-ms", options.latency_ms, -1000.0, 1000.0);
  if (ok) ok = check_option("--max-age-ms", options.max_age_ms, 0.0, 60000.0);
  return ok ? check_new(options.out) : ok;
}

// ---- the patient: MRI, brain, target ----

struct PatientImages {
  VoxelImage mri, brain;
  std::optional<TriangleSurface> tumour;
  Vec3 target = Vec3::Zero();
};

// > 0.5 inside of a closed surface.
Result<VoxelImage> inside_of(const TriangleSurface& surface) {
  const auto index = geometry::ClosestPointIndex::build(surface);
  if (!index) return tl::unexpected(index.error());
  geometry::DistanceGridOptions how;
  how.spacing_mm = kRegion_mm, how.margin_mm = 2.0 * kRegion_mm;
  const auto grid = geometry::signed_distance_grid(*index, how);
  if (!grid) return tl::unexpected(grid.error());
  VoxelImage image;
  image.dims = grid->dims;
  image.T_ras_voxel.linear() *= grid->spacing_mm;
  image.T_ras_voxel.translation() = grid->origin_mm;
  image.values.reserve(grid->values.size());
  for (const float distance : grid->values) {
    image.values.push_back(std::clamp(0.5F - 0.25F * distance, 0.0F, 1.0F));
  }
  return image;
}

Result<VoxelImage> given_mask(const fs::path& path, anatomy::Notes& notes) {
  const auto image = io::read_volume(path);
  if (!image) return tl::unexpected(image.error());
  return anatomy::brain_mask(*image, path.string(), &notes);
}

Result<PatientImages> read_images(const UltrasoundRegisterOptions& options,
                                  const Progress& progress, anatomy::Notes& notes) {
  PatientImages images;
  auto mri = io::read_volume(options.mri);
  if (!mri) return tl::unexpected(mri.error());
  images.mri = std::move(*mri);
  if (!options.brain.empty()) {
    auto mask = given_mask(options.brain, notes);
    if (!mask) return tl::unexpected(mask.error());
    images.brain = std::move(*mask);
  }
  if (options.target) {
    images.target = *options.target;
    const Status reached = check_in_brain(images.target, "--target " + error_place(options.target),
                                          images.brain, "the brain in " + options.brain.string());
    if (!reached) return tl::unexpected(reached.error());
    return images;
  }
  const auto known = load_import_case(options.case_file, options.model, progress);
  if (!known) return tl::unexpected(known.error());
  images.target = known->tumour_centroid();
  images.tumour = known->model.tumour;
  if (!options.brain.empty()) return images;
  auto mask =
      inside_of(geometry::surface_of(known->model.mesh.nodes, known->model.boundary_triangles));
  if (!mask) return tl::unexpected(mask.error());
  images.brain = std::move(*mask);
  return images;
}

// ---- the frames ----

std::array<Vec3, 4> corners_of(const tracking::Recording& recording, const AffineTransform& T) {
  const double right = recording.width - 1, bottom = recording.height - 1;
  return {T * Vec3(0, 0, 0), T * Vec3(right, 0, 0), T * Vec3(0, bottom, 0),
          T * Vec3(right, bottom, 0)};
}

// Takes the poses from frames that lie where the last one with a pose did; how many.
int leave_out_repeats(const tracking::Recording& recording, ultrasound::ImagePoses& poses) {
  int repeated = 0;
  std::optional<std::array<Vec3, 4>> last;
  for (auto& pose : poses) {
    if (!pose) continue;
    const auto corners = corners_of(recording, *pose);
    double apart = 0.0;
    for (std::size_t c = 0; last && c < 4; ++c) apart += 0.25 * (corners[c] - (*last)[c]).norm();
    if (last && apart < kRepeats_mm) {
      pose.reset();
      ++repeated;
    } else {
      last = corners;
    }
  }
  return repeated;
}

// Standard deviation of the samples along the direction in which they extend least, mm.
double thickness_mm(const Points& positions) {
  const Points off = positions.colwise() - Vec3(positions.rowwise().mean());
  const Mat3 covariance = off * off.transpose() / static_cast<double>(positions.cols());
  return std::sqrt(std::max(0.0, symmetric_eigenvalues(covariance)[0]));
}

// Pixels of a block's side. Precondition: a frame has a pose.
int block_px(const ultrasound::ImagePoses& poses) {
  const auto& T = **std::find_if(poses.begin(), poses.end(), [](const auto& p) { return !!p; });
  const double pixel = std::sqrt(T.linear().col(0).norm() * T.linear().col(1).norm());
  return static_cast<int>(std::clamp(std::round(kSample_mm / pixel), 1.0, 20.0));
}

// Where the frames' samples lie in the reference frame. Fills in what the report says of frames;
// `poses` keeps those that are used.
Result<IntensitySamples> reference_samples(const UltrasoundRegisterOptions& options,
                                           const tracking::Recording& recording,
                                           ultrasound::ImagePoses& poses,
                                           UltrasoundRegisterReport& report) {
  const auto constants = device_links(options.device);
  if (!constants) return tl::unexpected(constants.error());
  tracking::ChainOptions how;
  how.latency_s = 1e-3 * options.latency_ms;
  how.time.max_age_s = 1e-3 * options.max_age_ms;
  auto chain = tracking::evaluate_chain(recording, *constants, options.image_frame,
                                        options.reference_frame, how);
  if (!chain) return io::file_error(options.ultrasound, chain.error());
  report.frames = recording.num_frames();
  report.frames_valid = chain->used;
  report.links = chain->links;
  report.dropped = chain->dropped;
  if (chain->used == 0) {
    std::string reasons;
    for (const auto& dropped : report.dropped) {
      reasons += fmt::format("; {} ({} frames)", dropped.reason, dropped.count);
    }
    return io::file_error(
        ErrorCode::kEmptySet, options.ultrasound,
        fmt::format("none of {} frames has a valid chain{}", report.frames, reasons));
  }
  poses = std::move(chain->T_target_source);
  report.frames_repeated = leave_out_repeats(recording, poses);
  auto samples = ultrasound::frame_samples(
      recording, poses, {0, 0, recording.width, recording.height}, block_px(poses));
  if (!samples) return io::file_error(options.ultrasound, samples.error());
  const double thickness = thickness_mm(samples->positions);
  if (thickness < kLeastThickness_mm) {
    return io::file_error(
        ErrorCode::kEmptySet, options.ultrasound,
        fmt::format("shows too little: its {} frames lie within {:.1f} mm (standard deviation) of "
                    "one plane, {:g} mm are needed; sweep or tilt the probe across the brain",
                    report.frames_valid - report.frames_repeated, thickness, kLeastThickness_mm));
  }
  if (const int frames = report.frames_valid - report.frames_repeated; frames < kParts) {
    // The expected error is a jackknife over kParts parts, which must err independently: parts of
    // one frame do not.
    return io::file_error(
        ErrorCode::kEmptySet, options.ultrasound,
        fmt::format("has too few frames: {} of {} have a valid chain and a place of their own, {} "
                    "are needed",
                    frames, report.frames, kParts));
  }
  report.samples = samples->positions.cols();
  return samples;
}

IntensitySamples placed(const IntensitySamples& samples, const RigidTransform& T) {
  return {(T.linear() * samples.positions).colwise() + Vec3(T.translation()), samples.intensities};
}

// ---- what is found, and how well ----

// What places the samples and the brain stands behind an error about where they lie.
Error placed_by(const UltrasoundRegisterOptions& options, Error error) {
  if (error.code != ErrorCode::kEmptySet) return error;
  error.message += "; by --registration " + options.registration.string();
  if (!options.brain.empty()) error.message += " and --brain " + options.brain.string();
  return error;
}

// Precondition: the samples lie where T_ras_reference of the report places them.
Status judge(const registration::ImageRegistrar& registrar, const IntensitySamples& samples,
             const Vec3& target, UltrasoundRegisterReport& report) {
  if (report.found.agreement < kLeastAgreement) {
    return fail(ErrorCode::kNotConverged,
                fmt::format("the starts disagree: {:.0f} % of them came to the best pose, {:.0f} % "
                            "are needed; ultrasound and MRI match in several ways",
                            100.0 * report.found.agreement, 100.0 * kLeastAgreement));
  }
  const auto poses = registrar.poses_without_parts(samples, kParts);
  if (!poses) return tl::unexpected(poses.error());
  double sum = 0.0;
  for (const RigidTransform& T : *poses) {
    const double moved = (T * target - target).norm();
    sum += moved * moved;
    report.residual_most_mm = std::max(report.residual_most_mm, moved);
  }
  report.residual_mm = std::sqrt(sum / kParts);
  report.expected_mm = registration::jackknife_error_mm(*poses, target);
  if (!(report.expected_mm <= kLargestError_mm)) {
    return fail(ErrorCode::kNotConverged,
                fmt::format("shows too little: the expected error at {} is {:.1f} mm, at most {:g} "
                            "mm are worth a change of a registration by fiducials",
                            report.target, report.expected_mm, kLargestError_mm));
  }
  const auto information = registrar.information(samples);
  if (!information) return tl::unexpected(information.error());
  for (std::string line :
       registration::not_shown(registration::observability(*information, kShownRatio))) {
    const std::string points = "the points";
    report.not_shown.push_back(line.replace(line.rfind(points), points.size(), "the ultrasound"));
  }
  return {};
}

std::string moved_line(const UltrasoundRegisterReport& report) {
  return fmt::format("moved: {} by {:.2f} mm, turned by {:.2f} deg, from the first registration",
                     report.target, report.moved_mm, report.found.rotation_deg);
}
std::string error_line(const UltrasoundRegisterReport& report) {
  return fmt::format("expected error at {} {:.2f} mm rms", report.target, report.expected_mm);
}

// Picture, then transform; none of them where one fails.
Status write_registration(const UltrasoundRegisterOptions& options, const std::string& png,
                          const UltrasoundRegisterReport& report) {
  if (Status ok = io::write_file(report.picture, png); !ok) return ok;
  const Status written = io::write_pose(
      options.out, "T_ras_reference", report.T_ras_reference,
      {"brainshift register --ultrasound: x_ras = T_ras_reference x_reference, lengths mm",
       moved_line(report), error_line(report)});
  if (written) return written;
  std::error_code ignored;
  fs::remove(report.picture, ignored);
  return written;
}

fs::path picture_of(const UltrasoundRegisterOptions& options) {
  return options.picture.empty() ? fs::path(options.out).replace_extension(".png")
                                 : options.picture;
}

}  // namespace

Result<UltrasoundRegisterReport> register_ultrasound(const UltrasoundRegisterOptions& options,
                                                     const Progress& progress) {
  if (Status ok = check_ultrasound_options(options); !ok) return tl::unexpected(ok.error());
  UltrasoundRegisterReport report;
  report.picture = picture_of(options);
  report.target = error_place(options.target);
  if (Status ok = check_new(report.picture); !ok) return tl::unexpected(ok.error());
  const auto T_first = io::read_pose(options.registration, "T_ras_reference");
  if (!T_first) return tl::unexpected(T_first.error());
  const auto recording = io::read_sequence(options.ultrasound, {options.orientation});
  if (!recording) return tl::unexpected(recording.error());
  ultrasound::ImagePoses poses;
  const auto samples = reference_samples(options, *recording, poses, report);
  if (!samples) return tl::unexpected(samples.error());
  const auto images = read_images(options, progress, report.notes);
  if (!images) return tl::unexpected(images.error());

  const auto registrar = registration::ImageRegistrar::create(images->mri, &images->brain);
  if (!registrar) return io::file_error(options.mri, registrar.error());
  const auto found = registrar->align(placed(*samples, *T_first));
  if (!found) return io::file_error(options.ultrasound, placed_by(options, found.error()));
  report.found = *found;
  report.T_ras_reference = found->T_ras_ras * *T_first;
  report.moved_mm = (found->T_ras_ras * images->target - images->target).norm();
  if (Status ok =
          judge(*registrar, placed(*samples, report.T_ras_reference), images->target, report);
      !ok) {
    return io::file_error(options.ultrasound, ok.error());
  }
  report.links.push_back(options.reference_frame + "ToRas");
  RegisteredUltrasound done{*recording, poses, images->mri};
  if (images->tumour) done.tumour = &*images->tumour;
  done.target = images->target;
  done.T_before = *T_first, done.T_after = report.T_ras_reference;
  done.links = report.links;
  done.title = "Ultrasound and MRI, before and after";
  done.subtitle = moved_line(report) + "; " + error_line(report);
  const auto png = registration_png(report.picture.string(), done);
  if (!png) return tl::unexpected(png.error());
  if (Status ok = write_registration(options, *png, report); !ok) {
    return tl::unexpected(ok.error());
  }
  return report;
}

std::vector<std::string> report_lines(const UltrasoundRegisterReport& report) {
  std::vector<std::string> lines;
  lines.push_back(fmt::format("chain: {}", fmt::join(report.links, ", ")));
  lines.push_back(
      fmt::format("frames: {} of {} with a valid chain", report.frames_valid, report.frames));
  if (report.frames_repeated > 0) {
    lines.back() += fmt::format(", {} of them left out: they repeat the place of the one before",
                                report.frames_repeated);
  }
  for (const tracking::Dropped& entry : report.dropped) {
    lines.push_back(fmt::format("frames left out: {} because {} (first: frame {})", entry.count,
                                entry.reason, entry.first_frame));
  }
  const registration::ImageRegistration& found = report.found;
  lines.push_back(moved_line(report));
  lines.push_back(fmt::format(
      "agreement: {:.0f} % of the starts came to this pose; normalised mutual information {:.4f} "
      "before, {:.4f} after; {:.0f} % of the ultrasound lies in the brain",
      100.0 * found.agreement, found.nmi_before, found.nmi_after, 100.0 * found.overlap));
  lines.push_back(
      fmt::format("residual: without an eighth of the frames {} moves by {:.2f} mm rms, {:.2f} mm "
                  "at most",
                  report.target, report.residual_mm, report.residual_most_mm));
  lines.push_back(error_line(report) +
                  ", of these frames; errors that all frames share (calibration, speed of sound) "
                  "are not in it");
  for (const auto* list : {&report.notes, &report.not_shown}) {
    for (const std::string& line : *list) lines.push_back("note: " + line);
  }
  return lines;
}

}  // namespace brainshift::client
