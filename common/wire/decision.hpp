// SPDX-License-Identifier: Apache-2.0
// Decision <-> its encoded Protobuf payload (brainshift/v1/decision.proto).
#pragma once

#include <string>
#include <string_view>

#include "common/core/error.hpp"
#include "common/values/decision.hpp"

namespace brainshift::wire {

std::string encode(const Decision& decision);
// kProtocol: malformed, an unknown outcome, or a count that does not fit.
Result<Decision> decode_decision(std::string_view payload);

}  // namespace brainshift::wire
