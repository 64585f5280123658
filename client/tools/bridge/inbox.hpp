// SPDX-License-Identifier: GPL-3.0-or-later
// Inbox: OpenIGTLink messages in, what they mean for the daemon out. Knows no socket.
//
//   POLYDATA, POINT of tumour_device    -> TumourBoundary, the points as they are
//   POLYDATA, POINT of surface_device   -> CorticalSurface; without triangles for POINT
//   POINT of landmarks_before, _after   -> LandmarkPairs of the points with the same name
//   IMAGE with TRANSFORM or TDATA       -> a sweep; after a gap, its contours as TumourBoundary, by
//                                          the code of `brainshift import`
//
// Models and points are in model_frame. When that is not Ras, the newest transforms and the
// constants lead there; a frame that no chain connects is refused with a note. Contours and seeds
// name the images of a sweep by their time (import_boundaries.hpp): a count would be of what
// another process received. The files are read when the sweep ends, so that they may be written
// while it goes on.
//
// Statistics: as for `brainshift import`; every point's error has standard deviation sd_mm and is
// taken as independent of the other points' errors.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "client/tools/bridge/frame_collector.hpp"
#include "common/core/error.hpp"
#include "common/igtl/message.hpp"
#include "common/igtl/stream_reader.hpp"
#include "common/tracking/chain.hpp"
#include "common/ultrasound/boundary.hpp"
#include "common/values/observation.hpp"

namespace brainshift::client {

std::chrono::nanoseconds wall_time_at(std::chrono::steady_clock::time_point time);

struct InboxOptions {
  std::string tumour_device = {};     // empty: none
  std::string surface_device = {};    // empty: none
  std::string landmarks_before = {};  // both or none
  std::string landmarks_after = {};
  std::string model_frame = "Ras";

  std::filesystem::path contours = {};  // at most one of the two; none: images are not looked at
  std::filesystem::path seeds = {};     //
  std::filesystem::path device = {};    // PLUS device set; empty: the stream has every transform
  std::filesystem::path registration = {};  // T_ras_reference; needed for images
  bool open_contours = false;
  std::string image_device = {};
  std::string image_frame = "Image";
  std::string reference_frame = "Reference";
  double sd_mm = 0.5;           // of a tumour boundary point, 0.01 to 20
  double surface_sd_mm = 1.0;   // of a surface point, 0.01 to 20
  double landmark_sd_mm = 1.5;  // of a landmark pair, 0.01 to 20
  double latency_ms = 0.0;
  double max_age_ms = 200.0;
  double sweep_gap_s = 2.0;  // 0.1 to 3600
  // What was made longer ago than this, by the time in its message, is refused; 0.1 to 3600.
  double max_data_age_s = 10.0;
  // Models follow poses that are of their time, within this; 0.01 to 3600.
  double max_pose_age_s = 1.0;
  // The messages' times are not of this computer's wall clock, as of a recording that is played:
  // they are compared with one another alone, and what comes counts as new.
  bool relative_times = false;
  // This computer's wall clock at a time of its steady clock, since 1970.
  std::function<std::chrono::nanoseconds(std::chrono::steady_clock::time_point)> wall_at =
      wall_time_at;

  bool wants_images() const { return !contours.empty() || !seeds.empty(); }
  bool wants_models() const {
    return !tumour_device.empty() || !surface_device.empty() || !landmarks_after.empty();
  }
};

// What became of messages.
struct Found {
  std::string source;  // of the observation
  std::variant<TumourBoundary, CorticalSurface, LandmarkPairs, PatientPose> body;
  std::chrono::steady_clock::time_point acquired;
  std::string told;  // "sweep of 21 images: 20 contours, 8210 boundary points"
};
struct Taken {
  std::vector<Found> found;
  std::vector<std::string> notes;  // sentences for people
};

class Inbox {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  // Reads device and registration. kInvalidArgument names the option; errors of the files.
  static Result<Inbox> open(const InboxOptions& options);

  // Types to keep of own clients, and of PlusServer or 3D Slicer.
  igtl::StreamLimits from_peers() const;
  igtl::StreamLimits from_upstream() const;

  // Whether a message is of a kind and name that the options ask for. Any thread.
  bool uses(const igtl::Message& message) const;
  Taken take(const igtl::Message& message, TimePoint arrived);
  // Images that were of use and got lost before they could be taken.
  void lose(int images) { collector_.lose(images); }
  // Time has passed: a sweep may have ended.
  Taken tick(TimePoint now);

 private:
  explicit Inbox(InboxOptions options);
  // When what the message says was so, by its own time; kInvalidArgument: too long ago, or ahead.
  Result<TimePoint> acquired_at(const igtl::Envelope& envelope, TimePoint arrived) const;
  void take_points(const igtl::Envelope& envelope, const Points& points,
                   const std::optional<TriangleSurface>& surface, TimePoint acquired, Taken& taken);
  void take_landmarks(const igtl::Envelope& envelope, const igtl::PointList& list,
                      TimePoint acquired, Taken& taken);
  Result<AffineTransform> T_ras_model(TimePoint at) const;
  void keep_transforms(const igtl::Message& message, TimePoint acquired);
  Taken end_sweep(bool paused);
  Result<std::vector<ultrasound::Contour>> contours_of(const CollectedSweep& sweep,
                                                       std::vector<std::string>& notes) const;

  InboxOptions options_;
  std::vector<tracking::ConstantLink> constants_;
  FrameCollector collector_;
  struct Pose {
    tracking::ConstantLink link;
    TimePoint acquired;
  };
  std::map<std::string, Pose> newest_;     // valid transforms, by name
  std::set<std::string> refused_;          // devices whose times were wrong, as was told
  std::chrono::nanoseconds image_age_{0};  // of the newest image when it came
  std::map<std::string, Vec3> before_;     // landmarks in RAS
};

}  // namespace brainshift::client
