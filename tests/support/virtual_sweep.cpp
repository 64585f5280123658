// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/virtual_sweep.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "common/core/random.hpp"

namespace brainshift::test_support {
namespace {

std::string deflate_text(const std::string& bytes, int window_bits) {
  z_stream stream{};
  if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, window_bits, 8,
                   Z_DEFAULT_STRATEGY) != Z_OK) {
    throw std::runtime_error("zlib");
  }
  std::string out(deflateBound(&stream, bytes.size()) + 64, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  if (deflate(&stream, Z_FINISH) != Z_STREAM_END) throw std::runtime_error("zlib");
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

std::string frame_fields(const SequenceContent& content, const char* separator) {
  std::string text;
  for (std::size_t i = 0; i < content.frames.size(); ++i) {
    for (const auto& [name, value] : content.frames[i]) {
      text += fmt::format("Seq_Frame{:04d}_{}{}{}\n", i, name, separator, value);
    }
  }
  return text;
}

RigidTransform motion(const Vec3& axis, double angle, const Vec3& translation) {
  RigidTransform T = RigidTransform::Identity();
  T.linear() = Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
  T.translation() = translation;
  return T;
}

}  // namespace

std::string meta_text(const SequenceContent& content, bool compressed) {
  const std::map<std::string, std::string> types = {
      {"uint8", "MET_UCHAR"}, {"int16", "MET_SHORT"}, {"uint16", "MET_USHORT"}};
  std::string text =
      "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n";
  const std::string data = compressed ? deflate_text(content.pixels, 15) : content.pixels;
  text += compressed
              ? fmt::format("CompressedData = True\nCompressedDataSize = {}   \n", data.size())
              : std::string("CompressedData = False\n");
  text += fmt::format("DimSize = {} {} {}   \nElementType = {}\n", content.width, content.height,
                      content.frames.size(), types.at(content.element));
  for (const auto& [key, value] : content.fields) text += key + " = " + value + "\n";
  return text + frame_fields(content, " = ") + "ElementDataFile = LOCAL\n" + data;
}

std::string nrrd_text(const SequenceContent& content, bool gzip) {
  std::string text = "NRRD0004\n# written by a test\ndimension: 3\nendian: little\n";
  text += fmt::format("encoding: {}\nkinds: domain domain list\nsizes: {} {} {}\ntype: {}\n",
                      gzip ? "gzip" : "raw", content.width, content.height, content.frames.size(),
                      content.element);
  for (const auto& [key, value] : content.fields) {
    const bool orientation = key == "UltrasoundImageOrientation";
    text += (orientation ? "ultrasound image orientation" : key) + ":=" + value + "\n";
  }
  return text + frame_fields(content, ":=") + "\n" +
         (gzip ? deflate_text(content.pixels, 15 + 16) : content.pixels);
}

std::string matrix_text(const Eigen::Matrix4d& matrix) {
  std::string text;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      text += fmt::format("{}{}", text.empty() ? "" : " ", matrix(row, column));
    }
  }
  return text;
}

RigidTransform VirtualSweep::T_ras_reference() const {
  return motion(Vec3(1, 2, -1), 0.8, Vec3(12, -35, 50));
}

AffineTransform VirtualSweep::T_probe_image() const {
  AffineTransform T(motion(Vec3(-1, 1, 3), 1.1, Vec3(4, -6, 9)));
  return T * Eigen::Scaling(pixel_u_mm, pixel_v_mm, 0.22);
}

// The plane moves along its normal and turns a little on the way.
AffineTransform VirtualSweep::T_ras_image(int frame) const {
  const double s = frames > 1 ? static_cast<double>(frame) / (frames - 1) - 0.5 : 0.0;
  const RigidTransform tilt = motion(Vec3(2, 1, 1), 0.4 + 0.1 * s, Vec3::Zero());
  const Vec3 centre = centre_mm + travel_mm * s * tilt.linear().col(2);
  AffineTransform T = AffineTransform::Identity();
  T.linear() = tilt.linear() * Eigen::Scaling(pixel_u_mm, pixel_v_mm, 0.22);
  T.translation() = centre - T.linear() * Vec3(0.5 * (width - 1), 0.5 * (height - 1), 0.0);
  return T;
}

double VirtualSweep::distance_mm(const Vec3& x_ras) const {
  const Vec3 scaled = (x_ras - centre_mm).cwiseQuotient(semi_axes_mm);
  const Vec3 gradient = 2.0 * scaled.cwiseQuotient(semi_axes_mm);
  return std::abs(scaled.squaredNorm() - 1.0) / gradient.norm();
}

SequenceContent VirtualSweep::content() const {
  SequenceContent content;
  content.width = width, content.height = height;
  Random random(7);
  for (int frame = 0; frame < frames; ++frame) {
    const AffineTransform T = T_ras_image(frame);
    for (int v = 0; v < height; ++v) {
      for (int u = 0; u < width; ++u) {
        const Vec3 x = T * Vec3(u, v, 0.0);
        const bool in = (x - centre_mm).cwiseQuotient(semi_axes_mm).squaredNorm() < 1.0;
        const double grey = (in ? inside : outside) * (1.0 + speckle * random.normal());
        content.pixels += static_cast<char>(std::lround(std::clamp(grey, 0.0, 255.0)));
      }
    }
    const double part = static_cast<double>(frame) / std::max(1, frames - 1);
    const RigidTransform T_tracker_reference =
        motion(Vec3(1, 0, 1), 0.5 + 0.2 * part, Vec3(-200 + 20 * part, 90, -1500 + 10 * part));
    const AffineTransform T_tracker_probe =
        T_tracker_reference * T_ras_reference().inverse() * T * T_probe_image().inverse();
    content.frames.push_back(
        {{"Timestamp", fmt::format("{:.6f}", 1000.0 + period_s * frame)},
         {"ImageStatus", "OK"},
         {"ProbeToTrackerTransform", matrix_text(T_tracker_probe.matrix())},
         {"ProbeToTrackerTransformStatus", "OK"},
         {"ReferenceToTrackerTransform", matrix_text(T_tracker_reference.matrix())},
         {"ReferenceToTrackerTransformStatus", "OK"},
         {"StylusToTrackerTransform", matrix_text(Eigen::Matrix4d::Identity())},
         {"StylusToTrackerTransformStatus", "INVALID"}});
  }
  return content;
}

ultrasound::Contour VirtualSweep::section(int frame, int corners) const {
  // In units of the ellipsoid's axes the plane cuts a unit sphere: q(u, v) = |a + u b + v c|^2 =
  // 1, a conic whose centre and axes follow from the 2 x 2 matrix of b and c.
  const AffineTransform T = T_ras_image(frame);
  const Vec3 a = (T.translation() - centre_mm).cwiseQuotient(semi_axes_mm);
  Eigen::Matrix<double, 3, 2> B;
  B.col(0) = T.linear().col(0).cwiseQuotient(semi_axes_mm);
  B.col(1) = T.linear().col(1).cwiseQuotient(semi_axes_mm);
  const Eigen::Matrix2d Q = B.transpose() * B;
  const Eigen::Vector2d centre = -Q.inverse() * B.transpose() * a;
  const double rest = 1.0 - (a + B * centre).squaredNorm();
  ultrasound::Contour contour;
  contour.frame = frame;
  if (rest <= 0.0) return contour;
  contour.points_px.resize(2, corners);
  for (int k = 0; k < corners; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / corners;
    const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
    contour.points_px.col(k) = centre + direction * std::sqrt(rest / direction.dot(Q * direction));
  }
  return contour;
}

std::string VirtualSweep::device_text() const {
  return "<PlusConfiguration version=\"2.1\">\n <CoordinateDefinitions>\n  <Transform "
         "From=\"Image\" "
         "To=\"Probe\" Matrix=\"" +
         matrix_text(T_probe_image().matrix()) +
         "\" Error=\"0.5\" Date=\"2026.01.02\"/>\n "
         "</CoordinateDefinitions>\n</PlusConfiguration>\n";
}

}  // namespace brainshift::test_support
