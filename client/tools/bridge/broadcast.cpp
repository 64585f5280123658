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

const char* device_name(Shape shape) {
  switch (shape) {
    case Shape::kTumour: return "brainshift_tumour";
    case Shape::kCortex: return "brainshift_cortex";
    case Shape::kVentricles: return "brainshift_ventricles";
    case Shape::kSepta: return "brainshift_septa";
  }
  return "";
}

}  // namespace

Broadcast::Broadcast(PicturePtr picture, Part part, std::uint32_t message_id)
    : picture_(std::move(picture)), part_(part), message_id_(message_id) {
  shown_ = {Device::kStatus, Device::kState};
  if (whole() && picture_->rest) {
    shown_.push_back(Device::kField);
    if (picture_->rest->with_sd) shown_.insert(shown_.end(), {Device::kSd, Device::kKnown});
    for (const Shape shape : kShapes) {
      if (picture_->rest->surfaces[shape]) shown_.push_back(shape);
    }
  }
  for (auto& each : encoded_) each.resize(shown_.size());
}

const std::string& Broadcast::bytes(std::size_t i, std::uint16_t version) {
  std::string& bytes = encoded_[version >= 2 ? 1 : 0][i];
  if (bytes.empty()) {
    if (auto ok = encode(shown_[i], version >= 2 ? 2 : 1, bytes); !ok) {
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

Status Broadcast::encode(Shown shown, std::uint16_t version, std::string& out) const {
  igtl::Envelope envelope;
  envelope.version = version;
  envelope.timestamp = picture_->time;
  envelope.message_id = message_id_;
  if (version >= 2) envelope.metadata = to_metadata(picture_->state);
  const auto& rest = picture_->rest;
  if (const Shape* shape = std::get_if<Shape>(&shown)) {
    envelope.device = device_name(*shape);
    const auto& deformed = picture_->surfaces[*shape];
    return igtl::encode(envelope, deformed ? *deformed : *rest->surfaces[*shape], out);
  }
  switch (std::get<Device>(shown)) {
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
  }
  return fail(ErrorCode::kInternal, "no such device");
}

}  // namespace brainshift::client
