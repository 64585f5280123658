// SPDX-License-Identifier: GPL-3.0-or-later
// Which observations a session accepts. Pure.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/core/error.hpp"
#include "common/values/observation.hpp"

namespace brainshift::server {

// The journal keeps sequence numbers as signed 64-bit integers.
inline constexpr std::uint64_t kMaxSequence = (std::uint64_t{1} << 63) - 1;

// Ok, or kInvalidArgument for another case, session, model or daemon than `running`, a frame other
// than "ras", an empty or overlong source, or a body that no update uses (PatientPose). The
// sentence names the field and its value. The numbers of the body are not looked at:
// wire::decode_observation has tested that they are finite and that standard deviations are not
// negative.
Status check_observation(const Observation& observation, std::string_view case_id,
                         const SessionKey& running);

// Ok, or kInvalidArgument for a sequence number that is not above `last_sequence`, the last one of
// this source, or above kMaxSequence.
Status check_sequence(const Observation& observation, std::uint64_t last_sequence);

// The text in quotes, at most 64 characters of it, control characters replaced by '?': safe in a
// one-line message whatever a peer sent.
std::string in_quotes(std::string_view text);

}  // namespace brainshift::server
