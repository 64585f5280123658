// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "brainshift/v1/brainshift.pb.h"
#include "brainshift/v1/decision.pb.h"
#include "common/core/text.hpp"
#include "common/wire/checked_values.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/convert_parts.hpp"
#include "common/wire/names.hpp"
#include "common/wire/payload_scan.hpp"

namespace brainshift::wire {

std::string encode(const DaemonStatus& status) {
  pb::StatusReply message;
  message.set_version(to_utf8(status.version));
  message.set_model_ready(status.model_ready);
  message.set_case_id(to_utf8(status.case_id));
  message.set_model_id(to_utf8(status.model_id));
  message.set_busy(status.busy);
  message.set_updates(status.updates);
  message.set_uptime_ms(status.uptime_ms);
  message.set_build(to_utf8(status.build));
  message.set_machine(to_utf8(status.machine));
  message.set_blas_kernel(to_utf8(status.blas_kernel));
  return message.SerializeAsString();
}

Result<DaemonStatus> decode_status(std::string_view payload) {
  pb::StatusReply message;
  if (Status status = parse(payload, message); !status) return tl::unexpected(status.error());
  return DaemonStatus{message.version(),    message.model_ready(), message.case_id(),
                      message.model_id(),   message.busy(),        message.updates(),
                      message.uptime_ms(),  message.build(),       message.machine(),
                      message.blas_kernel()};
}

std::string encode(const SessionRequest& request) {
  pb::StartSessionRequest message;
  message.set_case_id(to_utf8(request.case_id));
  message.set_method(std::string(to_string(request.method)));
  message.set_boundary(std::string(to_string(request.boundary)));
  message.set_publish_iterates(request.publish_iterates);
  message.set_takeover(request.takeover);
  message.set_recorded_clock(request.recorded_clock);
  return message.SerializeAsString();
}

Result<SessionRequest> decode_session_request(std::string_view payload) {
  pb::StartSessionRequest message;
  if (Status status = parse(payload, message); !status) return tl::unexpected(status.error());
  const auto method = method_from(message.method());
  if (!method) {
    std::string names;
    for (const Method known : kAllMethods) names += ' ' + std::string(to_string(known));
    return invalid("start_session.method = " + in_quotes(message.method()) + ": must be one of" +
                   names);
  }
  const auto boundary = boundary_from(message.boundary());
  if (!boundary) {
    return invalid("start_session.boundary = " + in_quotes(message.boundary()) +
                   ": must be \"contact\" or \"fixed\"");
  }
  return SessionRequest{message.case_id(),  *method,
                        *boundary,          message.publish_iterates(),
                        message.takeover(), message.recorded_clock()};
}

std::string encode(const SessionInfo& info) {
  pb::StartSessionReply message;
  message.set_session_id(info.session_id);
  message.set_model_id(to_utf8(info.model_id));
  message.set_nodes(static_cast<std::uint32_t>(info.nodes));
  message.set_tets(static_cast<std::uint32_t>(info.tets));
  message.set_slaves(static_cast<std::uint32_t>(info.slaves));
  message.set_prepare_s(info.prepare_s);
  message.set_model_bytes(info.model_bytes);
  message.set_boot_id(info.boot_id);
  return message.SerializeAsString();
}

Result<SessionInfo> decode_session_info(std::string_view payload) {
  pb::StartSessionReply message;
  if (Status status = parse(payload, message); !status) return tl::unexpected(status.error());
  Checked checked;
  SessionInfo info;
  info.session_id = message.session_id();
  info.model_id = message.model_id();
  info.nodes = checked.count(message.nodes(), "session.nodes");
  info.tets = checked.count(message.tets(), "session.tets");
  info.slaves = checked.count(message.slaves(), "session.slaves");
  info.prepare_s = checked.non_negative(message.prepare_s(), "session.prepare_s");
  info.model_bytes = message.model_bytes();
  info.boot_id = message.boot_id();
  if (!checked.ok()) return tl::unexpected(checked.status().error());
  return info;
}

std::string encode(const ObservationReceipt& receipt) {
  pb::ObservationReply message;
  message.set_observation_sequence(receipt.observation_sequence);
  message.set_replaced_pending(receipt.replaced_pending);
  return message.SerializeAsString();
}

Result<ObservationReceipt> decode_observation_receipt(std::string_view payload) {
  pb::ObservationReply message;
  if (Status status = parse(payload, message); !status) return tl::unexpected(status.error());
  return ObservationReceipt{message.observation_sequence(), message.replaced_pending()};
}

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

std::string encode(const Subscription& subscription) {
  pb::SubscribeRequest message;
  message.set_subscription(subscription.id);
  message.set_window(subscription.window);
  message.set_received(subscription.received);
  if (subscription.choice != FieldChoice{}) {
    set_choice(subscription.choice, *message.mutable_choice());
  }
  return message.SerializeAsString();
}

Result<Subscription> decode_subscription(std::string_view payload) {
  pb::SubscribeRequest message;
  if (Status status = parse(payload, message); !status) return tl::unexpected(status.error());
  Checked checked;
  if (!checked.require(message.window() <= Subscription::kMaxWindow, "subscribe.window",
                       std::to_string(message.window()) + ", must be at most " +
                           std::to_string(Subscription::kMaxWindow))) {
    return tl::unexpected(checked.status().error());
  }
  return get_choice(message.choice()).map([&](const FieldChoice& choice) {
    return Subscription{message.subscription(), std::max(message.window(), 1u), message.received(),
                        choice};
  });
}

std::string encode(const SessionState& state) {
  pb::SessionState message;
  set(state.session, message.mutable_session());
  message.set_phase(static_cast<pb::SessionPhase>(static_cast<int>(state.phase) + 1));
  message.set_newest_update(state.newest_update);
  message.set_newest_usable(state.newest_usable);
  message.set_age_ms(state.age_ms);
  message.set_valid_ms(state.valid_ms);
  message.set_reason(to_utf8(state.reason));
  message.set_preparing(state.preparing);
  message.set_aged_after_ms(state.aged_after_ms);
  message.set_expired_after_ms(state.expired_after_ms);
  message.set_recorded(state.recorded);
  message.set_method(to_utf8(state.method));
  message.set_boundary(to_utf8(state.boundary));
  if (state.recording) {
    auto* recording = message.mutable_recording();
    recording->set_recording(state.recording->recording);
    recording->set_reason(to_utf8(state.recording->reason));
    for (const RecordedSource& source : state.recording->sources) {
      auto* entry = recording->add_sources();
      entry->set_source(to_utf8(source.source));
      entry->set_until(source.until);
      entry->set_lost_until(source.lost_until);
    }
  }
  return message.SerializeAsString();
}

Result<SessionState> decode_session_state(std::string_view payload) {
  pb::SessionState message;
  if (Status status = parse(payload, message); !status) return tl::unexpected(status.error());
  Checked checked;
  checked.require(
      message.phase() >= pb::SESSION_PHASE_EMPTY && message.phase() <= pb::SESSION_PHASE_CLOSED,
      "session_state.phase", std::to_string(message.phase()) + " is unknown");
  checked.require(message.newest_usable() <= message.newest_update(), "session_state.newest_usable",
                  "is above newest_update");
  checked.require(message.valid_ms() <= SessionState::kMaxValidity_ms, "session_state.valid_ms",
                  std::to_string(message.valid_ms()) + ", must be at most " +
                      std::to_string(SessionState::kMaxValidity_ms));
  SessionState state;
  state.session = session_key_from(message.session());
  state.phase = static_cast<SessionPhase>(static_cast<int>(message.phase()) - 1);
  state.newest_update = message.newest_update();
  state.newest_usable = message.newest_usable();
  state.age_ms = checked.non_negative(message.age_ms(), "session_state.age_ms");
  state.valid_ms = message.valid_ms();
  state.reason = one_line(message.reason());
  state.preparing = message.preparing();
  state.aged_after_ms = message.aged_after_ms();
  state.expired_after_ms = message.expired_after_ms();
  state.recorded = message.recorded();
  state.method = one_line(message.method());
  state.boundary = one_line(message.boundary());
  if (message.has_recording()) {
    state.recording.emplace();
    state.recording->recording = message.recording().recording();
    state.recording->reason = one_line(message.recording().reason());
    for (const auto& entry : message.recording().sources()) {
      state.recording->sources.push_back({entry.source(), entry.until(), entry.lost_until()});
    }
  }
  if (!checked.ok()) return tl::unexpected(checked.status().error());
  return state;
}

Status decode_empty(std::string_view payload, std::string_view name) {
  if (payload.empty()) return {};
  return fail(ErrorCode::kProtocol, std::string(name) + ": carries " +
                                        std::to_string(payload.size()) + " bytes, must be empty");
}

std::string encode(const Error& error) {
  pb::ErrorReply message;
  message.set_code(std::string(to_string(error.code)));
  message.set_message(to_utf8(error.message));
  return message.SerializeAsString();
}

Error decode_error(std::string_view payload) {
  pb::ErrorReply message;
  if (Status status = parse(payload, message); !status) return status.error();
  return make_error(message.code(), message.message());
}

Error make_error(std::string_view code, std::string_view message) {
  if (const auto known = error_code_from(code)) return {*known, one_line(message)};
  return {ErrorCode::kInternal, one_line(code) + ": " + one_line(message)};
}

}  // namespace brainshift::wire
