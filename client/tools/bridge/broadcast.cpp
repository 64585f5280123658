// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/bridge/broadcast.hpp"

#include <span>
#include <utility>

#include "common/igtl/message.hpp"

namespace brainshift::client {
namespace {

Status encode_volume(const igtl::Envelope& envelope, const igtl::ImageGeometry& geometry,
                     int components, const std::vector<float>& voxels, std::string& out) {
  std::vector<float> zeros;
  if (voxels.empty()) zeros.resize(static_cast<std::size_t>(components) * geometry.num_voxels());
  igtl::ImageView view;
  view.geometry = geometry;
  view.components = components;
  view.voxels = std::span<const float>(voxels.empty() ? zeros : voxels);
  return igtl::encode(envelope, view, out);
}

}  // namespace

Broadcast::Broadcast(PicturePtr picture, Part part, std::uint32_t message_id)
    : picture_(std::move(picture)), part_(part), message_id_(message_id) {
  devices_ = {Device::kStatus, Device::kState};
  if (whole() && picture_->rest) {
    devices_.push_back(Device::kField);
    if (picture_->rest->with_sd) devices_.insert(devices_.end(), {Device::kSd, Device::kKnown});
    if (picture_->rest->tumour) devices_.push_back(Device::kTumour);
    if (picture_->rest->cortex) devices_.push_back(Device::kCortex);
  }
  for (auto& each : encoded_) each.resize(devices_.size());
}

const std::string& Broadcast::bytes(std::size_t i, std::uint16_t version) {
  std::string& bytes = encoded_[version >= 2 ? 1 : 0][i];
  if (bytes.empty()) {
    if (auto ok = encode(devices_[i], version >= 2 ? 2 : 1, bytes); !ok) {
      error_ = ok.error().message;
    }
  }
  return bytes;
}

std::size_t Broadcast::held_bytes() const {
  std::size_t sum = 0;
  for (const auto& version : encoded_) {
    for (const std::string& bytes : version) sum += bytes.capacity();
  }
  return sum;
}

Status Broadcast::encode(Device device, std::uint16_t version, std::string& out) const {
  igtl::Envelope envelope;
  envelope.version = version;
  envelope.timestamp = picture_->time;
  envelope.message_id = message_id_;
  if (version >= 2) envelope.metadata = to_metadata(picture_->state);
  const auto& rest = picture_->rest;
  switch (device) {
    case Device::kStatus:
      envelope.device = "brainshift";
      return igtl::encode(envelope, to_status(picture_->state), out);
    case Device::kState:
      envelope.device = "brainshift_state";
      return igtl::encode(envelope, igtl::Text{to_json(picture_->state), igtl::kUtf8}, out);
    case Device::kField:
      envelope.device = "brainshift_u";
      return encode_volume(envelope, rest->geometry, 3, picture_->u, out);
    case Device::kSd:
      envelope.device = "brainshift_sd";
      return encode_volume(envelope, rest->geometry, 1, picture_->sd, out);
    case Device::kKnown:
      envelope.device = "brainshift_known";
      return encode_volume(envelope, rest->geometry, 1, picture_->known, out);
    case Device::kTumour:
      envelope.device = "brainshift_tumour";
      return igtl::encode(envelope, picture_->tumour ? *picture_->tumour : *rest->tumour, out);
    case Device::kCortex:
      envelope.device = "brainshift_cortex";
      return igtl::encode(envelope, picture_->cortex ? *picture_->cortex : *rest->cortex, out);
  }
  return fail(ErrorCode::kInternal, "no such device");
}

}  // namespace brainshift::client
