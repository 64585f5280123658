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

void FrameCollector::lose(std::size_t images) {
  for (; images > 0; --images) {
    leave_out("image that came faster than it could be used");
    if (!waits_) ++images_;
  }
}

FrameCollector::Moment* FrameCollector::moment_at(igtl::Timestamp time, TimePoint arrived) {
  const std::int64_t ns = time != 0 ? igtl::to_nanoseconds(time).count()
                                    : std::chrono::nanoseconds(arrived.time_since_epoch()).count();
  if (!moments_.empty() && !waits_) {
    const double ahead_s = 1e-9 * static_cast<double>(ns - moments_.rbegin()->first);
    if (ahead_s < -kBack_s) {
      if (images_ > 0) {
        leave_out(
            "the clock ran backwards: images before and behind cannot be counted, up to a pause");
        waits_ = true;
      }
      moments_.clear();
      pixel_bytes_ = 0;
    }
  }
  if (waits_) return nullptr;
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
    last_image_ = arrived;
    Moment* moment = moment_at(envelope.timestamp, arrived);
    if (moment == nullptr) return leave_out("image behind the end of a sweep");
    take_image(*image, *moment);
    ++images_;
  } else if (const auto* transform = std::get_if<igtl::Transform>(&message.content)) {
    if (Moment* moment = moment_at(envelope.timestamp, arrived)) {
      take_transform(envelope.device, transform->matrix,
                     igtl::find(envelope.metadata, "TransformStatus"), *moment);
    }
  } else if (const auto* tools = std::get_if<igtl::TrackingData>(&message.content)) {
    Moment* moment = moment_at(envelope.timestamp, arrived);
    for (const igtl::TrackedTool& tool : tools->tools) {
      if (moment == nullptr) return;
      const bool names_two_frames = tracking::parse_transform_name(tool.name).has_value();
      take_transform(names_two_frames ? tool.name : tool.name + kTracker, tool.matrix,
                     igtl::find(envelope.metadata, tool.name + "Status"), *moment);
    }
  }
}

void FrameCollector::take_image(const igtl::Image& image, Moment& moment) {
  if (full()) return leave_out("the sweep is too long");
  if (moment.image) {
    leave_out("a second image at the same time, and the first: they cannot be told apart");
    moment.ambiguous = true;
    return;
  }
  auto flat = flat_pixels(image);
  if (!flat) return leave_out("image that is not one slice of 8 or 16 bit grey values");
  if (width_ == 0) {
    width_ = image.part[0], height_ = image.part[1];
    pixel_type_ = flat->first;
  } else if (width_ != image.part[0] || height_ != image.part[1] || pixel_type_ != flat->first) {
    return leave_out("image of another size or type than the sweep's first");
  }
  moment.image = images_;
  if (options_.keep_pixels) moment.pixels = std::move(flat->second);
  pixel_bytes_ += moment.pixels.size();
}

void FrameCollector::take_transform(const std::string& name, const igtl::Matrix34f& values,
                                    const std::string* status, Moment& moment) {
  const auto frames = tracking::parse_transform_name(name);
  if (!frames) return leave_out("transform " + name + ", which names no two frames");
  const std::string key = frames->name();
  pairs_.emplace(key, *frames);
  const auto [known, is_new] = moment.links.try_emplace(key);
  tracking::Link& link = known->second;
  const bool valid = status == nullptr || *status == "OK";
  if (!is_new) {
    // Sent again, or another pose that was rounded to the same time.
    const bool known_valid = link.status == tracking::LinkStatus::kOk;
    const bool same = known_valid && valid
                          ? link.T_to_from.matrix().isApprox(igtl::to_matrix(values), 1e-5)
                          : !known_valid && !valid;
    if (same) return;
    link.status = tracking::LinkStatus::kInvalid;
    moment.ambiguous = true;
    leave_out("another pose " + key + " of the same time, and the image of that time");
    return;
  }
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
  sweep.moment_of_image.assign(images_, -1);
  sweep.images.time_s.assign(images_, 0.0);
  sweep.images.image_ok.assign(images_, 0);
  const std::size_t bytes =
      options_.keep_pixels ? static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) *
                                 static_cast<std::size_t>(tracking::bytes_per_pixel(pixel_type_))
                           : 0;
  sweep.images.pixels.assign(images_ * bytes, '\0');
  // Seconds since the first moment: as doubles, times since 1970 would keep 0.2 microseconds only.
  const std::int64_t first_ns = moments_.empty() ? 0 : moments_.begin()->first;
  int at = 0;
  for (auto& [ns, moment] : moments_) {
    const double time_s = 1e-9 * static_cast<double>(ns - first_ns);
    const bool used = moment.image && !moment.ambiguous;
    sweep.moments.time_s.push_back(time_s);
    sweep.moments.image_ok.push_back(used ? 1 : 0);
    for (tracking::LinkSeries& series : sweep.moments.links) {
      const auto link = moment.links.find(series.frames.name());
      if (link != moment.links.end()) series.samples[static_cast<std::size_t>(at)] = link->second;
    }
    if (used) {
      sweep.moment_of_image[*moment.image] = at;
      sweep.images.time_s[*moment.image] = time_s;
      sweep.images.image_ok[*moment.image] = 1;
      sweep.images.pixels.replace(*moment.image * bytes, bytes, moment.pixels);
      moment.pixels = {};
    }
    ++at;
  }
  for (std::size_t i = 1; i < images_; ++i) {
    double& time_s = sweep.images.time_s[i];
    if (!sweep.images.image_ok[i]) time_s = sweep.images.time_s[i - 1];
  }
  sweep.moments.defects = std::exchange(defects_, {});
  sweep.last_image = last_image_.value_or(TimePoint{});
  for (const auto& [reason, times] : left_out_) {
    sweep.notes.push_back(std::to_string(times) + " left out: " + reason);
  }
  moments_.clear();
  pairs_.clear();
  left_out_.clear();
  images_ = pixel_bytes_ = 0;
  width_ = height_ = 0;
  waits_ = !paused;
  if (paused) last_image_.reset();
  return sweep;
}

}  // namespace brainshift::client
