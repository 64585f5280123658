// SPDX-License-Identifier: GPL-3.0-or-later
// FrameCollector: IMAGE, TRANSFORM and TDATA as they arrive, put together to the recording that
// PLUS would have written of them (common/tracking/recording.hpp). From there on the code is that
// of `brainshift import`.
//
// Time is the messages' own (PlusServer stamps an image and its transforms alike); without one,
// the time of arrival. Messages of the same time are one frame of the recording.
//
// A transform's name is the device name of TRANSFORM, the tool's name in TDATA; a tool's name that
// is no pair of frames ("Probe") means ProbeToTracker. Its validity stands in the metadata
// TransformStatus, or NAMEStatus for TDATA: anything but OK is invalid. Version 1 has no metadata;
// PlusServer then sends valid transforms alone (SendValidTransformsOnly), so they count as valid.
// Matrices are checked as those of files are. Source: vtkPlusIgtlMessageCommon.cxx of
// PlusToolkit/PlusLib.
//
// Images: one component of uint8, int16 or uint16, one slice; u along i, v along j (orientation
// MF, in which PlusServer has them). Others are left out. Contours and seeds name an image by its
// number in the sweep, so every image that was received has a number, whether it can be used or
// not. Images of one time cannot be told apart, nor can the poses that were sent with them: all
// are left out. Behind a sweep that is too long, and when the clock runs backwards, nothing is
// collected until a pause: the images could not be counted.
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
  // Of image i, counted from the first that was received: its frame of `moments`, or -1 where it
  // was left out.
  std::vector<int> moment_of_image;
  // The images alone, with their pixels when they were kept. One that was left out is not OK, and
  // grey 0.
  tracking::Recording images;
  std::chrono::steady_clock::time_point last_image;  // when it came
  std::vector<std::string> notes;                    // what was left out
};

class FrameCollector {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  explicit FrameCollector(CollectorOptions options) : options_(std::move(options)) {}

  void take(const igtl::Message& message, TimePoint arrived);
  // Images that were received and lost before they could be taken.
  void lose(std::size_t images);
  // Received, whether they can be used or not.
  int images() const { return static_cast<int>(images_); }
  std::optional<TimePoint> last_image() const { return last_image_; }
  // No further image has room.
  bool full() const;
  // Behind the end of a sweep that is over for another reason than a pause.
  bool waits_for_a_pause() const { return waits_; }
  // What was collected; begins the next sweep. paused: it ended by a pause.
  CollectedSweep finish(bool paused = true);

 private:
  struct Moment {
    std::optional<std::size_t> image;  // its number
    bool ambiguous = false;            // more than one image or pose of one time
    std::string pixels;
    std::map<std::string, tracking::Link> links;
  };
  // Of transforms before the first image: what a pose is interpolated from.
  static constexpr double kKept_s = 2.0;
  // A clock that runs back by more than this was set, or another recording is played.
  static constexpr double kBack_s = 1.0;

  // Null: nothing is collected until a pause.
  Moment* moment_at(igtl::Timestamp time, TimePoint arrived);
  void take_image(const igtl::Image& image, Moment& moment);
  void take_transform(const std::string& name, const igtl::Matrix34f& values,
                      const std::string* status, Moment& moment);
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
