// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/sequence_header.hpp"

#include <fmt/format.h>

#include <charconv>

namespace brainshift::io {
namespace {

constexpr std::string_view kFramePrefix = "Seq_Frame";
constexpr std::int64_t kLargestSize = 1'000'000;
constexpr std::size_t kLargestHeader = std::size_t{256} << 20;

tl::unexpected<Error> unreadable(const std::string& message) {
  return fail(ErrorCode::kUnreadable, message);
}

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

// Cuts the first line off, without its line feed.
std::string_view take_line(std::string_view& rest) {
  const std::size_t end = std::min(rest.find('\n'), rest.size());
  const std::string_view line = rest.substr(0, end);
  rest.remove_prefix(std::min(end + 1, rest.size()));
  return line;
}

// Puts a key either among the file's fields or, "Seq_Frame0012_Name", among those of a frame.
Status store(SequenceHeader& header, std::string_view key, std::string_view value) {
  std::string_view rest = key;
  if (!rest.starts_with(kFramePrefix)) {
    const bool is_new = header.fields.emplace(key, value).second;
    if (!is_new) return unreadable(fmt::format("field {} is given twice", key));
    return {};
  }
  rest.remove_prefix(kFramePrefix.size());
  int frame = -1;
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), frame);
  rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  if (error != std::errc() || frame < 0 || frame >= kLargestSize || rest.size() < 2 ||
      rest[0] != '_') {
    return unreadable(fmt::format("field {} does not name a frame and a value", key));
  }
  const bool is_new = header.frames[frame].emplace(rest.substr(1), value).second;
  if (!is_new) return unreadable(fmt::format("field {} is given twice", key));
  return {};
}

Result<std::vector<std::int64_t>> parse_sizes(const std::string& field, std::string_view text) {
  std::vector<std::int64_t> sizes;
  for (std::string_view rest = trimmed(text); !rest.empty(); rest = trimmed(rest)) {
    std::int64_t size = 0;
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), size);
    if (error != std::errc() || size < 1 || size > kLargestSize) {
      return unreadable(
          fmt::format("{} = {}: every size must be 1 to {}", field, text, kLargestSize));
    }
    sizes.push_back(size);
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  }
  return sizes;
}

std::string take_field(SequenceHeader& header, const std::string& key) {
  const auto found = header.fields.find(key);
  return found == header.fields.end() ? std::string() : found->second;
}

Status check_dimensions(const SequenceHeader& header, const std::string& name,
                        const std::string& dimensions, const std::string& sizes) {
  if (sizes.empty() || std::to_string(header.sizes.size()) != dimensions) {
    return unreadable(fmt::format("{} = \"{}\" does not agree with the {} sizes \"{}\"", name,
                                  dimensions, header.sizes.size(), sizes));
  }
  return {};
}

// MetaImage's name of a type, or NRRD's, as one of ours; others unchanged.
std::string element_type(const std::string& name) {
  static const std::map<std::string, std::string> kNames = {
      {"MET_UCHAR", "uint8"},    {"MET_SHORT", "int16"},
      {"MET_USHORT", "uint16"},  {"MET_FLOAT", "float"},
      {"uchar", "uint8"},        {"unsigned char", "uint8"},
      {"uint8_t", "uint8"},      {"short", "int16"},
      {"short int", "int16"},    {"int16_t", "int16"},
      {"signed short", "int16"}, {"signed short int", "int16"},
      {"ushort", "uint16"},      {"unsigned short", "uint16"},
      {"uint16_t", "uint16"},    {"unsigned short int", "uint16"}};
  const auto found = kNames.find(name);
  return found == kNames.end() ? name : found->second;
}

Status understand_meta(SequenceHeader& header) {
  const std::string dim_size = take_field(header, "DimSize");
  auto sizes = parse_sizes("DimSize", dim_size);
  if (!sizes) return tl::unexpected(sizes.error());
  header.sizes = std::move(*sizes);
  if (Status ok = check_dimensions(header, "NDims", take_field(header, "NDims"), dim_size); !ok) {
    return ok;
  }
  header.element_type = element_type(take_field(header, "ElementType"));
  const auto flag = [&](const std::string& key, bool& value) -> Status {
    const std::string text = take_field(header, key);
    if (!text.empty() && text != "True" && text != "False") {
      return unreadable(fmt::format("{} = {}: must be True or False", key, text));
    }
    value = text == "True";
    return {};
  };
  if (Status ok = flag("BinaryDataByteOrderMSB", header.big_endian); !ok) return ok;
  if (Status ok = flag("CompressedData", header.compressed); !ok) return ok;
  if (take_field(header, "BinaryData") == "False") {
    return unreadable("BinaryData = False: pixels as text are not supported");
  }
  const std::string channels = take_field(header, "ElementNumberOfChannels");
  if (!channels.empty() && channels != "1") {
    return unreadable("ElementNumberOfChannels = " + channels + ": must be 1 (grey images)");
  }
  return {};
}

Status understand_nrrd(SequenceHeader& header) {
  const std::string text = take_field(header, "sizes");
  auto sizes = parse_sizes("sizes", text);
  if (!sizes) return tl::unexpected(sizes.error());
  header.sizes = std::move(*sizes);
  if (Status ok = check_dimensions(header, "dimension", take_field(header, "dimension"), text);
      !ok) {
    return ok;
  }
  header.element_type = element_type(take_field(header, "type"));
  const std::string encoding = take_field(header, "encoding");
  header.compressed = encoding == "gzip" || encoding == "gz";
  if (!header.compressed && encoding != "raw") {
    return unreadable("encoding = " + encoding + ": must be raw or gzip");
  }
  const std::string endian = take_field(header, "endian");
  if (!endian.empty() && endian != "little" && endian != "big") {
    return unreadable("endian = " + endian + ": must be little or big");
  }
  header.big_endian = endian == "big";
  for (const char* key : {"data file", "datafile", "line skip", "byte skip"}) {
    const std::string value = take_field(header, key);
    if (!value.empty() && value != "0") {
      return unreadable(fmt::format("{} = {}: pixels must follow the header", key, value));
    }
  }
  const std::string kinds = take_field(header, "kinds");
  if (!kinds.starts_with("domain") && !kinds.empty()) {
    return unreadable("kinds = " + kinds + ": the first axis must be the image's");
  }
  return {};
}

}  // namespace

std::string frame_field(int frame, const std::string& name) {
  return fmt::format("{}{:04d}_{}", kFramePrefix, frame, name);
}

Result<SequenceHeader> parse_meta_header(std::string_view content) {
  SequenceHeader header;
  std::string_view rest = content;
  while (true) {
    if (rest.empty() || content.size() - rest.size() > kLargestHeader) {
      return unreadable("is no MetaImage: its header has no ElementDataFile");
    }
    const std::string_view line = take_line(rest);
    const std::size_t equals = line.find('=');
    if (equals == std::string_view::npos) {
      if (trimmed(line).empty()) continue;
      return unreadable("is no MetaImage: its header has no ElementDataFile");
    }
    const std::string_view key = trimmed(line.substr(0, equals));
    const std::string_view value = trimmed(line.substr(equals + 1));
    if (key == "ElementDataFile") {
      if (value != "LOCAL") {
        return unreadable(
            fmt::format("ElementDataFile = {}: must be LOCAL (pixels in the same file)", value));
      }
      break;
    }
    if (Status ok = store(header, key, value); !ok) return tl::unexpected(ok.error());
  }
  header.data = rest;
  if (Status ok = understand_meta(header); !ok) return tl::unexpected(ok.error());
  return header;
}

Result<SequenceHeader> parse_nrrd_header(std::string_view content) {
  SequenceHeader header;
  std::string_view rest = content;
  if (!take_line(rest).starts_with("NRRD000")) return unreadable("is no NRRD file");
  while (true) {
    if (rest.empty() || content.size() - rest.size() > kLargestHeader) {
      return unreadable("its NRRD header has no end (an empty line)");
    }
    const std::string_view line = trimmed(take_line(rest));
    if (line.empty()) break;
    if (line.front() == '#') continue;
    const std::size_t colon = line.find(':');
    if (colon == std::string_view::npos || colon + 1 == line.size()) {
      return unreadable(fmt::format("header line \"{}\" has no value", line.substr(0, 60)));
    }
    const std::size_t skip = line[colon + 1] == '=' ? 2 : 1;
    const Status ok =
        store(header, trimmed(line.substr(0, colon)), trimmed(line.substr(colon + skip)));
    if (!ok) return tl::unexpected(ok.error());
  }
  header.data = rest;
  if (Status ok = understand_nrrd(header); !ok) return tl::unexpected(ok.error());
  return header;
}

}  // namespace brainshift::io
