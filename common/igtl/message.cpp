// SPDX-License-Identifier: Apache-2.0
#include "common/igtl/message.hpp"

#include <utility>

#include "common/igtl/crc64.hpp"

namespace brainshift::igtl {
namespace {

// A name of 19 or 20 bytes may be cut: the field has room for 20, some writers end it with a NUL.
constexpr std::size_t kCutBytes = kMaxDeviceBytes - 1;

Error of_type(std::string_view type, Error error) {
  error.message = std::string(type) + ": " + error.message;
  return error;
}

template <typename T>
Status encode_one(const Envelope& envelope, const T& content, std::string& out) {
  out.clear();
  Header header{envelope.version, std::string(T::kType), envelope.device, envelope.timestamp, 0, 0};
  const Status valid = validate(content).and_then([&] { return validate(header); }).and_then([&] {
    return envelope.version == 1 ? Status() : validate(envelope.metadata);
  });
  if (!valid) return tl::unexpected<Error>(of_type(T::kType, valid.error()));
  const BodyFrame frame =
      encode_body_frame(envelope.version, envelope.message_id, envelope.metadata);
  out.append(kHeaderBytes, '\0').append(frame.before);
  append_content(content, out);
  out.append(frame.after);
  const std::string_view body = std::string_view(out).substr(kHeaderBytes);
  header.body_bytes = body.size();
  header.crc = crc64(body);
  out.replace(0, kHeaderBytes, encode_header(header));
  return {};
}

// What one decoder makes of a content.
template <auto kDecode>
Result<Content> decoded_by(std::string_view content) {
  return kDecode(content).map([](auto&& one) { return Content(std::forward<decltype(one)>(one)); });
}

template <typename T>
Result<Content> without_content(std::string_view) {
  return Content(T{});  // some implementations send bytes all the same
}

using Decoder = Result<Content> (*)(std::string_view);
constexpr std::pair<std::string_view, Decoder> kDecoders[] = {
    {Image::kType, decoded_by<decode_image>},
    {Transform::kType, decoded_by<decode_transform>},
    {TrackingData::kType, decoded_by<decode_tracking_data>},
    {PolyData::kType, decoded_by<decode_poly_data>},
    {PointList::kType, decoded_by<decode_point_list>},
    {Text::kType, decoded_by<decode_text>},
    {StatusReport::kType, decoded_by<decode_status_report>},
    {StatusRequest::kType, without_content<StatusRequest>},
    {Capability::kType, decoded_by<decode_capability>},
    {CapabilityRequest::kType, without_content<CapabilityRequest>},
};
static_assert(std::size(kDecoders) == std::variant_size_v<Content>);

Decoder decoder_of(std::string_view type) {
  for (const auto& [name, decoder] : kDecoders) {
    if (name == type) return decoder;
  }
  return nullptr;
}

}  // namespace

std::string_view type_of(const Content& content) {
  return std::visit([]<typename T>(const T&) { return T::kType; }, content);
}

bool is_known_type(std::string_view type) { return decoder_of(type) != nullptr; }

Status encode(const Envelope& envelope, const Content& content, std::string& out) {
  return std::visit([&](const auto& one) { return encode_one(envelope, one, out); }, content);
}

Status encode(const Envelope& envelope, const ImageView& image, std::string& out) {
  return encode_one(envelope, image, out);
}

Result<Message> decode(const Header& header, std::string_view body) {
  const Decoder decoder = decoder_of(header.type);
  if (decoder == nullptr) {
    return fail(ErrorCode::kProtocol, header.type + ": a message type that is not read");
  }
  auto parts = decode_body(header.version, body);
  if (!parts) return tl::unexpected<Error>(of_type(header.type, std::move(parts.error())));
  auto content = decoder(parts->content);
  if (!content) return tl::unexpected<Error>(of_type(header.type, std::move(content.error())));
  return Message{{header.version, header.device, header.timestamp, parts->message_id,
                  std::move(parts->metadata)},
                 std::move(*content)};
}

Result<Message> decode(std::string_view bytes) {
  const auto header = decode_header(bytes);
  if (!header) return tl::unexpected<Error>(header.error());
  const std::string_view body = bytes.substr(kHeaderBytes);
  if (body.size() != header->body_bytes) {
    return fail(ErrorCode::kProtocol, header->type + ": body of " +
                                          std::to_string(header->body_bytes) + " bytes stated, " +
                                          std::to_string(body.size()) + " received");
  }
  if (const Status status = check_crc(*header, crc64(body)); !status) {
    return tl::unexpected<Error>(status.error());
  }
  return decode(*header, body);
}

std::string full_device(const Envelope& envelope) {
  const std::string* whole = find(envelope.metadata, "IGTL_DEVICE_NAME");
  const bool longer = whole != nullptr && whole->starts_with(envelope.device) &&
                      envelope.device.size() >= kCutBytes;
  return longer ? *whole : envelope.device;
}

bool is_named(const Envelope& envelope, std::string_view name) {
  const std::string device = full_device(envelope);
  if (device == name) return true;
  return device.size() >= kCutBytes && envelope.metadata.empty() && name.starts_with(device);
}

ToolState tool_state(const Envelope& envelope, std::string_view tool) {
  constexpr std::string_view kStatus = "Status";
  ToolState state{std::string(tool)};
  int others = 0, fitting = 0;
  for (const MetadataEntry& entry : envelope.metadata) {
    if (!entry.key.ends_with(kStatus)) continue;
    const std::string name = entry.key.substr(0, entry.key.size() - kStatus.size());
    if (name == tool) return {name, entry.value == "OK"};
    ++others;
    if (tool.size() < kCutBytes || !name.starts_with(tool)) continue;
    ++fitting;
    state = {name, entry.value == "OK"};
  }
  if (fitting == 1) return state;
  return {std::string(tool), others == 0};
}

}  // namespace brainshift::igtl
