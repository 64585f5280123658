// SPDX-License-Identifier: GPL-3.0-or-later
// Updates of a few nodes, as frames, for tests of what viewers get.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>

#include "common/wire/convert.hpp"
#include "common/wire/frame.hpp"
#include "server/delivery/parcels.hpp"
#include "tests/support/results.hpp"

namespace brainshift::server {

// Of session 1: every node moves by (1, 2, 3) mm, its standard deviation is 0.5 mm, all of
// it is known.
inline UpdateMessage usable(std::uint64_t sequence, int nodes) {
  UpdateMessage message;
  message.session_id = 1;
  message.boot_id = 7;
  message.update.model_id = "model";
  message.update.sequence = sequence;
  message.update.estimate.status = EstimateStatus::kConverged;
  message.update.estimate.quality.quality = Quality::kGood;
  message.update.estimate.displacement = Vec3(1, 2, 3).replicate(1, nodes);
  message.update.estimate.sd_mm = VecX::Constant(nodes, 0.5);
  message.update.estimate.known = VecX::Ones(nodes);
  return message;
}

inline UpdateMessage failure(std::uint64_t sequence) {
  UpdateMessage message = usable(sequence, 0);
  message.update.estimate = {};
  message.error = Error{ErrorCode::kEmptySet, "no point is inside the brain"};
  return message;
}

inline Bytes frame_of(const UpdateMessage& message) {
  return std::make_shared<const std::string>(
      wire::encode_frame(wire::MessageType::kUpdate, 0, wire::encode(message)));
}

inline UpdateMessage decoded(const Bytes& bytes) {
  const auto frame = value_or_fail(wire::decode_frame(*bytes));
  return value_or_fail(wire::decode_update(frame.payload));
}

}  // namespace brainshift::server
