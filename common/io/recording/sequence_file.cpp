// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/sequence_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "common/io/files/file_access.hpp"
#include "common/io/files/packed_values.hpp"
#include "common/io/recording/sequence_frames.hpp"
#include "common/io/recording/sequence_header.hpp"

namespace brainshift::io {
namespace {

constexpr std::int64_t kLargestImage = 16384;  // pixels along one side

tl::unexpected<Error> unreadable(const std::string& message) {
  return fail(ErrorCode::kUnreadable, message);
}

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

// PLUS writes the same names into NRRD in lower case and with spaces.
std::string find_field(const SequenceHeader& header, const std::string& meta_name,
                       const std::string& nrrd_name) {
  for (const std::string& name : {meta_name, nrrd_name}) {
    const auto found = header.fields.find(name);
    if (found != header.fields.end()) return found->second;
  }
  return {};
}

struct Flip {
  bool u = false;
  bool v = false;
};

Result<Flip> flip_to_mf(const SequenceHeader& header, const SequenceOptions& options) {
  std::string text =
      find_field(header, "UltrasoundImageOrientation", "ultrasound image orientation");
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
  const std::string kind = find_field(header, "UltrasoundImageType", "ultrasound image type");
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
  const std::string extension = lower(path.extension().string());
  if (extension != ".mha" && extension != ".nrrd") {
    return file_error(ErrorCode::kUnreadable, path, "must be a sequence file .mha or .nrrd");
  }
  const auto content = read_file(path);
  if (!content) return tl::unexpected(content.error());
  auto recording = parse_sequence(*content, extension == ".nrrd", options);
  if (!recording) return file_error(recording.error().code, path, recording.error().message);
  return recording;
}

}  // namespace brainshift::io
