// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/bridge/frame_collector.hpp"

#include <cstring>
#include <utility>

#include "common/core/rigid_motion.hpp"

namespace brainshift::client {
namespace {

constexpr std::size_t kMaxDefects = 1000;
constexpr const char* kTracker = "ToTracker";

// The pixels of a flat image and their type; empty when it is none that a recording can hold.
template <typename T>
std::string pixel_bytes(const std::vector<T>& values) {
  std::string bytes(values.size() * sizeof(T), '\0');
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}
std::optional<std::pair<tracking::PixelType, std::string>> flat_pixels(const igtl::Image& image) {
  using tracking::PixelType;
  if (image.components != 1 || image.part[2] != 1 || !image.is_whole()) return std::nullopt;
  if (const auto* u8 = std::get_if<std::vector<std::uint8_t>>(&image.voxels)) {
    return std::pair{PixelType::kUint8, pixel_bytes(*u8)};
  }
  if (const auto* i16 = std::get_if<std::vector<std::int16_t>>(&image.voxels)) {
    return std::pair{PixelType::kInt16, pixel_bytes(*i16)};
  }
  if (const auto* u16 = std::get_if<std::vector<std::uint16_t>>(&image.voxels)) {
    return std::pair{PixelType::kUint16, pixel_bytes(*u16)};
  }
  return std::nullopt;
}

}  // namespace

bool FrameCollector::full() const {
  return images() >= options_.max_images || pixel_bytes_ >= options_.max_pixel_bytes;
}

FrameCollector::Moment* FrameCollector::moment_at(igtl::Timestamp time, TimePoint arrived) {
  const std::int64_t ns = time != 0 ? igtl::to_nanoseconds(time).count()
                                    : std::chrono::nanoseconds(arrived.time_since_epoch()).count();
  if (!moments_.empty()) {
    const double ahead_s = 1e-9 * static_cast<double>(ns - moments_.rbegin()->first);
    if (ahead_s < -kBack_s) {
      leave_out("the clock ran backwards: everything before it");
      moments_.clear();
      images_ = pixel_bytes_ = 0;
      last_image_.reset();
    }
  }
  if (images_ == 0) {
    while (!moments_.empty() &&
           1e-9 * static_cast<double>(ns - moments_.begin()->first) > kKept_s) {
      moments_.erase(moments_.begin());
    }
  }
  return &moments_[ns];
}

void FrameCollector::take(const igtl::Message& message, TimePoint arrived) {
  const igtl::Envelope& envelope = message.envelope;
  if (const auto* image = std::get_if<igtl::Image>(&message.content)) {
    if (!options_.image_device.empty() && envelope.device != options_.image_device) return;
    Moment& moment = *moment_at(envelope.timestamp, arrived);
    if (!moment.image) moment.untimed = envelope.timestamp == 0;
    take_image(*image, moment, arrived);
  } else if (const auto* transform = std::get_if<igtl::Transform>(&message.content)) {
    const std::string* status = igtl::find(envelope.metadata, "TransformStatus");
    take_transform(igtl::full_device(envelope), transform->matrix,
                   status == nullptr || *status == "OK", *moment_at(envelope.timestamp, arrived));
  } else if (const auto* tools = std::get_if<igtl::TrackingData>(&message.content)) {
    for (const igtl::TrackedTool& tool : tools->tools) {
      const igtl::ToolState state = igtl::tool_state(envelope, tool.name);
      const bool names_two_frames = tracking::parse_transform_name(state.name).has_value();
      take_transform(names_two_frames ? state.name : state.name + kTracker, tool.matrix,
                     state.valid, *moment_at(envelope.timestamp, arrived));
    }
  }
}

void FrameCollector::take_image(const igtl::Image& image, Moment& moment, TimePoint arrived) {
  if (full()) return leave_out("the sweep is too long");
  if (moment.image) return leave_out("a second image at the same time");
  auto flat = flat_pixels(image);
  if (!flat) return leave_out("image that is not one slice of 8 or 16 bit grey values");
  if (images_ == 0) {
    width_ = image.part[0], height_ = image.part[1];
    pixel_type_ = flat->first;
  } else if (width_ != image.part[0] || height_ != image.part[1] || pixel_type_ != flat->first) {
    return leave_out("image of another size or type than the sweep's first");
  }
  moment.image = true;
  if (options_.keep_pixels) moment.pixels = std::move(flat->second);
  pixel_bytes_ += moment.pixels.size();
  ++images_;
  last_image_ = arrived;
}

void FrameCollector::take_transform(const std::string& name, const igtl::Matrix34f& values,
                                    bool valid, Moment& moment) {
  const auto frames = tracking::parse_transform_name(name);
  if (!frames) return leave_out("transform " + name + ", which names no two frames");
  const std::string key = frames->name();
  pairs_.emplace(key, *frames);
  tracking::Link& link = moment.links[key];
  link.status = tracking::LinkStatus::kInvalid;
  if (!valid) return;
  const Eigen::Matrix4d matrix = igtl::to_matrix(values);
  const bool scales =
      tracking::is_image_frame(frames->from) || tracking::is_image_frame(frames->to);
  const Status usable = scales ? check_affine(matrix) : check_rigid(matrix);
  if (!usable) {
    if (defects_.size() < kMaxDefects) defects_.push_back({0, key, usable.error().message});
    return;
  }
  link.status = tracking::LinkStatus::kOk;
  if (scales) {
    link.T_to_from.matrix() = matrix;
  } else {
    link.T_to_from = nearest_rigid(matrix);
  }
}

CollectedSweep FrameCollector::finish() {
  CollectedSweep sweep;
  const std::size_t count = moments_.size();
  for (tracking::Recording* each : {&sweep.moments, &sweep.images}) {
    each->width = width_, each->height = height_;
    each->pixel_type = pixel_type_;
  }
  for (const auto& [key, frames] : pairs_) {
    sweep.moments.links.push_back({frames, std::vector<tracking::Link>(count)});
  }
  // Seconds since the first moment: as doubles, times since 1970 would keep 0.2 microseconds only.
  const std::int64_t first_ns = moments_.begin()->first;
  int at = 0;
  for (auto& [ns, moment] : moments_) {
    const double time_s = 1e-9 * static_cast<double>(ns - first_ns);
    sweep.moments.time_s.push_back(time_s);
    sweep.moments.image_ok.push_back(moment.image ? 1 : 0);
    for (tracking::LinkSeries& series : sweep.moments.links) {
      const auto link = moment.links.find(series.frames.name());
      if (link != moment.links.end()) series.samples[static_cast<std::size_t>(at)] = link->second;
    }
    if (moment.image) {
      sweep.moment_of_image.push_back(at);
      sweep.image_ns.push_back(ns);
      sweep.untimed = sweep.untimed || moment.untimed;
      sweep.images.time_s.push_back(time_s);
      sweep.images.image_ok.push_back(1);
      sweep.images.pixels += moment.pixels;
      moment.pixels = {};
    }
    ++at;
  }
  sweep.moments.defects = std::exchange(defects_, {});
  sweep.last_image = *last_image_;
  for (const auto& [reason, times] : left_out_) {
    sweep.notes.push_back(std::to_string(times) + " left out: " + reason);
  }
  moments_.clear();
  pairs_.clear();
  left_out_.clear();
  images_ = pixel_bytes_ = 0;
  last_image_.reset();
  return sweep;
}

}  // namespace brainshift::client
