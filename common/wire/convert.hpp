// SPDX-License-Identifier: Apache-2.0
// Conversion between core values and encoded Protobuf payloads; the only code that knows both.
//
// encode_* returns the payload (without frame header). decode_* checks counts (multiples of 3, equal
// lengths, caps), finite numbers and index ranges, and fails with kProtocol or kNotFinite naming the field
// (an unknown method or boundary in a session request: kInvalidArgument). What a value means (frame, case,
// empty sets) is the session's business. Caps on fields, numbers and text: payload_scan.hpp; they hold
// before anything is allocated.
//
// decode(encode(x)) == x, except: the displacement field, its sd and contact forces travel as 32-bit floats;
// an update with an error carries no estimate; text that is not UTF-8 has the bad bytes replaced by '?'.
// Protobuf headers stay private to this folder.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/values/brain_model.hpp"
#include "common/core/error.hpp"
#include "common/values/estimate.hpp"
#include "common/values/observation.hpp"

namespace brainshift::wire {

// Caps on what a peer may send.
inline constexpr int kMaxPoints = 2'000'000;

struct DaemonStatus {
  std::string version;
  bool model_ready = false;
  std::string case_id;
  std::string model_id;
  bool busy = false;
  std::uint64_t updates = 0;
  std::uint64_t uptime_ms = 0;
};

struct SessionRequest {
  std::string case_id;
  Method method = Method::kCondensed;
  Boundary boundary = Boundary::kContact;
  bool publish_iterates = false;
  bool measure_full_solve = false;
};

struct SessionInfo {
  std::uint64_t session_id = 0;
  std::string model_id;
  int nodes = 0;
  int tets = 0;
  int slaves = 0;
  double prepare_s = 0.0;
  std::uint64_t model_bytes = 0;
  double full_solve_ms = 0.0;
  double factor_s = 0.0;
};

struct ObservationReceipt {
  std::uint64_t observation_sequence = 0;
  bool replaced_pending = false;
};

// An update as a client sees it: either an estimate, or the reason why there is none.
struct UpdateMessage {
  std::uint64_t session_id = 0;
  Update update;
  std::optional<Error> error;  // set when the observation could not be turned into an estimate
};

std::string encode(const DaemonStatus& status);
std::string encode(const SessionRequest& request);
std::string encode(const SessionInfo& info);
std::string encode(const BrainModel& model);
std::string encode(const Observation& observation);
std::string encode(const ObservationReceipt& receipt);
std::string encode(const UpdateMessage& message);
std::string encode(const Error& error);
std::string encode_subscribe_reply(std::uint64_t session_id);

Result<DaemonStatus> decode_status(std::string_view payload);
Result<SessionRequest> decode_session_request(std::string_view payload);
Result<SessionInfo> decode_session_info(std::string_view payload);
Result<BrainModel> decode_model(std::string_view payload);
Result<Observation> decode_observation(std::string_view payload);
Result<ObservationReceipt> decode_observation_receipt(std::string_view payload);
Result<UpdateMessage> decode_update(std::string_view payload);
Result<std::uint64_t> decode_subscribe_reply(std::string_view payload);
// The error carried by an ErrorReply; kProtocol when the payload itself is malformed.
Error decode_error(std::string_view payload);

}  // namespace brainshift::wire
