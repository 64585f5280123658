// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/config/calibration_file.hpp"

#include <algorithm>
#include <charconv>
#include <vector>

#include "common/core/rigid_motion.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/files/yaml_section.hpp"

namespace brainshift::io {
namespace {

void read_camera(YamlSection section, CameraIntrinsics& camera) {
  section.number("focal_x_px", camera.focal_x_px, kRequired);
  section.number("focal_y_px", camera.focal_y_px, kRequired);
  section.number("centre_x_px", camera.centre_x_px, kRequired);
  section.number("centre_y_px", camera.centre_y_px, kRequired);
  std::vector<double> distortion(camera.distortion.begin(), camera.distortion.end());
  section.numbers("distortion", distortion);
  if (distortion.size() == camera.distortion.size()) {
    std::copy(distortion.begin(), distortion.end(), camera.distortion.begin());
  } else {
    section.fail("distortion", "has " + std::to_string(distortion.size()) +
                                   " numbers: must have five, k1 k2 p1 p2 k3");
  }
  section.done();
}

void read_camera_transform(YamlSection section, Eigen::Matrix4d& matrix) {
  std::vector<double> rotation(9, 0.0);
  Vec3 translation = Vec3::Zero();
  section.numbers("rotation", rotation, kRequired);
  section.vector3("translation_mm", translation, kRequired);
  if (rotation.size() != 9) {
    section.fail("rotation", "has " + std::to_string(rotation.size()) + " numbers: must have nine");
    return;
  }
  for (int i = 0; i < 9; ++i) matrix(i / 3, i % 3) = rotation[static_cast<std::size_t>(i)];
  matrix.topRightCorner<3, 1>() = translation;
  section.done();
}

// The shortest text that reads back as the same number.
std::string digits(double value) {
  char buffer[32];
  const auto [end, error] = std::to_chars(buffer, buffer + sizeof buffer, value);
  return error == std::errc() ? std::string(buffer, end) : "0";
}

std::string list(const std::vector<double>& values) {
  std::string text;
  for (const double value : values) text.append(text.empty() ? "[" : ", ").append(digits(value));
  return text + "]";
}

std::string in_quotes(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < 0x20 ? '?' : c;
  }
  return out + "\"";
}

std::string camera_text(const std::string& name, const CameraIntrinsics& camera) {
  return name + ":\n  focal_x_px: " + digits(camera.focal_x_px) +
         "\n  focal_y_px: " + digits(camera.focal_y_px) +
         "\n  centre_x_px: " + digits(camera.centre_x_px) +
         "\n  centre_y_px: " + digits(camera.centre_y_px) +
         "\n  distortion: " + list({camera.distortion.begin(), camera.distortion.end()}) + "\n";
}

}  // namespace

Result<StereoCalibration> read_calibration(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return tl::unexpected(text.error());
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  const auto read = [&](YamlSection& root, StereoCalibration& calibration) {
    YamlSection image = root.section("image", kRequired);
    image.integer("width_px", calibration.width_px, kRequired);
    image.integer("height_px", calibration.height_px, kRequired);
    image.done();
    read_camera(root.section("left", kRequired), calibration.left);
    read_camera(root.section("right", kRequired), calibration.right);
    read_camera_transform(root.section("T_right_left", kRequired), matrix);
    root.number("rms_px", calibration.rms_px);
    root.number("epipolar_rms_px", calibration.epipolar_rms_px);
    YamlSection pairs = root.section("pairs");
    for (const std::string& name : pairs.names()) {
      calibration.pairs.push_back({name, 0.0});
      pairs.number(name, calibration.pairs.back().rms_px);
    }
  };
  const auto check = [&](StereoCalibration& calibration) {
    return check_rigid("T_right_left.rotation", matrix).and_then([&] {
      calibration.T_right_left = nearest_rigid(matrix);
      return validate(calibration);
    });
  };
  return parse_yaml<StereoCalibration>(*text, path, read, check);
}

std::string calibration_text(const StereoCalibration& calibration) {
  const Mat3 R = calibration.T_right_left.linear();
  const Vec3 t = calibration.T_right_left.translation();
  std::string text =
      "# Calibration of two cameras side by side; lengths in mm.\nimage:\n  width_px: " +
      std::to_string(calibration.width_px) +
      "\n  height_px: " + std::to_string(calibration.height_px) + "\n" +
      camera_text("left", calibration.left) + camera_text("right", calibration.right) +
      "T_right_left:\n  rotation: " +
      list({R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2)}) +
      "\n  translation_mm: " + list({t.x(), t.y(), t.z()}) +
      "\nrms_px: " + digits(calibration.rms_px) +
      "\nepipolar_rms_px: " + digits(calibration.epipolar_rms_px) + "\n";
  if (!calibration.pairs.empty()) text += "pairs:\n";
  for (const CalibrationPair& pair : calibration.pairs) {
    text += "  " + in_quotes(pair.name) + ": " + digits(pair.rms_px) + "\n";
  }
  return text;
}

Status write_calibration(const std::filesystem::path& path, const StereoCalibration& calibration) {
  return write_file(path, calibration_text(calibration));
}

}  // namespace brainshift::io
