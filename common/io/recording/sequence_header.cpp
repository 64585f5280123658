// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/sequence_header.hpp"

#include <fmt/format.h>

#include <charconv>
#include <optional>

#include "common/io/files/csv_numbers.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

constexpr std::string_view kFramePrefix = "Seq_Frame";

bool names_equal(std::string_view a, std::string_view b) {
  return !BeforeByLetters{}(a, b) && !BeforeByLetters{}(b, a);
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

// None: the header does not say.
Result<std::optional<bool>> flag(const SequenceHeader& header, const std::string& key) {
  const std::string text = header.word(key);
  if (text.empty()) return std::optional<bool>();
  if (text == "true" || text == "t" || text == "1") return std::optional(true);
  if (text == "false" || text == "f" || text == "0") return std::optional(false);
  return unreadable(fmt::format("{} = {}: must be True or False", key, header.field(key)));
}

Status understand_meta(SequenceHeader& header) {
  const std::string dim_size = header.field("DimSize");
  auto sizes = parse_sizes("DimSize", dim_size, 0);
  if (!sizes) return tl::unexpected(sizes.error());
  header.sizes = std::move(*sizes);
  const std::string dimensions = header.field("NDims");
  if (dim_size.empty() || std::to_string(header.sizes.size()) != dimensions) {
    return unreadable(fmt::format("NDims = \"{}\" does not agree with the {} sizes \"{}\"",
                                  dimensions, header.sizes.size(), dim_size));
  }
  header.element_type = element_type(header.field("ElementType"));
  // MetaIO looks at the first letter alone, and calls the byte order by two names.
  std::optional<bool> big_endian;
  for (const char* key : {"BinaryDataByteOrderMSB", "ElementByteOrderMSB"}) {
    const auto said = flag(header, key);
    if (!said) return tl::unexpected(said.error());
    if (*said && big_endian && *big_endian != **said) {
      return unreadable("BinaryDataByteOrderMSB and ElementByteOrderMSB contradict each other");
    }
    if (*said) big_endian = *said;
  }
  header.big_endian = big_endian.value_or(false);
  const auto compressed = flag(header, "CompressedData");
  if (!compressed) return tl::unexpected(compressed.error());
  header.compressed = compressed->value_or(false);
  const auto binary = flag(header, "BinaryData");
  if (!binary) return tl::unexpected(binary.error());
  if (!binary->value_or(true)) {
    return unreadable("BinaryData = False: pixels as text are not supported");
  }
  const std::string channels = header.field("ElementNumberOfChannels");
  if (!channels.empty() && channels != "1") {
    return unreadable("ElementNumberOfChannels = " + channels + ": must be 1 (grey images)");
  }
  return {};
}

}  // namespace

std::string frame_field(int frame, const std::string& name) {
  return fmt::format("{}{:04d}_{}", kFramePrefix, frame, name);
}

Result<SequenceHeader> parse_meta_sequence(std::string_view content) {
  SequenceHeader header;
  std::string_view rest = content;
  while (true) {
    if (rest.empty() || content.size() - rest.size() > kLargestTextHeader) {
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
    if (names_equal(key, "ElementDataFile")) {
      if (!names_equal(value, "LOCAL")) {
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

Result<SequenceHeader> parse_nrrd_sequence(std::string_view content) {
  auto nrrd = parse_nrrd_header(content);
  if (!nrrd) return tl::unexpected(nrrd.error());
  const std::string kinds = nrrd->word("kinds");
  if (!kinds.starts_with("domain") && !kinds.empty()) {
    return unreadable("kinds = " + kinds + ": the first axis must be the image's");
  }
  SequenceHeader header;
  static_cast<PackedValues&>(header) = std::move(*nrrd);
  for (const auto& [key, value] : nrrd->fields) {
    if (Status ok = store(header, key, value); !ok) return tl::unexpected(ok.error());
  }
  return header;
}

}  // namespace brainshift::io
