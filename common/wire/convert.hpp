// SPDX-License-Identifier: Apache-2.0
// Core values <-> encoded Protobuf payloads. No other code knows both.
//
// encode() returns the payload without the frame header. decode_*() checks counts (multiples of 3,
// equal lengths, caps), finite numbers and index ranges. Its errors name the field:
//   kProtocol         malformed payload, a count, index or sign that is wrong
//   kNotFinite        a number that is not finite
//   kInvalidArgument  an unknown method or boundary in a session request
// The caps of payload_scan.hpp on fields, numbers and text hold before anything is allocated.
// The session checks what a value means: frame, case, empty sets.
//
// decode(encode(x)) == x, except that
//   - the displacement field, its sd and the contact forces travel as 32-bit floats;
//   - an update with an error carries no estimate;
//   - an estimate with the flag not_finite travels without its numbers: status, reason and verdict;
//   - BrainModel::tumour_distance and Estimate::rebuild_ms do not travel;
//   - in text that is not UTF-8, '?' replaces every bad byte.
// Protobuf headers stay private to this folder.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/core/error.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/decision.hpp"
#include "common/values/estimate.hpp"
#include "common/values/observation.hpp"
#include "common/values/session.hpp"
#include "common/values/session_state.hpp"

namespace brainshift::wire {

// Most points, and most numbers of one field of floats, that a peer may send.
inline constexpr int kMaxPoints = 2'000'000;
// Most hypotheses of an update.
inline constexpr int kMaxHypotheses = 4096;

std::string encode(const DaemonStatus& status);
std::string encode(const SessionRequest& request);
std::string encode(const SessionInfo& info);
std::string encode(const BrainModel& model);
std::string encode(const Observation& observation);
std::string encode(const ObservationReceipt& receipt);
std::string encode(const Decision& decision);
std::string encode(const UpdateMessage& message);
// The same in two steps, for an update that is to carry the time of its own encoding: the payload
// without timings and answer_time, and these behind it. The result decodes like that of encode();
// Protobuf does not prescribe the order of fields.
std::string encode_without_timings(const UpdateMessage& message);
void append_timings(const Update& update, std::string& payload);
std::string encode(const Error& error);
std::string encode(const Subscription& subscription);
std::string encode(const SessionState& state);
// Adds daemon_ns (Observation) to an observation's payload that has none, without decoding it.
void append_daemon_time(std::int64_t daemon_ns, std::string& payload);

Result<DaemonStatus> decode_status(std::string_view payload);
Result<SessionRequest> decode_session_request(std::string_view payload);
Result<SessionInfo> decode_session_info(std::string_view payload);
Result<BrainModel> decode_model(std::string_view payload);
Result<Observation> decode_observation(std::string_view payload);
Result<ObservationReceipt> decode_observation_receipt(std::string_view payload);
Result<Decision> decode_decision(std::string_view payload);
Result<UpdateMessage> decode_update(std::string_view payload);
Result<Subscription> decode_subscription(std::string_view payload);
Result<SessionState> decode_session_state(std::string_view payload);
// Requests that carry nothing: kProtocol unless the payload is empty. `name` of the message.
Status decode_empty(std::string_view payload, std::string_view name);
// The error carried by an ErrorReply; kProtocol when the payload itself is malformed.
Error decode_error(std::string_view payload);

}  // namespace brainshift::wire
