// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/sequence_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "common/core/rigid_motion.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/files/packed_values.hpp"
#include "common/io/recording/sequence_header.hpp"

namespace brainshift::io {
namespace {

using FrameFields = std::map<std::string, std::string>;

// ---- fields of each frame ----

constexpr std::string_view kTransform = "Transform";
constexpr std::string_view kStatus = "Status";

tl::unexpected<Error> bad_field(int frame, const std::string& name, const std::string& what) {
  return unreadable(fmt::format("frame {}: {} {}", frame, frame_field(frame, name), what));
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
  if (!numbers || numbers->size() != 16) return bad_field(frame, name, "is not 16 numbers");
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

// Fills time_s, image_ok, links and defects for `count` frames. kUnreadable naming frame and field.
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

// ---- images ----

constexpr std::int64_t kLargestImage = 16384;  // pixels along one side

struct Flip {
  bool u = false;
  bool v = false;
};

Result<Flip> flip_to_mf(const SequenceHeader& header, const SequenceOptions& options) {
  // PLUS writes the same names into NRRD in lower case and with spaces.
  std::string text = header.field("UltrasoundImageOrientation");
  if (text.empty()) text = options.orientation;
  if (text.empty()) {
    return unreadable("UltrasoundImageOrientation is missing: the image's axes could be mirrored");
  }
  const bool known = (text.size() == 2 || text.size() == 3) && (text[0] == 'M' || text[0] == 'U') &&
                     (text[1] == 'F' || text[1] == 'N') &&
                     (text.size() == 2 || text[2] == 'A' || text[2] == 'D');
  if (!known) {
    return unreadable("UltrasoundImageOrientation = " + text +
                      ": must be MF, MN, UF or UN (and A or D after it)");
  }
  return Flip{text[0] == 'U', text[1] == 'N'};
}

Result<tracking::PixelType> pixel_type(const SequenceHeader& header) {
  if (header.element_type == "uint8") return tracking::PixelType::kUint8;
  if (header.element_type == "int16") return tracking::PixelType::kInt16;
  if (header.element_type == "uint16") return tracking::PixelType::kUint16;
  return unreadable("pixel type " + header.element_type + ": must be unsigned char or 16 bit");
}

// Width, height and number of images: the last axis counts images where there are three or four.
Status read_sizes(const SequenceHeader& header, tracking::Recording& recording, int& count) {
  std::vector<std::int64_t> sizes = header.sizes;
  if (sizes.size() == 4 && sizes[2] == 1) sizes.erase(sizes.begin() + 2);
  if (sizes.size() == 2) sizes.push_back(1);
  if (sizes.size() != 3) {
    return unreadable(fmt::format("has {} axes: must be a sequence of flat images", sizes.size()));
  }
  if (sizes[0] > kLargestImage || sizes[1] > kLargestImage) {
    return unreadable(fmt::format("images of {} x {} pixels: at most {} along a side", sizes[0],
                                  sizes[1], kLargestImage));
  }
  // PLUS writes "DimSize = 0 0 N" where it recorded a tracker alone.
  if ((sizes[0] == 0) != (sizes[1] == 0) || sizes[2] == 0) {
    return unreadable(fmt::format("images of {} x {} pixels, {} of them: nothing is recorded",
                                  sizes[0], sizes[1], sizes[2]));
  }
  recording.width = static_cast<int>(sizes[0]);
  recording.height = static_cast<int>(sizes[1]);
  count = static_cast<int>(sizes[2]);
  return {};
}

void flip_images(tracking::Recording& recording, const Flip& flip) {
  const auto pixel = static_cast<std::size_t>(tracking::bytes_per_pixel(recording.pixel_type));
  const std::size_t row = pixel * static_cast<std::size_t>(recording.width);
  const std::size_t image = row * static_cast<std::size_t>(recording.height);
  const auto reverse_units = [](char* first, std::size_t unit, std::size_t count) {
    for (std::size_t i = 0, j = count - 1; i < j; ++i, --j) {
      std::swap_ranges(first + i * unit, first + (i + 1) * unit, first + j * unit);
    }
  };
  for (std::size_t at = 0; at < recording.pixels.size(); at += image) {
    char* first = recording.pixels.data() + at;
    if (flip.v) reverse_units(first, row, static_cast<std::size_t>(recording.height));
    if (!flip.u) continue;
    for (std::size_t r = 0; r < image; r += row) {
      reverse_units(first + r, pixel, static_cast<std::size_t>(recording.width));
    }
  }
}

Status read_images(const SequenceHeader& header, const SequenceOptions& options,
                   tracking::Recording& recording) {
  const auto type = pixel_type(header);
  if (!type) return tl::unexpected(type.error());
  recording.pixel_type = *type;
  const std::string kind = header.field("UltrasoundImageType");
  if (!kind.empty() && kind != "BRIGHTNESS") {
    return unreadable("UltrasoundImageType = " + kind + ": must be BRIGHTNESS");
  }
  const auto flip = flip_to_mf(header, options);
  if (!flip) return tl::unexpected(flip.error());
  auto pixels = unpack(header, tracking::bytes_per_pixel(*type));
  if (!pixels) return tl::unexpected(pixels.error());
  recording.pixels = std::move(*pixels);
  flip_images(recording, *flip);
  return {};
}

Result<tracking::Recording> parse_sequence(const std::string& content, bool nrrd,
                                           const SequenceOptions& options) {
  const auto header = nrrd ? parse_nrrd_sequence(content) : parse_meta_sequence(content);
  if (!header) return tl::unexpected(header.error());
  tracking::Recording recording;
  int count = 0;
  if (Status ok = read_sizes(*header, recording, count); !ok) return tl::unexpected(ok.error());
  if (recording.width == 0 && !options.tracking_only) {
    return unreadable(fmt::format(
        "holds {} poses of a tracker and no images (brainshift register reads such a recording)",
        count));
  }
  if (Status ok = read_frame_fields(*header, count, recording); !ok) {
    return tl::unexpected(ok.error());
  }
  if (options.tracking_only) {
    recording.width = recording.height = 0;
    recording.image_ok.assign(static_cast<std::size_t>(count), 1);
    return recording;
  }
  if (Status ok = read_images(*header, options, recording); !ok) return tl::unexpected(ok.error());
  return recording;
}

}  // namespace

Result<tracking::Recording> read_sequence(const std::filesystem::path& path,
                                          const SequenceOptions& options) {
  const std::string extension = lower_extension(path);
  if (extension != ".mha" && extension != ".nrrd") {
    return unreadable(path, "must be a sequence file .mha or .nrrd");
  }
  return parse_file(path, [&](const std::string& content) {
    return parse_sequence(content, extension == ".nrrd", options);
  });
}

}  // namespace brainshift::io
