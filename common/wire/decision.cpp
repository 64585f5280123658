// SPDX-License-Identifier: Apache-2.0
#include "common/wire/decision.hpp"

#include "brainshift/v1/decision.pb.h"
#include "common/wire/checked_values.hpp"
#include "common/wire/names.hpp"
#include "common/wire/payload_scan.hpp"
#include "common/wire/text.hpp"

namespace brainshift::wire {

std::string encode(const Decision& decision) {
  pb::Decision message;
  message.set_session_id(decision.session_id);
  message.set_source(to_utf8(decision.source));
  message.set_observation_sequence(decision.observation_sequence);
  message.set_outcome(std::string(to_string(decision.outcome)));
  message.set_update_sequence(decision.update_sequence);
  message.set_active(static_cast<std::uint32_t>(decision.active));
  message.set_reason(to_utf8(decision.reason));
  return message.SerializeAsString();
}

Result<Decision> decode_decision(std::string_view payload) {
  pb::Decision message;
  if (Status status = parse(payload, message); !status) return tl::unexpected(status.error());
  Checked checked;
  const auto outcome = from_name(message.outcome(), Outcome::kUsed, Outcome::kSkipped);
  checked.require(outcome.has_value(), "decision.outcome",
                  in_quotes(message.outcome()) + " is unknown");
  const int active = checked.count(message.active(), "decision.active");
  if (!checked.ok()) return tl::unexpected(checked.status().error());
  return Decision{
      message.session_id(),      message.source(), message.observation_sequence(), *outcome,
      message.update_sequence(), active,           one_line(message.reason())};
}

}  // namespace brainshift::wire
