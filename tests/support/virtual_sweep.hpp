// SPDX-License-Identifier: GPL-3.0-or-later
// A virtual probe swept over an ellipsoid at a known place, as a recording in either file format.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/core/types.hpp"
#include "common/ultrasound/boundary.hpp"

namespace brainshift::test_support {

// The contents of a sequence file before they become text.
struct SequenceContent {
  int width = 0, height = 0;
  std::string element = "uint8";  // or "int16", "uint16"
  std::map<std::string, std::string> fields = {{"UltrasoundImageOrientation", "MF"}};
  std::vector<std::map<std::string, std::string>> frames;  // names without Seq_Frame0000_
  std::string pixels;
};
std::string meta_text(const SequenceContent& content, bool compressed);
std::string nrrd_text(const SequenceContent& content, bool gzip);

// 16 numbers, row by row, all digits.
std::string matrix_text(const Eigen::Matrix4d& matrix);

struct VirtualSweep {
  Vec3 centre_mm = Vec3(30, -20, 40);  // of the ellipsoid, RAS
  Vec3 semi_axes_mm = Vec3(10, 13, 8);
  int frames = 21;
  double travel_mm = 14.0;  // of the image plane, symmetric about the centre
  int width = 180, height = 160;
  double pixel_u_mm = 0.2, pixel_v_mm = 0.25;
  double inside = 150.0, outside = 60.0;  // grey values
  double speckle = 0.0;  // standard deviation of the noise, relative to the grey value
  double period_s = 0.1;

  RigidTransform T_ras_reference() const;
  AffineTransform T_probe_image() const;
  AffineTransform T_ras_image(int frame) const;
  // The recording, with ProbeToTracker, ReferenceToTracker and an invalid StylusToTracker.
  SequenceContent content() const;
  // The exact section of the ellipsoid; empty where the plane misses it.
  ultrasound::Contour section(int frame, int corners = 720) const;
  // Distance from a RAS point to the ellipsoid's surface, to first order.
  double distance_mm(const Vec3& x_ras) const;
  // A PLUS device set with ImageToProbe.
  std::string device_text() const;
};

}  // namespace brainshift::test_support
