// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/sequence_frames.hpp"
#include "common/core/rigid_motion.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <optional>

namespace brainshift::io {
namespace {

using FrameFields = std::map<std::string, std::string>;

constexpr std::string_view kTransform = "Transform";
constexpr std::string_view kStatus = "Status";

tl::unexpected<Error> bad_field(int frame, const std::string& name, const std::string& what) {
  return fail(ErrorCode::kUnreadable,
              fmt::format("frame {}: {} {}", frame, frame_field(frame, name), what));
}

// All numbers of a text, "nan" and "inf" among them; nothing if something else is in it.
std::optional<std::vector<double>> parse_numbers(std::string_view text) {
  std::vector<double> numbers;
  while (true) {
    const std::size_t first = text.find_first_not_of(" \t");
    if (first == std::string_view::npos) return numbers;
    text.remove_prefix(first);
    double number = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc()) return std::nullopt;
    numbers.push_back(number);
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    if (!text.empty() && text.front() != ' ' && text.front() != '\t') return std::nullopt;
  }
}

Status read_time(const FrameFields& fields, int frame, std::vector<double>& time_s) {
  const auto found = fields.find("Timestamp");
  if (found == fields.end()) return bad_field(frame, "Timestamp", "is missing");
  const auto numbers = parse_numbers(found->second);
  if (!numbers || numbers->size() != 1 || !std::isfinite(numbers->front())) {
    return bad_field(frame, "Timestamp", "= " + found->second + ": must be a number of seconds");
  }
  const double time = numbers->front();
  if (!time_s.empty() && time < time_s.back()) {
    return bad_field(frame, "Timestamp",
                     fmt::format("= {} s: the clock runs backwards (the frame before has {} s)",
                                 time, time_s.back()));
  }
  time_s.push_back(time);
  return {};
}

bool is_transform(std::string_view name) {
  return name.size() > kTransform.size() && name.ends_with(kTransform);
}

tracking::LinkSeries& series_of(tracking::Recording& recording, const tracking::FramePair& frames,
                                int count) {
  for (tracking::LinkSeries& series : recording.links) {
    if (series.frames.from == frames.from && series.frames.to == frames.to) return series;
  }
  recording.links.push_back({frames, std::vector<tracking::Link>(static_cast<std::size_t>(count))});
  return recording.links.back();
}

Status read_link(const FrameFields& fields, int frame, int count, const std::string& name,
                 tracking::Recording& recording) {
  const auto frames = tracking::parse_transform_name(
      std::string_view(name).substr(0, name.size() - kTransform.size()));
  if (!frames) return bad_field(frame, name, "cannot be read: " + frames.error().message);
  const auto numbers = parse_numbers(fields.at(name));
  if (!numbers || numbers->size() != 16) {
    return bad_field(frame, name, "is not 16 numbers");
  }
  tracking::Link& link =
      series_of(recording, *frames, count).samples[static_cast<std::size_t>(frame)];
  const auto status = fields.find(name + std::string(kStatus));
  if (status == fields.end()) {
    link.status = tracking::LinkStatus::kWithoutStatus;
    return {};
  }
  link.status = tracking::LinkStatus::kInvalid;
  if (status->second != "OK") return {};
  const Eigen::Matrix4d matrix =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(numbers->data());
  const bool scales =
      tracking::is_image_frame(frames->from) || tracking::is_image_frame(frames->to);
  const Status usable = scales ? check_affine(matrix) : check_rigid(matrix);
  if (!usable) {
    recording.defects.push_back({frame, frame_field(frame, name), usable.error().message});
    return {};
  }
  link.status = tracking::LinkStatus::kOk;
  if (scales) {
    link.T_to_from.matrix() = matrix;
  } else {
    link.T_to_from = nearest_rigid(matrix);
  }
  return {};
}

}  // namespace

Status read_frame_fields(const SequenceHeader& header, int count, tracking::Recording& recording) {
  if (!header.frames.empty() && header.frames.rbegin()->first >= count) {
    const auto& [frame, fields] = *header.frames.rbegin();
    return bad_field(frame, fields.begin()->first,
                     fmt::format("is there, but the file holds {} images", count));
  }
  for (int frame = 0; frame < count; ++frame) {
    const auto found = header.frames.find(frame);
    const FrameFields fields = found == header.frames.end() ? FrameFields{} : found->second;
    if (Status ok = read_time(fields, frame, recording.time_s); !ok) return ok;
    const auto image = fields.find("ImageStatus");
    recording.image_ok.push_back(image == fields.end() || image->second == "OK" ? 1 : 0);
    for (const auto& [name, value] : fields) {
      if (!is_transform(name)) continue;
      if (Status ok = read_link(fields, frame, count, name, recording); !ok) return ok;
    }
  }
  return {};
}

}  // namespace brainshift::io
