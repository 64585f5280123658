// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/bridge/frame_collector.hpp"

#include <cstring>
#include <functional>
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

bool is_same(const tracking::Link& a, const tracking::Link& b) {
  return a.status == b.status && (a.status != tracking::LinkStatus::kOk ||
                                  a.T_to_from.matrix().isApprox(b.T_to_from.matrix(), 1e-6));
}

}  // namespace

bool FrameCollector::wants(const igtl::Envelope& image) const {
  return options_.image_device.empty() || igtl::is_named(image, options_.image_device);
}

bool FrameCollector::full() const {
  return images() >= options_.max_images || pixel_bytes_ >= options_.max_pixel_bytes;
}

FrameCollector::Moment* FrameCollector::moment_at(igtl::Timestamp time, TimePoint arrived) {
  const std::int64_t ns = time != 0 ? igtl::to_nanoseconds(time).count()
                                    : std::chrono::nanoseconds(arrived.time_since_epoch()).count();
  if (waits_) return nullptr;
  if (!moments_.empty()) {
    const double ahead_s = 1e-9 * static_cast<double>(ns - moments_.rbegin()->first);
    if (ahead_s < -kBack_s) {
      moments_.clear();
      if (images_ > 0) {
        left_out_["the clock ran backwards: images before it"] += images();
        images_ = pixel_bytes_ = 0;
        waits_ = true;
        return nullptr;
      }
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
    if (!wants(envelope)) return;
    last_image_ = arrived;
    Moment* moment = moment_at(envelope.timestamp, arrived);
    if (moment == nullptr) return leave_out("image before the next pause");
    take_image(*image, envelope.timestamp == 0, *moment);
  } else if (const auto* transform = std::get_if<igtl::Transform>(&message.content)) {
    const std::string* status = igtl::find(envelope.metadata, "TransformStatus");
    if (Moment* moment = moment_at(envelope.timestamp, arrived)) {
      take_transform(igtl::full_device(envelope), transform->matrix,
                     status == nullptr || *status == "OK", *moment);
    }
  } else if (const auto* tools = std::get_if<igtl::TrackingData>(&message.content)) {
    Moment* moment = moment_at(envelope.timestamp, arrived);
    if (moment == nullptr) return;
    for (const igtl::TrackedTool& tool : tools->tools) {
      const igtl::ToolState state = igtl::tool_state(envelope, tool.name);
      const bool names_two_frames = tracking::parse_transform_name(state.name).has_value();
      take_transform(names_two_frames ? state.name : state.name + kTracker, tool.matrix,
                     state.valid, *moment);
    }
  }
}

void FrameCollector::take_image(const igtl::Image& image, bool untimed, Moment& moment) {
  if (full()) return leave_out("the sweep is too long");
  auto flat = flat_pixels(image);
  if (!flat) return leave_out("image that is not one slice of 8 or 16 bit grey values");
  if (images_ == 0) {
    width_ = image.part[0], height_ = image.part[1];
    pixel_type_ = flat->first;
  } else if (width_ != image.part[0] || height_ != image.part[1] || pixel_type_ != flat->first) {
    return leave_out("image of another size or type than the sweep's first");
  }
  const std::size_t hash = std::hash<std::string>{}(flat->second);
  if (moment.image) {
    if (hash == moment.image_hash) return;
    moment.ambiguous = true;
    return leave_out("a second image at the same time, and the first: they cannot be told apart");
  }
  moment.image = true;
  moment.untimed = untimed;
  moment.image_hash = hash;
  if (options_.keep_pixels) moment.pixels = std::move(flat->second);
  pixel_bytes_ += moment.pixels.size();
  ++images_;
}

void FrameCollector::take_transform(const std::string& name, const igtl::Matrix34f& values,
                                    bool valid, Moment& moment) {
  const auto frames = tracking::parse_transform_name(name);
  if (!frames) return leave_out("transform " + name + ", which names no two frames");
  const std::string key = frames->name();
  pairs_.emplace(key, *frames);
  tracking::Link link;
  link.status = tracking::LinkStatus::kInvalid;
  const Eigen::Matrix4d matrix = igtl::to_matrix(values);
  const bool scales =
      tracking::is_image_frame(frames->from) || tracking::is_image_frame(frames->to);
  const Status usable = scales ? check_affine(matrix) : check_rigid(matrix);
  if (valid && !usable) {
    if (defects_.size() < kMaxDefects) defects_.push_back({0, key, usable.error().message});
  } else if (valid) {
    link.status = tracking::LinkStatus::kOk;
    if (scales) {
      link.T_to_from.matrix() = matrix;
    } else {
      link.T_to_from = nearest_rigid(matrix);
    }
  }
  const auto [known, is_new] = moment.links.try_emplace(key, link);
  if (is_new || is_same(known->second, link)) return;
  known->second.status = tracking::LinkStatus::kInvalid;
  moment.ambiguous = true;
  leave_out("another pose " + key + " of the same time, and the image of that time");
}

CollectedSweep FrameCollector::finish(bool paused) {
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
  const std::int64_t first_ns = moments_.empty() ? 0 : moments_.begin()->first;
  int at = 0;
  for (auto& [ns, moment] : moments_) {
    const double time_s = 1e-9 * static_cast<double>(ns - first_ns);
    sweep.moments.time_s.push_back(time_s);
    const char ok = moment.image && !moment.ambiguous ? 1 : 0;
    sweep.moments.image_ok.push_back(ok);
    for (tracking::LinkSeries& series : sweep.moments.links) {
      const auto link = moment.links.find(series.frames.name());
      if (link != moment.links.end()) series.samples[static_cast<std::size_t>(at)] = link->second;
    }
    if (moment.image) {
      sweep.moment_of_image.push_back(at);
      sweep.image_ns.push_back(ns);
      sweep.untimed = sweep.untimed || moment.untimed;
      sweep.images.time_s.push_back(time_s);
      sweep.images.image_ok.push_back(ok);
      sweep.images.pixels += moment.pixels;
      moment.pixels = {};
    }
    ++at;
  }
  sweep.moments.defects = std::exchange(defects_, {});
  sweep.last_image = last_image_.value_or(TimePoint{});
  for (const auto& [reason, times] : left_out_) {
    sweep.notes.push_back(std::to_string(times) + " left out: " + reason);
  }
  if (!paused)
    sweep.notes.emplace_back("the sweep ends here: what comes until a pause is left out");
  moments_.clear();
  pairs_.clear();
  left_out_.clear();
  images_ = pixel_bytes_ = 0;
  waits_ = !paused;
  if (paused) last_image_.reset();
  return sweep;
}

}  // namespace brainshift::client
