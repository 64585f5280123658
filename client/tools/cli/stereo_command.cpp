// SPDX-License-Identifier: GPL-3.0-or-later
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "client/tools/cli/command.hpp"
#include "client/tools/stereo/jobs.hpp"
#include "common/io/files/output_path.hpp"

namespace brainshift::client {
namespace {

Status run_calibrate(const CalibrateJob& job) {
  if (Status ok = io::check_output_file("--out", job.out); !ok) return ok;
  const auto result = calibrate_files(job, terminal_progress());
  if (!result) return tl::unexpected(result.error());
  const StereoCalibration& c = result->calibration;
  std::printf("%zu pairs used, %zu without a whole board\n", c.pairs.size(),
              result->without_board.size());
  for (const std::string& name : result->without_board)
    std::printf("  no board    %s\n", name.c_str());
  for (const CalibrationPair& pair : c.pairs)
    std::printf("  %6.3f px   %s\n", pair.rms_px, pair.name.c_str());
  std::printf("reprojection error %.3f px rms, epipolar error %.3f px rms\n", c.rms_px,
              c.epipolar_rms_px);
  std::printf("focal lengths %.1f and %.1f px, baseline %.2f mm\n", c.left.focal_x_px,
              c.right.focal_x_px, right_camera_in_left(c).norm());
  return {};
}

Status run_reconstruct(const ReconstructJob& job) {
  if (Status ok = io::check_output_file("--out", job.out); !ok) return ok;
  if (!job.disparity_picture.empty()) {
    if (Status ok = io::check_output_file("--disparity-png", job.disparity_picture); !ok) return ok;
  }
  const auto summary = reconstruct_files(job, terminal_progress());
  if (!summary) return tl::unexpected(summary.error());
  const stereo::ReconstructedSurface& made = summary->made;
  std::printf("%d points, %d triangles; %.0f %% of the pixels matched\n",
              made.surface.num_vertices(), made.surface.num_triangles(),
              100.0 * summary->matched_fraction);
  std::printf("median distance %.1f mm, median standard deviation %.3f mm\n", made.median_depth_mm,
              made.median_sd_mm);
  std::printf("left out: %d pixels in small parts, %d outlying points\n",
              made.pixels_in_small_parts, made.outlier_points);
  print_wrote(job.out);
  return {};
}

Status run_observe(const ObserveJob& job) {
  if (Status ok = io::check_output_file("--out", job.out); !ok) return ok;
  const auto summary = observe_surface(job);
  if (!summary) return tl::unexpected(summary.error());
  const geometry::CheckedSurface& checked = summary->checked;
  std::printf(
      "observation %llu at %g s: %d points, %d triangles, spanning %.1f mm, %.1f mm from "
      "the craniotomy's centre\n",
      static_cast<unsigned long long>(summary->sequence), summary->time_s,
      checked.surface.num_vertices(), checked.surface.num_triangles(), checked.extent_mm,
      checked.distance_mm);
  for (const std::string& note : checked.notes) std::printf("note: %s\n", note.c_str());
  print_wrote(job.out);
  return {};
}

void add_calibrate(CLI::App& app, Status& status) {
  auto job = std::make_shared<CalibrateJob>();
  CLI::App* command =
      app.add_subcommand("calibrate", "Calibrate two cameras from pictures of a chessboard.");
  add_required(*command, "--left", job->left, "pictures of the left camera, files or 'patterns*'");
  add_required(*command, "--right", job->right, "pictures of the right camera, in the same order");
  add_with_default(*command, "--board", job->board, "inner corners of the board, along x across");
  add_required(*command, "--square-mm", job->square_mm, "side of a square, mm");
  add_required(*command, "--out", job->out, "calibration file to write (YAML)");
  command->footer(
      "Example, with the pictures of Debian's opencv-doc:\n"
      "  cd /usr/share/doc/opencv-doc/examples/data\n"
      "  brainshift stereo calibrate --left 'left[01]*.jpg' --right 'right[01]*.jpg' --board 9x6 "
      "--square-mm 25 --out /tmp/calibration.yaml");
  command->callback([job, &status] { status = run_calibrate(*job); });
}

void add_reconstruct(CLI::App& app, Status& status) {
  auto job = std::make_shared<ReconstructJob>();
  CLI::App* command =
      app.add_subcommand("reconstruct", "Make a surface in patient RAS from a pair of pictures.");
  add_required(*command, "--left", job->left, "picture of the left camera");
  add_required(*command, "--right", job->right, "picture of the right camera");
  add_required(*command, "--calibration", job->calibration, "calibration file");
  add_required(*command, "--pose", job->pose,
               "T_ras_camera, left camera frame to RAS: 16 numbers (.txt), or YAML");
  add_required(*command, "--out", job->out, "surface to write, .ply or .vtp, with sd_mm per point");
  command->add_option("--disparity-png", job->disparity_picture, "picture of the disparities");
  add_with_default(*command, "--near-mm", job->range.near_mm, "nearest distance looked at");
  add_with_default(*command, "--far-mm", job->range.far_mm, "farthest distance looked at");
  add_with_default(*command, "--spacing-mm", job->options.spacing_mm, "between points");
  command->footer(
      "The pose is what the tracking system says of the camera at that moment. As text:\n"
      "  1 0 0 -20\n"
      "  0 -1 0 35\n"
      "  0 0 -1 310\n"
      "  0 0 0 1\n"
      "Example:\n"
      "  brainshift stereo reconstruct --left L.png --right R.png --calibration calibration.yaml "
      "--pose T_ras_camera.txt --out cortex.ply --disparity-png disparity.png");
  command->callback([job, &status] { status = run_reconstruct(*job); });
}

void add_observe(CLI::App& app, Status& status) {
  auto job = std::make_shared<ObserveJob>();
  CLI::App* command = app.add_subcommand(
      "observe", "Check a cortical surface against a case and add it to a surgery file.");
  add_required(*command, "--surface", job->surface,
               ".ply, .vtp, .stl or .obj; or points: .xyz, .txt, .csv; mm RAS");
  add_required(*command, "--model", job->model, "model file (brainshiftd prepare)");
  add_required(*command, "--sd-mm", job->sd_mm, "standard deviation of a point");
  add_required(*command, "--out", job->out, "surgery file; added to if it exists");
  command->add_option("--time-s", job->time_s,
                      "time of the pictures; default: a second after the last observation");
  add_with_default(*command, "--source", job->source, "where the surface comes from");
  command->footer(
      R"(A surgery may hold observations of several sources; sequence and time go on from its last.
Example:
  brainshift stereo observe --surface cortex.ply --model colin27.h5 --sd-mm 0.5 --out case.surgery)");
  command->callback([job, &status] { status = run_observe(*job); });
}

}  // namespace

void add_stereo(CLI::App& app, Status& status) {
  CLI::App* command = app.add_subcommand(
      "stereo", "The exposed cortex from two cameras: calibrate, reconstruct, observe.");
  command->require_subcommand(1);
  command->footer(
      "In order (docs/stereo.md):\n"
      "  brainshift stereo calibrate --left 'left*.png' --right 'right*.png' --board 9x6 "
      "--square-mm 5 --out calibration.yaml\n"
      "  brainshift stereo reconstruct --left L.png --right R.png --calibration calibration.yaml "
      "--pose T_ras_camera.txt --out cortex.ply\n"
      "  brainshift stereo observe --surface cortex.ply --model colin27.h5 --sd-mm 0.5 --out "
      "case.surgery");
  add_calibrate(*command, status);
  add_reconstruct(*command, status);
  add_observe(*command, status);
}

}  // namespace brainshift::client
