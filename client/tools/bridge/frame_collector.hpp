// SPDX-License-Identifier: GPL-3.0-or-later
// FrameCollector: IMAGE, TRANSFORM and TDATA as they arrive, put together to the recording that
// PLUS would have written of them (common/tracking/recording.hpp). From there on the code is that
// of `brainshift import`.
//
// Time is the messages' own (PlusServer stamps an image and its transforms alike); without one, the
// time of arrival. Messages of the same time are one frame of the recording.
//
// A transform's name is the device name of TRANSFORM, the tool's name in TDATA; a tool's name that
// is no pair of frames ("Probe") means ProbeToTracker. Its validity stands in the metadata
// TransformStatus, or NAMEStatus for TDATA: anything but OK is invalid. Names above 20 bytes stand
// in the metadata as well (igtl::full_device, igtl::tool_state). Version 1 has no metadata;
// PlusServer then sends valid transforms alone (SendValidTransformsOnly), so they count as valid.
// Matrices are checked as those of files are. Source: vtkPlusIgtlMessageCommon.cxx of
// PlusToolkit/PlusLib.
//
// Images: one component of uint8, int16 or uint16, one slice; u along i, v along j (orientation MF,
// in which PlusServer has them). Others are left out, and counted. Different images of one time
// cannot be told apart, nor can images whose time has different poses: they are not OK. What is
// sent again changes nothing. When the clock runs back, and behind a sweep that is too long,
// nothing is collected until a pause.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/igtl/message.hpp"
#include "common/tracking/recording.hpp"

namespace brainshift::client {

struct CollectorOptions {
  std::string image_device = {};  // takes images of this device alone; empty: all
  bool keep_pixels = false;       // for the tracer; contours need none
  int max_images = 3000;          // of a sweep: 100 s at 30 Hz
  std::size_t max_pixel_bytes = std::size_t{1} << 30;
};

struct CollectedSweep {
  // Every moment at which something came, without pixels.
  tracking::Recording moments;
  // Of image i, counted from the sweep's first: its frame of `moments`.
  std::vector<int> moment_of_image;
  // Their own times, ns since 1970 UTC; of arrival where they have none (then `untimed`).
  std::vector<std::int64_t> image_ns;
  bool untimed = false;  // an image came without a time
  // The images alone, with their pixels when they were kept; not OK where several had one time.
  tracking::Recording images;
  std::chrono::steady_clock::time_point last_image;  // when it came
  std::vector<std::string> notes;                    // what was left out
};

class FrameCollector {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  explicit FrameCollector(CollectorOptions options) : options_(std::move(options)) {}

  void take(const igtl::Message& message, TimePoint arrived);
  // Images that came and could not be kept until they were taken: they are counted.
  void lose(int images) {
    if (images > 0) left_out_["image that came faster than it could be used"] += images;
  }
  // Of the device whose images are taken.
  bool wants(const igtl::Envelope& image) const;
  int images() const { return static_cast<int>(images_); }
  // The newest that came, whether it can be used or not.
  std::optional<TimePoint> last_image() const { return last_image_; }
  // No further image has room.
  bool full() const;
  // Nothing is collected until finish(true).
  bool waits_for_a_pause() const { return waits_; }
  // What was collected, perhaps no image; begins the next sweep. paused: no image came for a while.
  CollectedSweep finish(bool paused = true);

 private:
  struct Moment {
    bool image = false;
    bool untimed = false;
    bool ambiguous = false;      // different images or poses of one time
    std::size_t image_hash = 0;  // of the pixels
    std::string pixels;
    std::map<std::string, tracking::Link> links;
  };
  // Of transforms before the first image: what a pose is interpolated from.
  static constexpr double kKept_s = 2.0;
  // A clock that runs back by more than this was set, or another recording is played.
  static constexpr double kBack_s = 1.0;

  // Null: nothing is collected until a pause.
  Moment* moment_at(igtl::Timestamp time, TimePoint arrived);
  void take_image(const igtl::Image& image, bool untimed, Moment& moment);
  void take_transform(const std::string& name, const igtl::Matrix34f& values, bool valid,
                      Moment& moment);
  void leave_out(const std::string& reason) { ++left_out_[reason]; }

  CollectorOptions options_;
  std::map<std::int64_t, Moment> moments_;  // by ns
  std::size_t images_ = 0, pixel_bytes_ = 0;
  bool waits_ = false;
  int width_ = 0, height_ = 0;
  tracking::PixelType pixel_type_ = tracking::PixelType::kUint8;
  std::optional<TimePoint> last_image_;
  std::map<std::string, tracking::FramePair> pairs_;
  std::vector<tracking::Defect> defects_;
  std::map<std::string, int> left_out_;
};

}  // namespace brainshift::client
