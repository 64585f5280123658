// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/stereo_scene.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/core/random.hpp"

namespace brainshift::test_support {
namespace {

constexpr double kBaselineMm = 30.0;
constexpr double kCurvatureMm = 80.0;

const CameraIntrinsics& camera_of(const StereoCalibration& rig, Eye eye) {
  return eye == Eye::kLeft ? rig.left : rig.right;
}
RigidTransform T_camera_left(const StereoCalibration& rig, Eye eye) {
  return eye == Eye::kLeft ? RigidTransform::Identity() : rig.T_right_left;
}

Eigen::Vector2d distorted(const CameraIntrinsics& c, const Eigen::Vector2d& p) {
  const auto [k1, k2, p1, p2, k3] = c.distortion;
  const double x = p.x(), y = p.y(), r2 = p.squaredNorm();
  const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  return {x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
          y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y};
}

// Direction of a pixel's ray in the camera's frame, z = 1: fixed point of distorted(p) = target.
Vec3 ray(const CameraIntrinsics& c, double u, double v) {
  const Eigen::Vector2d target((u - c.centre_x_px) / c.focal_x_px,
                               (v - c.centre_y_px) / c.focal_y_px);
  Eigen::Vector2d p = target;
  for (int i = 0; i < 10; ++i) p += target - distorted(c, p);
  return {p.x(), p.y(), 1.0};
}

double lattice(int i, int j, int octave) {
  std::uint64_t h = static_cast<std::uint64_t>(static_cast<std::uint32_t>(i)) * 0x9E3779B97F4A7C15U;
  h ^= static_cast<std::uint64_t>(static_cast<std::uint32_t>(j)) * 0xC2B2AE3D27D4EB4FU;
  h ^= static_cast<std::uint64_t>(octave) * 0x165667B19E3779F9U;
  h = (h ^ (h >> 31)) * 0xBF58476D1CE4E5B9U;
  h = (h ^ (h >> 29)) * 0x94D049BB133111EBU;
  return static_cast<double>((h ^ (h >> 32)) >> 11) * 0x1.0p-53;
}

// Uniform numbers on a lattice with a smooth blend between them; sd about 0.25 near the lattice.
double value_noise(double x, double y, int octave) {
  const double i = std::floor(x), j = std::floor(y);
  const auto blend = [](double t) { return t * t * t * (t * (6.0 * t - 15.0) + 10.0); };
  const double a = blend(x - i), b = blend(y - j);
  const int ii = static_cast<int>(i), jj = static_cast<int>(j);
  return (1 - b) * ((1 - a) * lattice(ii, jj, octave) + a * lattice(ii + 1, jj, octave)) +
         b * ((1 - a) * lattice(ii, jj + 1, octave) + a * lattice(ii + 1, jj + 1, octave));
}

// Grey level of the patch at a place, about 128 with sd `contrast`: lattices of 9, 4.5, 2.2 and
// 1.1 mm.
double texture(double x, double y, double contrast) {
  double sum = 0.0;
  for (int octave = 0; octave < 4; ++octave) {
    const double scale = std::ldexp(1.0 / 9.0, octave);
    sum += value_noise(x * scale + 0.37 * octave, y * scale, octave) - 0.5;
  }
  return 128.0 + contrast * sum / 0.4;
}

std::uint8_t grey(double value) {
  return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0)));
}

}  // namespace

StereoCalibration operating_rig(double meet_mm) {
  StereoCalibration rig;
  rig.width_px = 640;
  rig.height_px = 480;
  rig.left = {1100.0, 1102.0, 322.0, 238.0, {-0.12, 0.08, 0.0004, -0.0003, 0.0}};
  rig.right = {1096.0, 1097.0, 316.0, 243.0, {-0.11, 0.06, -0.0005, 0.0002, 0.0}};
  const double turn = std::atan(kBaselineMm / meet_mm);
  // The right camera stands at (30, 0, 0) and looks inwards, a little askew as rigs are.
  RigidTransform T_left_right = RigidTransform::Identity();
  T_left_right.linear() =
      (Eigen::AngleAxisd(-turn, Vec3::UnitY()) * Eigen::AngleAxisd(0.01, Vec3::UnitX()) *
       Eigen::AngleAxisd(-0.008, Vec3::UnitZ()))
          .toRotationMatrix();
  T_left_right.translation() = Vec3(kBaselineMm, 0.4, -0.7);
  rig.T_right_left = T_left_right.inverse();
  return rig;
}

Eigen::Vector2d project(const StereoCalibration& rig, Eye eye, const Vec3& x_left) {
  const CameraIntrinsics& c = camera_of(rig, eye);
  const Vec3 x = T_camera_left(rig, eye) * x_left;
  const Eigen::Vector2d p = distorted(c, x.head<2>() / x.z());
  return {c.focal_x_px * p.x() + c.centre_x_px, c.focal_y_px * p.y() + c.centre_y_px};
}

Ray ray_through(const StereoCalibration& rig, Eye eye, const Eigen::Vector2d& pixel) {
  const RigidTransform T_left_camera = T_camera_left(rig, eye).inverse();
  return {T_left_camera.translation(),
          T_left_camera.linear() * ray(camera_of(rig, eye), pixel.x(), pixel.y())};
}

double patch_depth(const Patch& patch, double x, double y) {
  const double cap = (x * x + y * y) / (2.0 * kCurvatureMm);
  const double gyri = std::sin(2.0 * std::numbers::pi * x / 14.0 + 0.5) *
                      std::cos(2.0 * std::numbers::pi * y / 19.0);
  return patch.depth_mm + 0.1 * x - 0.06 * y + cap + patch.gyri_mm * gyri;
}

Vec3 patch_normal(const Patch& patch, double x, double y) {
  constexpr double kStep = 1e-4;
  const double dx =
      (patch_depth(patch, x + kStep, y) - patch_depth(patch, x - kStep, y)) / (2 * kStep);
  const double dy =
      (patch_depth(patch, x, y + kStep) - patch_depth(patch, x, y - kStep)) / (2 * kStep);
  return Vec3(dx, dy, -1.0).normalized();
}

stereo::GrayImage render(const StereoCalibration& rig, Eye eye, const Patch& patch,
                         std::uint64_t seed) {
  Random random(seed);
  stereo::GrayImage image(rig.width_px, rig.height_px);
  const RigidTransform T_left_camera = T_camera_left(rig, eye).inverse();
  const Vec3 origin = T_left_camera.translation();
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      const Vec3 direction = T_left_camera.linear() * ray(camera_of(rig, eye), u, v);
      // The patch is nearly across the rays: walking to its depth at the last place settles
      // quickly.
      double t = patch.depth_mm / direction.z();
      Vec3 x = origin;
      for (int i = 0; i < 12; ++i) {
        x = origin + t * direction;
        t = (patch_depth(patch, x.x(), x.y()) - origin.z()) / direction.z();
      }
      const bool on_patch = x.head<2>().norm() <= patch.radius_mm;
      const double level = on_patch ? texture(x.x(), x.y(), patch.contrast) : 0.0;
      image.at(u, v) = grey(level + patch.noise_grey * random.normal());
    }
  }
  return image;
}

stereo::GrayImage render(const StereoCalibration& rig, Eye eye, const stereo::ChessBoard& board,
                         const RigidTransform& T_left_board) {
  constexpr int kSamples = 3;  // per pixel and axis
  stereo::GrayImage image(rig.width_px, rig.height_px);
  const RigidTransform T_board_camera = (T_camera_left(rig, eye) * T_left_board).inverse();
  const Vec3 origin = T_board_camera.translation();
  const auto level = [&](double u, double v) {
    const Vec3 direction = T_board_camera.linear() * ray(camera_of(rig, eye), u, v);
    const Vec3 x = (origin - origin.z() / direction.z() * direction) / board.square_mm;
    const double i = std::floor(x.x()), j = std::floor(x.y());
    const bool on_board = i >= -1 && i < board.columns && j >= -1 && j < board.rows;
    return on_board && static_cast<int>(i + j + 2) % 2 == 0 ? 25.0 : 230.0;
  };
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      double sum = 0.0;
      for (int a = 0; a < kSamples; ++a)
        for (int b = 0; b < kSamples; ++b)
          sum += level(u + (a + 0.5) / kSamples - 0.5, v + (b + 0.5) / kSamples - 0.5);
      image.at(u, v) = grey(sum / (kSamples * kSamples));
    }
  }
  return image;
}

stereo::BoardCorners exact_corners(const StereoCalibration& rig, const stereo::ChessBoard& board,
                                   const RigidTransform& T_left_board) {
  stereo::BoardCorners corners;
  corners.left.resize(2, board.columns * board.rows);
  corners.right.resize(2, board.columns * board.rows);
  for (int j = 0; j < board.rows; ++j) {
    for (int i = 0; i < board.columns; ++i) {
      const Vec3 x = T_left_board * Vec3(i * board.square_mm, j * board.square_mm, 0.0);
      corners.left.col(j * board.columns + i) = project(rig, Eye::kLeft, x);
      corners.right.col(j * board.columns + i) = project(rig, Eye::kRight, x);
    }
  }
  return corners;
}

RigidTransform board_pose(int index, const stereo::ChessBoard& board, double depth_mm) {
  Random random(1000 + static_cast<std::uint64_t>(index));
  const auto between = [&](double low, double high) {
    return low + (high - low) * random.uniform();
  };
  RigidTransform T = RigidTransform::Identity();
  T.linear() = (Eigen::AngleAxisd(between(-0.5, 0.5), Vec3::UnitX()) *
                Eigen::AngleAxisd(between(-0.5, 0.5), Vec3::UnitY()) *
                Eigen::AngleAxisd(between(-0.2, 0.2), Vec3::UnitZ()))
                   .toRotationMatrix();
  const Vec3 middle(0.5 * (board.columns - 1) * board.square_mm,
                    0.5 * (board.rows - 1) * board.square_mm, 0.0);
  const Vec3 place(between(-8.0, 8.0), between(-8.0, 8.0), depth_mm + between(-20.0, 30.0));
  T.translation() = place - T.linear() * middle;
  return T;
}

}  // namespace brainshift::test_support
