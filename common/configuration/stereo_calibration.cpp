// SPDX-License-Identifier: Apache-2.0
#include "common/configuration/stereo_calibration.hpp"

#include <cmath>

#include "common/configuration/key_table.hpp"
#include "common/core/rigid_motion.hpp"

namespace brainshift {
namespace {

// Distortion coefficients of real lenses are below a few units; far beyond, a model has been
// fitted to noise.
constexpr double kMaxDistortion = 100.0;
constexpr int kMaxPicture = 16384;
constexpr double kRigidTolerance = 1e-4;

tl::unexpected<Error> refuse(const std::string& key, double value, const std::string& constraint) {
  return invalid(must_be(key, value, constraint));
}

Status check_camera(const std::string& name, const CameraIntrinsics& camera,
                    const StereoCalibration& picture) {
  const auto positive = [](double value) { return std::isfinite(value) && value > 0.0; };
  if (!positive(camera.focal_x_px))
    return refuse(name + ".focal_x_px", camera.focal_x_px, "finite and > 0");
  if (!positive(camera.focal_y_px))
    return refuse(name + ".focal_y_px", camera.focal_y_px, "finite and > 0");
  // A principal point outside the picture is legal optics only for a cropped picture; a swapped
  // pair of numbers is not.
  if (!(camera.centre_x_px >= 0.0 && camera.centre_x_px <= picture.width_px))
    return refuse(name + ".centre_x_px", camera.centre_x_px, "inside the picture");
  if (!(camera.centre_y_px >= 0.0 && camera.centre_y_px <= picture.height_px))
    return refuse(name + ".centre_y_px", camera.centre_y_px, "inside the picture");
  for (std::size_t i = 0; i < camera.distortion.size(); ++i) {
    if (std::abs(camera.distortion[i]) <= kMaxDistortion) continue;
    return refuse(name + ".distortion[" + std::to_string(i) + "]", camera.distortion[i],
                  "between -100 and 100");
  }
  return {};
}

}  // namespace

Vec3 right_camera_in_left(const StereoCalibration& calibration) {
  return calibration.T_right_left.inverse(Eigen::Isometry).translation();
}

Status validate(const StereoCalibration& calibration) {
  const auto whole = [](int value) { return value >= 1 && value <= kMaxPicture; };
  if (!whole(calibration.width_px))
    return refuse("image.width_px", calibration.width_px, "between 1 and 16384");
  if (!whole(calibration.height_px))
    return refuse("image.height_px", calibration.height_px, "between 1 and 16384");
  if (Status ok = check_camera("left", calibration.left, calibration); !ok) return ok;
  if (Status ok = check_camera("right", calibration.right, calibration); !ok) return ok;
  if (Status ok = check_rigid("T_right_left", calibration.T_right_left.matrix()); !ok) return ok;
  const Vec3 baseline = right_camera_in_left(calibration);
  if (!(baseline.norm() > 1e-6)) return refuse("baseline mm", baseline.norm(), "> 0");
  if (std::abs(baseline.x()) < 0.5 * baseline.norm()) {
    return invalid("T_right_left: the cameras do not stand side by side: the right one is " +
                   std::to_string(baseline.x()) + " mm to the right of the left one, " +
                   std::to_string(baseline.norm()) + " mm away");
  }
  if (baseline.x() < 0.0) {
    return invalid("T_right_left: left and right are swapped: the right camera stands " +
                   std::to_string(-baseline.x()) + " mm to the left of the left one");
  }
  return {};
}

Status check_rigid(const std::string& name, const Eigen::Matrix4d& matrix) {
  const Status rigid = brainshift::check_rigid(matrix, kRigidTolerance);
  if (!rigid) return fail(rigid.error().code, name + " " + rigid.error().message);
  return {};
}

}  // namespace brainshift
