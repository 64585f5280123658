// SPDX-License-Identifier: Apache-2.0
#include "common/igtl/stream_reader.hpp"

#include <algorithm>
#include <utility>

#include "common/igtl/crc64.hpp"
#include "common/igtl/message.hpp"

namespace brainshift::igtl {

std::uint64_t StreamLimits::limit_of(std::string_view type) const {
  const bool large = type == Image::kType || type == PolyData::kType || type == PointList::kType;
  return large ? body_bytes : small_body_bytes;
}

bool StreamLimits::is_wanted(std::string_view type) const {
  return is_known_type(type) && (wanted.empty() || wanted.find(type) != wanted.end());
}

StreamReader::StreamReader(StreamLimits limits) : limits_(std::move(limits)) {}

Result<std::optional<Packet>> StreamReader::read(std::string_view& bytes) {
  if (broken_) return tl::unexpected<Error>(*broken_);
  if (!packet_) {
    const std::size_t taken = std::min(kHeaderBytes - header_bytes_.size(), bytes.size());
    header_bytes_.append(bytes.substr(0, taken));
    bytes.remove_prefix(taken);
    if (header_bytes_.size() < kHeaderBytes) return std::optional<Packet>();
    if (const Status status = begin_body(); !status) return give_up(status.error());
  }
  take_body(bytes);
  if (received_ < packet_->header.body_bytes) return std::optional<Packet>();
  if (const Status status = check_crc(packet_->header, crc_); !status) {
    return give_up(status.error());
  }
  return std::exchange(packet_, std::nullopt);
}

Status StreamReader::begin_body() {
  auto header = decode_header(header_bytes_);
  header_bytes_.clear();
  if (!header) return tl::unexpected<Error>(std::move(header.error()));
  const bool skipped = !limits_.is_wanted(header->type);
  const std::uint64_t limit = skipped ? limits_.skipped_bytes : limits_.limit_of(header->type);
  if (header->body_bytes > limit) {
    return fail(ErrorCode::kProtocol, header->type + " of \"" + header->device + "\": body of " +
                                          std::to_string(header->body_bytes) +
                                          " bytes, must be at most " + std::to_string(limit));
  }
  packet_ = Packet{std::move(*header), skipped, {}};
  received_ = 0;
  crc_ = 0;
  return {};
}

void StreamReader::take_body(std::string_view& bytes) {
  const std::uint64_t left = packet_->header.body_bytes - received_;
  const std::string_view taken = bytes.substr(0, std::min<std::uint64_t>(left, bytes.size()));
  bytes.remove_prefix(taken.size());
  received_ += taken.size();
  crc_ = continue_crc64(crc_, taken);
  if (!packet_->skipped) packet_->body.append(taken);
}

tl::unexpected<Error> StreamReader::give_up(const Error& error) {
  broken_ = error;
  header_bytes_.clear();
  packet_.reset();
  return tl::unexpected<Error>(error);
}

std::size_t StreamReader::held_bytes() const {
  return header_bytes_.size() + (packet_ ? packet_->body.capacity() : 0);
}

}  // namespace brainshift::igtl
