// SPDX-License-Identifier: Apache-2.0
#include "common/igtl/metadata.hpp"

#include <algorithm>
#include <cassert>
#include <set>

#include "common/igtl/bytes.hpp"

namespace brainshift::igtl {
namespace {

constexpr std::size_t kExtendedHeaderBytes = 12;
constexpr std::size_t kCountBytes = 2;
constexpr std::size_t kEntryBytes = 8;

std::size_t bytes_of(const Metadata& metadata) {
  std::size_t bytes = 0;
  for (const MetadataEntry& entry : metadata) bytes += entry.key.size() + entry.value.size();
  return bytes;
}

Result<Metadata> decode_metadata(std::string_view header, std::string_view text) {
  Metadata metadata;
  if (header.empty()) return metadata;
  ByteReader entries(header);
  if (entries.left() < kCountBytes) return does_not_fit("metadata count", kCountBytes, 1);
  const auto count = entries.number<std::uint16_t>();
  if (std::size_t{count} * kEntryBytes > entries.left()) {
    return does_not_fit("header of " + std::to_string(count) + " metadata entries",
                        std::size_t{count} * kEntryBytes, entries.left());
  }
  ByteReader texts(text);
  metadata.reserve(count);  // whose headers are here
  for (int i = 0; i < count; ++i) {
    const auto key_bytes = entries.number<std::uint16_t>();
    const auto encoding = entries.number<std::uint16_t>();
    const auto value_bytes = entries.number<std::uint32_t>();
    if (key_bytes > texts.left()) return does_not_fit("metadata key", key_bytes, texts.left());
    std::string key(texts.take(key_bytes));
    if (value_bytes > texts.left()) {
      return does_not_fit("metadata value", value_bytes, texts.left());
    }
    metadata.push_back({std::move(key), std::string(texts.take(value_bytes)), encoding});
  }
  return metadata;
}

}  // namespace

const std::string* find(const Metadata& metadata, std::string_view key) {
  const auto found = std::find_if(metadata.begin(), metadata.end(),
                                  [key](const MetadataEntry& entry) { return entry.key == key; });
  return found == metadata.end() ? nullptr : &found->value;
}

Status validate(const Metadata& metadata) {
  if (metadata.size() > kMaxMetadataEntries) {
    return invalid(std::to_string(metadata.size()) + " metadata entries, must be at most " +
                   std::to_string(kMaxMetadataEntries));
  }
  if (const std::size_t bytes = bytes_of(metadata); bytes > kMaxMetadataBytes) {
    return invalid(std::to_string(bytes) + " bytes of metadata, must be at most " +
                   std::to_string(kMaxMetadataBytes));
  }
  std::set<std::string_view> keys;
  for (const MetadataEntry& entry : metadata) {
    if (entry.key.empty()) return invalid("metadata key is empty");
    if (!keys.insert(entry.key).second) {
      return invalid("metadata key \"" + entry.key + "\" occurs twice");
    }
  }
  return {};
}

Result<Body> decode_body(std::uint16_t version, std::string_view body) {
  Body parts;
  if (version == 1 || body.empty()) {
    parts.content = body;
    return parts;
  }
  if (body.size() < kExtendedHeaderBytes) {
    return does_not_fit("extended header", kExtendedHeaderBytes, body.size());
  }
  ByteReader reader(body);
  const std::size_t extended_bytes = reader.number<std::uint16_t>();
  const std::size_t header_bytes = reader.number<std::uint16_t>();
  const std::uint64_t metadata_bytes = reader.number<std::uint32_t>();
  parts.message_id = reader.number<std::uint32_t>();
  if (extended_bytes < kExtendedHeaderBytes || extended_bytes > body.size()) {
    return malformed("extended header of " + std::to_string(extended_bytes) + " bytes, must have " +
                     std::to_string(kExtendedHeaderBytes) + " to " + std::to_string(body.size()));
  }
  const std::size_t left = body.size() - extended_bytes;
  if (header_bytes + metadata_bytes > left) {
    return does_not_fit("metadata", header_bytes + metadata_bytes, left);
  }
  const std::size_t content_bytes = left - header_bytes - metadata_bytes;
  parts.content = body.substr(extended_bytes, content_bytes);
  auto metadata = decode_metadata(body.substr(extended_bytes + content_bytes, header_bytes),
                                  body.substr(extended_bytes + content_bytes + header_bytes));
  if (!metadata) return tl::unexpected<Error>(std::move(metadata.error()));
  parts.metadata = std::move(*metadata);
  return parts;
}

BodyFrame encode_body_frame(std::uint16_t version, std::uint32_t message_id,
                            const Metadata& metadata) {
  BodyFrame frame;
  if (version == 1) return frame;
  assert(validate(metadata));
  const std::size_t header_bytes = kCountBytes + kEntryBytes * metadata.size();
  append_number(frame.before, static_cast<std::uint16_t>(kExtendedHeaderBytes));
  append_number(frame.before, static_cast<std::uint16_t>(header_bytes));
  append_number(frame.before, static_cast<std::uint32_t>(bytes_of(metadata)));
  append_number(frame.before, message_id);
  append_number(frame.after, static_cast<std::uint16_t>(metadata.size()));
  for (const MetadataEntry& entry : metadata) {
    append_number(frame.after, static_cast<std::uint16_t>(entry.key.size()));
    append_number(frame.after, entry.encoding);
    append_number(frame.after, static_cast<std::uint32_t>(entry.value.size()));
  }
  for (const MetadataEntry& entry : metadata) frame.after.append(entry.key).append(entry.value);
  return frame;
}

}  // namespace brainshift::igtl
