// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/security/gate.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <bit>

#include "common/wire/convert.hpp"

namespace brainshift::server {
namespace {

using wire::MessageType;

struct Need {
  Role least = Role::kAdmin;
  const char* what = "make this request";
};

Need need_of(const wire::Frame& request) {
  switch (request.type) {
    case MessageType::kStatusRequest: return {Role::kViewer, "ask for the status"};
    case MessageType::kModelRequest: return {Role::kViewer, "ask for the model"};
    case MessageType::kReportRequest: return {Role::kViewer, "ask for a report"};
    case MessageType::kSubscribeRequest: return {Role::kViewer, "subscribe"};
    case MessageType::kObservation: return {Role::kSource, "hand in observations"};
    case MessageType::kStartSessionRequest: {
      // One that cannot be read is answered by the service, with the reason.
      const auto start = wire::decode_session_request(request.payload);
      if (start && start->takeover) return {Role::kAdmin, "take over a session"};
      return {Role::kOwner, "start a session"};
    }
    default: return {};
  }
}

}  // namespace

// A peer that repeats itself fills no log: the 1st, 2nd, 4th, 8th ... refusal of a kind is told.
tl::unexpected<Error> Gate::refuse(std::uint64_t& counter, ErrorCode code,
                                   const std::string& sentence) {
  if (std::has_single_bit(++counter)) {
    spdlog::warn("request refused code={} times={} reason=\"{}\"", to_string(code), counter,
                 sentence);
  }
  return fail(code, sentence);
}

Status Gate::enter(const std::string& caller, std::size_t connections) {
  if (!roles_ || connections < static_cast<std::size_t>(limits_.connections)) return {};
  return refuse(refusals_.connections, ErrorCode::kUnavailable,
                fmt::format("the key {} has {} connections already", caller, connections));
}

Status Gate::admit(const std::string& caller, const wire::Frame& request, TimePoint now) {
  if (roles_) {
    const auto found = roles_->find(caller);
    if (found == roles_->end()) {
      return refuse(refusals_.not_allowed, ErrorCode::kNotAllowed, "the connection has no key");
    }
    if (const Need need = need_of(request); !includes(found->second, need.least)) {
      return refuse(refusals_.not_allowed, ErrorCode::kNotAllowed,
                    fmt::format("the key {} has the role {}: to {} requires the role {}", caller,
                                to_string(found->second), need.what, to_string(need.least)));
    }
  }
  const bool observation = request.type == MessageType::kObservation;
  if (!observation && request.type != MessageType::kStartSessionRequest) return {};
  Allowance& left = allowances_.try_emplace(caller, limits_, now).first->second;
  if (observation && !left.observations.take(now)) {
    return refuse(
        refusals_.observations, ErrorCode::kUnavailable,
        fmt::format("more than {} observations a second: send fewer", limits_.observations_per_s));
  }
  if (!observation && !left.session_starts.take(now)) {
    return refuse(refusals_.session_starts, ErrorCode::kUnavailable,
                  fmt::format("more than {} session starts a minute: try again later",
                              limits_.session_starts_per_min));
  }
  return {};
}

void Gate::left(const std::string& caller) {
  if (!roles_) allowances_.erase(caller);
}

}  // namespace brainshift::server
