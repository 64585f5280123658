// SPDX-License-Identifier: GPL-3.0-or-later
// Recording: tracked ultrasound as it was recorded. It holds images and, per image, the transforms
// between named frames.
//
// Pixel (u, v) of a frame has its centre at integer coordinates: u along the transducer's marked
// axis, v away from the transducer (orientation "MF"; readers turn other orientations into this
// one).
// Transforms left-multiply, in mm.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"
#include "common/tracking/transform_graph.hpp"

namespace brainshift::tracking {

enum class LinkStatus {
  kOk,
  kInvalid,       // by the tracker, or the matrix is unusable (Recording::defects says why)
  kMissing,       // the frame does not carry this transform
  kWithoutStatus  // a matrix whose validity is not recorded: never used
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

// A matrix with the status "OK" that is not a valid transform.
struct Defect {
  int frame = 0;
  std::string field;  // of the recording: the transform's name
  std::string what;   // why it is not valid
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

}  // namespace brainshift::tracking
