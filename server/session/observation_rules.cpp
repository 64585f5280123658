// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/session/observation_rules.hpp"

#include <fmt/format.h>

namespace brainshift::server {
namespace {

constexpr std::size_t kMaxSourceLength = 64;
constexpr std::size_t kMaxQuoted = 64;

}  // namespace

Status check_observation(const Observation& observation, std::string_view case_id,
                         const SessionKey& running) {
  if (observation.case_id != case_id) {
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("observation.case_id = {}: the running session is for {}",
                            in_quotes(observation.case_id), in_quotes(case_id)));
  }
  if (const SessionKey& given = observation.session; given != running) {
    if (given == SessionKey{}) {
      return fail(ErrorCode::kInvalidArgument,
                  "observation.session is absent: must name the session that it is for");
    }
    if (given.boot_id != running.boot_id) {
      return fail(ErrorCode::kInvalidArgument,
                  fmt::format("observation.session.boot_id = {:x}: the daemon has been restarted, "
                              "or this is another one ({:x})",
                              given.boot_id, running.boot_id));
    }
    if (given.model_id != running.model_id) {
      return fail(ErrorCode::kInvalidArgument,
                  fmt::format("observation.session.model_id = {}: the daemon serves model {}",
                              in_quotes(given.model_id), in_quotes(running.model_id)));
    }
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("observation.session.session_id = {}: the running session is {}",
                            given.session_id, running.session_id));
  }
  if (observation.frame != "ras") {
    return fail(ErrorCode::kInvalidArgument, fmt::format("observation.frame = {}: must be \"ras\"",
                                                         in_quotes(observation.frame)));
  }
  if (observation.source.empty() || observation.source.size() > kMaxSourceLength) {
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("observation.source = {}: must have 1 to {} characters",
                            in_quotes(observation.source), kMaxSourceLength));
  }
  if (std::holds_alternative<PatientPose>(observation.body)) {
    return fail(ErrorCode::kInvalidArgument,
                "observation.patient_pose: a change of pose is not assimilated in this version; "
                "start a session on a model prepared for the new pose");
  }
  return {};
}

std::string in_quotes(std::string_view text) {
  std::string result = "\"";
  for (const char c : text.substr(0, kMaxQuoted)) {
    const auto byte = static_cast<unsigned char>(c);
    result += (byte < 0x20 || byte == 0x7f) ? '?' : c;
  }
  result += text.size() > kMaxQuoted ? "...\"" : "\"";
  return result;
}

}  // namespace brainshift::server
