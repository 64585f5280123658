// SPDX-License-Identifier: GPL-3.0-or-later
// Recording: tracked ultrasound as it was recorded; images and, per image, the transforms between named frames.
//
// Pixel (u, v) of a frame has its centre at integer coordinates: u along the transducer's marked axis, v away from the
// transducer (orientation "MF"; readers turn other orientations into this one). Transforms left-multiply, in mm.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"
#include "common/tracking/transform_name.hpp"

namespace brainshift::tracking {

enum class LinkStatus {
  kOk,
  kInvalid,       // the tracker said so, or the matrix is not usable (Recording::defects says why)
  kMissing,       // the frame does not carry this transform
  kWithoutStatus  // a matrix without a word on its validity: never used
};

struct Link {
  AffineTransform T_to_from = AffineTransform::Identity();
  LinkStatus status = LinkStatus::kMissing;
};

// One transform through time: a sample for every frame of the recording.
struct LinkSeries {
  FramePair frames;
  std::vector<Link> samples;
};

enum class PixelType { kUint8, kInt16, kUint16 };
int bytes_per_pixel(PixelType type);

// A matrix that its status called valid and that is none.
struct Defect {
  int frame = 0;
  std::string field;
  std::string what;
};

struct Recording {
  int width = 0;   // pixels along u
  int height = 0;  // pixels along v
  PixelType pixel_type = PixelType::kUint8;
  std::vector<double> time_s;  // per frame, never decreasing; the recording's own clock
  std::vector<char> image_ok;  // per frame
  std::vector<LinkSeries> links;
  std::vector<Defect> defects;
  std::string pixels;  // frame by frame, row by row, native byte order

  int num_frames() const { return static_cast<int>(time_s.size()); }
  // The bytes of a frame, not copied. 0 <= frame < num_frames().
  std::string_view frame_bytes(int frame) const;
  // Rows of a frame as numbers; height x width.
  Eigen::MatrixXf frame_values(int frame) const;
};

// Ok for a rigid motion: finite, last row 0 0 0 1, |R^T R - I| <= tolerance in every entry, det R > 0. Recordings hold
// six digits; the default leaves room for four. The error says what is wrong, without a file or name.
Status check_rigid(const Eigen::Matrix4d& matrix, double tolerance = 2e-3);
// Ok for an invertible affine map: finite, last row 0 0 0 1, condition of the linear part at most 1e4.
Status check_affine(const Eigen::Matrix4d& matrix);

// The rigid motion nearest to a matrix that check_rigid accepts (polar decomposition), same translation.
RigidTransform nearest_rigid(const Eigen::Matrix4d& matrix);

}  // namespace brainshift::tracking
