// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/stereo/disparity_picture.hpp"
#include "client/tools/stereo/jobs.hpp"
#include "client/tools/stereo/pictures.hpp"
#include "common/io/config/calibration_file.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/geometry/mesh_writer.hpp"
#include "common/io/geometry/pose_file.hpp"

namespace brainshift::client {
namespace {

// A camera looks from some 300 mm: a rotation off by 1e-4 moves the cortex by 0.03 mm.
constexpr double kCameraPoseTolerance = 1e-4;

// What goes wrong with a pair is told with its left picture's name.
tl::unexpected<Error> of_pair(const ReconstructJob& job, const Error& error) {
  return io::file_error(error.code, job.left, error.message);
}

}  // namespace

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
  if (!measured) return of_pair(job, measured.error());
  report(progress, "match", 1.0);
  auto made = stereo::reconstruct(measured->map, measured->geometry, *T_ras_camera, job.options);
  if (!made) return of_pair(job, made.error());
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

}  // namespace brainshift::client
