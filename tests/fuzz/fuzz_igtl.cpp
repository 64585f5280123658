// SPDX-License-Identifier: GPL-3.0-or-later
// OpenIGTLink messages. The bytes are a stream as a connection brings it, whole and in pieces;
// and a header with a body whose checksum is not looked at: behind it a fuzzer would never come.
#include <string>

#include "common/igtl/crc64.hpp"
#include "common/igtl/message.hpp"
#include "common/igtl/poly_data.hpp"
#include "common/igtl/stream_reader.hpp"
#include "tests/fuzz/fuzz_target.hpp"

namespace brainshift::fuzz {
namespace {

struct Read {
  int messages = 0;
  std::string error;
};

Read read(std::string_view stream, std::size_t piece) {
  igtl::StreamReader reader;
  Read result;
  for (std::size_t at = 0; at < stream.size() && result.error.empty(); at += piece) {
    std::string_view bytes = stream.substr(at, piece);
    while (!bytes.empty()) {
      const auto packet = reader.read(bytes);
      require(reader.held_bytes() <= 2 * stream.size() + 64, "a reader holds what has come");
      if (!packet) {
        result.error = packet.error().message;
        break;
      }
      if (*packet) ++result.messages;
    }
  }
  return result;
}

// NaN in a voxel or an attribute differs from itself; the bytes do not.
void check_round_trip(igtl::Message message) {
  if (!validate(message.envelope.metadata)) message.envelope.metadata.clear();
  std::string bytes;
  require(encode(message.envelope, message.content, bytes).has_value(),
          "a message that was decoded can be encoded");
  const auto again = igtl::decode(bytes);
  require(again.has_value(), "a message that was encoded can be decoded");
  require(again->envelope == message.envelope, "an envelope is the same when it is decoded again");
  const igtl::Content& content = message.content;
  const bool has_nan = !(content == content);
  require(has_nan || again->content == content, "a content is the same when it is decoded again");
  std::string twice;
  require(encode(again->envelope, again->content, twice).has_value() && twice == bytes,
          "a message that was decoded again is the same bytes");
  if (const auto* data = std::get_if<igtl::PolyData>(&message.content)) (void)to_surface(*data);
  if (const auto* image = std::get_if<igtl::Image>(&message.content)) {
    (void)image->geometry.T_ras_voxel();
  }
}

}  // namespace

void run(std::string_view bytes) {
  const Read whole = read(bytes, bytes.size());
  const Read pieces = read(bytes, 7);
  require(whole.messages == pieces.messages && whole.error == pieces.error,
          "a stream is the same messages in whatever pieces it comes");

  auto header = igtl::decode_header(bytes);
  if (!header) return;
  const std::string_view body = bytes.substr(igtl::kHeaderBytes);
  if (auto message = igtl::decode(*header, body)) check_round_trip(std::move(*message));
  header->body_bytes = body.size();
  header->crc = igtl::crc64(body);
  const std::string framed = encode_header(*header) + std::string(body);
  const Read two = read(framed + framed, 1000);
  require(two.messages == 2 || (two.messages == 0 && !two.error.empty()),
          "a message with the right size and checksum is read, and the next one");
}

}  // namespace brainshift::fuzz
