// SPDX-License-Identifier: GPL-3.0-or-later
// Which observations a session accepts. Pure.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/core/error.hpp"
#include "common/values/observation.hpp"

namespace brainshift::server {

// Ok, or kInvalidArgument for another case, session, model or daemon than `running`, a frame other
// than "ras", an empty or overlong source, or a body that no update uses (PatientPose). The
// sentence names the field and its value. The numbers of the body are not looked at:
// wire::decode_observation has tested that they are finite and that standard deviations are not
// negative.
Status check_observation(const Observation& observation, std::string_view case_id,
                         const SessionKey& running);

// The text in quotes, at most 64 characters of it, control characters replaced by '?': safe in a
// one-line message whatever a peer sent.
std::string in_quotes(std::string_view text);

}  // namespace brainshift::server
