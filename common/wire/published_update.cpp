// SPDX-License-Identifier: Apache-2.0
#include "common/wire/published_update.hpp"

#include <cassert>

#include "brainshift/v1/brainshift.pb.h"
#include "common/wire/convert_parts.hpp"
#include "common/wire/payload_scan.hpp"

namespace brainshift::wire {

Result<PublishedUpdate> PublishedUpdate::open(std::string_view payload) {
  pb::Update message;
  if (Status status = parse(payload, message); !status) return tl::unexpected(status.error());
  const auto& xyz = message.displacement().xyz_mm();
  const auto& sd = message.sd_mm();
  if (message.has_part()) {
    return fail(ErrorCode::kProtocol, "update.part: is present, the whole field is needed");
  }
  const auto known = static_cast<int>(message.known().size());
  const auto fits = [&](int count) { return count == 0 || count == xyz.size() / 3; };
  if (xyz.size() % 3 != 0 || !fits(sd.size()) || !fits(known)) {
    return fail(ErrorCode::kProtocol, "update: " + std::to_string(xyz.size()) +
                                          " displacement components, " + std::to_string(sd.size()) +
                                          " standard deviations, " + std::to_string(known) +
                                          " bytes of what is known");
  }
  PublishedUpdate update;
  update.session_ = {message.boot_id(), message.session_id(), message.model_id()};
  update.sequence_ = message.sequence();
  update.usable_ = message.final() && (message.quality() == pb::QUALITY_GOOD ||
                                       message.quality() == pb::QUALITY_CAUTION);
  update.xyz_mm_.assign(xyz.begin(), xyz.end());
  update.sd_mm_.assign(sd.begin(), sd.end());
  update.known_ = message.known();
  message.clear_known();
  message.clear_displacement();
  message.clear_sd_mm();
  update.rest_ = message.SerializeAsString();
  return update;
}

std::string PublishedUpdate::cut(const std::optional<FieldPart>& part, bool sd) const {
  const bool with_sd = sd && !sd_mm_.empty();
  const bool with_known = sd && !known_.empty();
  pb::Update field;
  auto* xyz = field.mutable_displacement()->mutable_xyz_mm();
  if (!part) {
    xyz->Add(xyz_mm_.begin(), xyz_mm_.end());
    if (with_sd) field.mutable_sd_mm()->Add(sd_mm_.begin(), sd_mm_.end());
    if (with_known) field.set_known(known_);
  } else {
    assert(part->mesh_nodes == nodes());
    set_part(*part, *field.mutable_part());
    const int count = static_cast<int>(part->nodes.size());
    xyz->Resize(3 * count, 0.0f);
    if (with_sd) field.mutable_sd_mm()->Resize(count, 0.0f);
    float* to = xyz->mutable_data();
    for (int i = 0; i < count; ++i) {
      const auto node = static_cast<std::size_t>(part->nodes[static_cast<std::size_t>(i)]);
      for (std::size_t axis = 0; axis < 3; ++axis) *to++ = xyz_mm_[3 * node + axis];
      if (with_sd) field.set_sd_mm(i, sd_mm_[node]);
      if (with_known) field.mutable_known()->push_back(known_[node]);
    }
  }
  std::string payload;
  payload.reserve(rest_.size() + field.ByteSizeLong());
  payload = rest_;
  field.AppendToString(&payload);
  return payload;
}

}  // namespace brainshift::wire
