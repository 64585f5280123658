// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "brainshift/v1/brainshift.pb.h"
#include "common/core/text.hpp"
#include "common/wire/checked_values.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/convert_parts.hpp"
#include "common/wire/names.hpp"
#include "common/wire/payload_scan.hpp"

namespace brainshift::wire {
namespace {

constexpr std::string_view kFailed = "failed";

std::uint32_t unsigned_count(int count) { return static_cast<std::uint32_t>(std::max(count, 0)); }

void set_contact(const Estimate& estimate, pb::Contact* out) {
  out->set_active(unsigned_count(estimate.contact.active));
  out->set_penetrating(unsigned_count(estimate.contact.penetrating));
  out->set_max_penetration_mm(estimate.contact.max_penetration_mm);
  out->set_iterations(unsigned_count(estimate.contact.iterations));
  set(estimate.active_slaves, out->mutable_active_slaves());
  set(estimate.contact_force_n, out->mutable_force_n());
  if (!std::isnan(estimate.contact.decrement)) out->set_decrement(estimate.contact.decrement);
  if (!std::isnan(estimate.contact.max_violation_mm)) {
    out->set_max_violation_mm(estimate.contact.max_violation_mm);
  }
}

void set_iteration(const IterationRecord& record, pb::Iteration* out) {
  out->set_iteration(unsigned_count(record.iteration));
  set(record.misfit_mm, out->mutable_misfit());
  out->set_penetrating(unsigned_count(record.penetrating));
  out->set_max_penetration_mm(record.max_penetration_mm);
  out->set_elapsed_ms(record.elapsed_ms);
}

void set_timings(const StageTimings& timings, pb::StageTimings* out) {
  out->set_register_ms(timings.register_ms);
  out->set_invert_ms(timings.invert_ms);
  out->set_rebuild_ms(timings.rebuild_ms);
  out->set_encode_ms(timings.encode_ms);
  out->set_journal_ms(timings.journal_ms);
}

void set_answer_time(const AnswerTime& time, pb::Update& out) {
  if (time.ms == 0.0) return;
  out.mutable_answer_time()->set_ms(time.ms);
  out.mutable_answer_time()->set_usual_ms(time.usual_ms);
  out.mutable_answer_time()->set_late(time.late());
  out.mutable_answer_time()->set_age_ms(time.age_ms);
}

void set_source(const SourceSummary& source, pb::SourceSummary* out) {
  out->set_source(to_utf8(source.source));
  out->set_observation_sequence(source.observation_sequence);
  out->set_age_s(source.age_s);
  out->set_data(unsigned_count(source.data));
  out->set_outliers(unsigned_count(source.outliers));
  if (!std::isnan(source.p_value)) {
    out->set_chi_square(source.chi_square);
    out->set_degrees_of_freedom(source.degrees_of_freedom);
    out->set_p_value(source.p_value);
  }
  out->set_consistent(source.consistent);
}

void set_estimate(const Estimate& estimate, pb::Update& out) {
  out.set_status(std::string(to_string(estimate.status)));
  out.set_reason(to_utf8(estimate.reason));
  set_verdict(estimate.quality, out);
  // The receiver rejects numbers that are not finite, and with them would reject the verdict.
  if (estimate.quality.flags.has(QualityFlag::kNotFinite)) return;
  set(estimate.displacement, out.mutable_displacement()->mutable_xyz_mm());
  set(estimate.sd_mm, out.mutable_sd_mm());
  out.set_known(to_bytes(estimate.known));
  if (!std::isnan(estimate.region_known)) out.set_region_known(estimate.region_known);
  if (!std::isnan(estimate.ventricle_change_mm3)) {
    out.set_ventricle_change_mm3(estimate.ventricle_change_mm3);
  }
  set_contact(estimate, out.mutable_contact());
  set(estimate.initial_misfit_mm, out.mutable_initial_misfit());
  set(estimate.misfit_mm, out.mutable_misfit());
  for (const auto& record : estimate.history) set_iteration(record, out.add_history());
  for (const auto& source : estimate.sources) set_source(source, out.add_sources());
  set_prior(estimate, out);
  if (!std::isnan(estimate.min_volume_ratio)) out.set_min_volume_ratio(estimate.min_volume_ratio);
  out.set_inverted_elements(unsigned_count(estimate.inverted_elements));
  if (!std::isnan(estimate.misfit_ratio)) out.set_misfit_ratio(estimate.misfit_ratio);
  out.set_data_outside_region(unsigned_count(estimate.data_outside_region));
}

StageTimings get_timings(const pb::StageTimings& message, Checked& checked) {
  return {checked.non_negative(message.register_ms(), "update.timings.register_ms"),
          checked.non_negative(message.invert_ms(), "update.timings.invert_ms"),
          checked.non_negative(message.rebuild_ms(), "update.timings.rebuild_ms"),
          checked.non_negative(message.encode_ms(), "update.timings.encode_ms"),
          checked.non_negative(message.journal_ms(), "update.timings.journal_ms")};
}

AnswerTime get_answer_time(const pb::AnswerTime& message, Checked& checked) {
  const AnswerTime time{checked.non_negative(message.ms(), "update.answer_time.ms"),
                        checked.non_negative(message.usual_ms(), "update.answer_time.usual_ms"),
                        checked.non_negative(message.age_ms(), "update.answer_time.age_ms")};
  checked.require(message.late() == time.late(), "update.answer_time.late",
                  "does not follow from ms and usual_ms");
  return time;
}

IterationRecord get_iteration(const pb::Iteration& message, Checked& checked) {
  IterationRecord record;
  record.iteration = checked.count(message.iteration(), "update.history.iteration");
  record.misfit_mm = checked.mean_std(message.misfit(), "update.history.misfit");
  record.penetrating = checked.count(message.penetrating(), "update.history.penetrating");
  record.max_penetration_mm =
      checked.number(message.max_penetration_mm(), "update.history.max_penetration_mm");
  record.elapsed_ms = checked.non_negative(message.elapsed_ms(), "update.history.elapsed_ms");
  return record;
}

void get_contact(const pb::Contact& message, int nodes, Estimate& estimate, Checked& checked) {
  estimate.contact.active = checked.count(message.active(), "update.contact.active");
  estimate.contact.penetrating = checked.count(message.penetrating(), "update.contact.penetrating");
  estimate.contact.max_penetration_mm =
      checked.number(message.max_penetration_mm(), "update.contact.max_penetration_mm");
  estimate.contact.iterations = checked.count(message.iterations(), "update.contact.iterations");
  estimate.active_slaves =
      checked.indices(message.active_slaves(), nodes, "update.contact.active_slaves");
  estimate.contact_force_n = checked.numbers(message.force_n(), "update.contact.force_n");
  checked.require(message.active_slaves_size() == message.force_n_size(), "update.contact.force_n",
                  std::to_string(message.force_n_size()) + " forces for " +
                      std::to_string(message.active_slaves_size()) + " active slaves");
  if (message.has_decrement()) {
    estimate.contact.decrement =
        checked.non_negative(message.decrement(), "update.contact.decrement");
  }
  if (message.has_max_violation_mm()) {
    estimate.contact.max_violation_mm =
        checked.number(message.max_violation_mm(), "update.contact.max_violation_mm");
  }
}

SourceSummary get_source(const pb::SourceSummary& message, Checked& checked) {
  SourceSummary source;
  source.source = message.source();
  source.observation_sequence = message.observation_sequence();
  source.age_s = checked.number(message.age_s(), "update.sources.age_s");
  source.data = checked.count(message.data(), "update.sources.data");
  source.outliers = checked.count(message.outliers(), "update.sources.outliers");
  if (message.has_p_value()) {
    source.chi_square = checked.non_negative(message.chi_square(), "update.sources.chi_square");
    source.degrees_of_freedom =
        checked.non_negative(message.degrees_of_freedom(), "update.sources.degrees_of_freedom");
    source.p_value = checked.non_negative(message.p_value(), "update.sources.p_value");
  }
  source.consistent = message.consistent();
  return source;
}

// part: that the columns are of; empty: every node.
Estimate get_estimate(const pb::Update& message, const std::optional<FieldPart>& part,
                      Checked& checked) {
  Estimate estimate;
  const auto status = estimate_status_from(message.status());
  checked.require(status.has_value(), "update.status", in_quotes(message.status()) + " is unknown");
  estimate.status = status.value_or(EstimateStatus::kNotRun);
  estimate.reason = message.reason();
  estimate.displacement =
      checked.points(message.displacement().xyz_mm(), "update.displacement.xyz_mm");
  const int nodes = static_cast<int>(estimate.displacement.cols());
  const int listed = part ? static_cast<int>(part->nodes.size()) : nodes;
  checked.require(
      nodes == listed, "update.part.node_steps",
      std::to_string(listed) + " nodes for " + std::to_string(nodes) + " displacements");
  estimate.sd_mm = checked.numbers(message.sd_mm(), "update.sd_mm");
  checked.require(message.sd_mm_size() == 0 || message.sd_mm_size() == nodes, "update.sd_mm",
                  std::to_string(message.sd_mm_size()) + " values, must be 0 or one per node (" +
                      std::to_string(nodes) + ")");
  const auto known = static_cast<int>(message.known().size());
  checked.require(
      known == 0 || known == nodes, "update.known",
      std::to_string(known) + " values, must be 0 or one per node (" + std::to_string(nodes) + ")");
  estimate.known = from_bytes(message.known());
  if (message.has_ventricle_change_mm3()) {
    estimate.ventricle_change_mm3 =
        checked.number(message.ventricle_change_mm3(), "update.ventricle_change_mm3");
  }
  if (message.has_region_known()) {
    estimate.region_known = checked.share(message.region_known(), "update.region_known");
  }
  get_contact(message.contact(), part ? part->mesh_nodes : nodes, estimate, checked);
  estimate.initial_misfit_mm = checked.mean_std(message.initial_misfit(), "update.initial_misfit");
  estimate.misfit_mm = checked.mean_std(message.misfit(), "update.misfit");
  estimate.history.reserve(static_cast<std::size_t>(message.history_size()));
  for (const auto& record : message.history()) {
    estimate.history.push_back(get_iteration(record, checked));
  }
  for (const auto& source : message.sources()) {
    estimate.sources.push_back(get_source(source, checked));
  }
  estimate.quality = get_verdict(message, checked);
  get_prior(message, estimate, checked);
  if (message.has_min_volume_ratio()) {
    estimate.min_volume_ratio =
        checked.number(message.min_volume_ratio(), "update.min_volume_ratio");
  }
  estimate.inverted_elements =
      checked.count(message.inverted_elements(), "update.inverted_elements");
  if (message.has_misfit_ratio()) {
    estimate.misfit_ratio = checked.non_negative(message.misfit_ratio(), "update.misfit_ratio");
  }
  estimate.data_outside_region =
      checked.count(message.data_outside_region(), "update.data_outside_region");
  return estimate;
}

// What is common to an estimate and to the reason why there is none.
Update get_envelope(const pb::Update& message, Checked& checked) {
  Update update;
  update.case_id = message.case_id();
  update.model_id = message.model_id();
  update.sequence = message.sequence();
  update.observation_sequence = message.observation_sequence();
  const auto method = method_from(message.method());
  checked.require(method.has_value(), "update.method", in_quotes(message.method()) + " is unknown");
  update.method = method.value_or(Method::kPaper);
  const auto boundary = boundary_from(message.boundary());
  checked.require(boundary.has_value(), "update.boundary",
                  in_quotes(message.boundary()) + " is unknown");
  update.boundary = boundary.value_or(Boundary::kContact);
  update.final = message.final();
  update.timings = get_timings(message.timings(), checked);
  update.answer_time = get_answer_time(message.answer_time(), checked);
  if (message.has_t_undeformed_deformed()) {
    update.T_undeformed_deformed =
        checked.rigid(message.t_undeformed_deformed(), "update.t_undeformed_deformed");
  }
  for (const auto& omission : message.left_out()) {
    update.left_out.push_back({omission.part(), omission.reason(), omission.estimated_error()});
  }
  return update;
}

// All but timings and answer_time.
pb::Update to_message(const UpdateMessage& message) {
  const Update& update = message.update;
  pb::Update out;
  out.set_case_id(to_utf8(update.case_id));
  out.set_model_id(to_utf8(update.model_id));
  out.set_session_id(message.session_id);
  out.set_boot_id(message.boot_id);
  out.set_sequence(update.sequence);
  out.set_observation_sequence(update.observation_sequence);
  out.set_method(std::string(to_string(update.method)));
  out.set_boundary(std::string(to_string(update.boundary)));
  out.set_final(update.final);
  if (message.error) {
    out.set_status(std::string(kFailed));
    out.set_error_code(std::string(to_string(message.error->code)));
    out.set_reason(to_utf8(message.error->message));
  } else {
    set_estimate(update.estimate, out);
    // Without the numbers of a field that is not finite there are no nodes either.
    const bool has_numbers = !update.estimate.quality.flags.has(QualityFlag::kNotFinite);
    if (update.part && has_numbers) set_part(*update.part, *out.mutable_part());
  }
  if (update.T_undeformed_deformed.matrix() != RigidTransform::Identity().matrix()) {
    set(update.T_undeformed_deformed, out.mutable_t_undeformed_deformed());
  }
  for (const auto& omission : update.left_out) {
    auto* entry = out.add_left_out();
    entry->set_part(to_utf8(omission.part));
    entry->set_reason(to_utf8(omission.reason));
    entry->set_estimated_error(to_utf8(omission.estimated_error));
  }
  return out;
}

}  // namespace

std::string encode(const UpdateMessage& message) {
  pb::Update out = to_message(message);
  set_timings(message.update.timings, out.mutable_timings());
  set_answer_time(message.update.answer_time, out);
  return out.SerializeAsString();
}

std::string encode_without_timings(const UpdateMessage& message) {
  constexpr std::size_t kTimingsBytes = 96;  // eight doubles, a bool and their tags take 82 at most
  const pb::Update out = to_message(message);
  std::string payload;
  payload.reserve(out.ByteSizeLong() + kTimingsBytes);
  out.AppendToString(&payload);
  return payload;
}

void append_timings(const Update& update, std::string& payload) {
  pb::Update only;
  set_timings(update.timings, only.mutable_timings());
  set_answer_time(update.answer_time, only);
  only.AppendToString(&payload);
}

Result<UpdateMessage> decode_update(std::string_view payload) {
  pb::Update message;
  if (Status status = parse(payload, message); !status) return tl::unexpected(status.error());
  Checked checked;
  UpdateMessage decoded;
  decoded.session_id = message.session_id();
  decoded.boot_id = message.boot_id();
  decoded.update = get_envelope(message, checked);
  if (message.status() == kFailed) {
    checked.require(!message.error_code().empty(), "update.error_code",
                    "is absent although status is \"failed\"");
    checked.require(message.displacement().xyz_mm().empty(), "update.displacement",
                    "is present although status is \"failed\"");
    checked.require(message.quality() == pb::QUALITY_UNSPECIFIED, "update.quality",
                    "is present although status is \"failed\"");
    checked.require(!message.has_part(), "update.part", "is present although status is \"failed\"");
    decoded.error = make_error(message.error_code(), message.reason());
  } else {
    checked.require(message.error_code().empty(), "update.error_code",
                    "is present although status is not \"failed\"");
    std::optional<FieldPart>& part = decoded.update.part;
    if (message.has_part()) part = get_part(message, checked);
    decoded.update.estimate = get_estimate(message, part, checked);
    checked.require(!part || part->base_sequence == 0 || decoded.update.usable(),
                    "update.part.base_sequence", "is present although the update is not usable");
  }
  if (!checked.ok()) return tl::unexpected(checked.status().error());
  return decoded;
}

}  // namespace brainshift::wire
