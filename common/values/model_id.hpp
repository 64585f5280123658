// SPDX-License-Identifier: Apache-2.0
// Content hash of a BrainModel: 16 hexadecimal digits (FNV-1a, 64 bit) over case id, mesh, node
// sets, surfaces and pose, bit for bit. It detects a stale or foreign model. It is not a
// cryptographic signature.
#pragma once

#include <string>

#include "common/values/brain_model.hpp"

namespace brainshift {

// Ignores model.model_id itself.
std::string content_hash(const BrainModel& model);

}  // namespace brainshift
