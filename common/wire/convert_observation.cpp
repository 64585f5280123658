// SPDX-License-Identifier: Apache-2.0
#include "brainshift/v1/brainshift.pb.h"
#include "common/core/text.hpp"
#include "common/wire/checked_values.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/payload_scan.hpp"

namespace brainshift::wire {
namespace {

void set_body(const TumourBoundary& body, pb::Observation& out) {
  auto* message = out.mutable_tumour_boundary();
  set(body.points, message->mutable_points());
  message->set_sd_mm(body.sd_mm);
}

void set_body(const CorticalSurface& body, pb::Observation& out) {
  auto* message = out.mutable_cortical_surface();
  set(body.surface, message->mutable_surface());
  message->set_sd_mm(body.sd_mm);
}

void set_body(const LandmarkPairs& body, pb::Observation& out) {
  auto* message = out.mutable_landmark_pairs();
  set(body.undeformed, message->mutable_undeformed());
  set(body.deformed, message->mutable_deformed());
  message->set_sd_mm(body.sd_mm);
}

void set_body(const PatientPose& body, pb::Observation& out) {
  auto* message = out.mutable_patient_pose();
  set(body.gravity_direction, message->mutable_gravity_direction());
  if (body.fluid_level_mm) message->set_fluid_level_mm(*body.fluid_level_mm);
}

TumourBoundary get_body(const pb::TumourBoundary& message, Checked& checked) {
  return {checked.points(message.points(), "observation.tumour_boundary.points"),
          checked.non_negative(message.sd_mm(), "observation.tumour_boundary.sd_mm")};
}

CorticalSurface get_body(const pb::CorticalSurface& message, Checked& checked) {
  return {checked.surface(message.surface(), "observation.cortical_surface.surface"),
          checked.non_negative(message.sd_mm(), "observation.cortical_surface.sd_mm")};
}

LandmarkPairs get_body(const pb::LandmarkPairs& message, Checked& checked) {
  LandmarkPairs body;
  body.undeformed = checked.points(message.undeformed(), "observation.landmark_pairs.undeformed");
  body.deformed = checked.points(message.deformed(), "observation.landmark_pairs.deformed");
  body.sd_mm = checked.non_negative(message.sd_mm(), "observation.landmark_pairs.sd_mm");
  checked.require(body.undeformed.cols() == body.deformed.cols(), "observation.landmark_pairs",
                  std::to_string(body.undeformed.cols()) + " undeformed and " +
                      std::to_string(body.deformed.cols()) + " deformed points, must be equal");
  return body;
}

PatientPose get_body(const pb::PatientPose& message, Checked& checked) {
  PatientPose body;
  body.gravity_direction = checked.unit_vector(message.gravity_direction(),
                                               "observation.patient_pose.gravity_direction");
  if (message.has_fluid_level_mm()) {
    body.fluid_level_mm =
        checked.number(message.fluid_level_mm(), "observation.patient_pose.fluid_level_mm");
  }
  return body;
}

}  // namespace

std::string encode(const Observation& observation) {
  pb::Observation message;
  message.set_case_id(to_utf8(observation.case_id));
  message.set_frame(to_utf8(observation.frame));
  message.set_source(to_utf8(observation.source));
  message.set_sequence(observation.sequence);
  message.set_acquired_ns(observation.acquired_ns);
  message.set_acquired_wall_ns(observation.acquired_wall_ns);
  if (observation.session != SessionKey{}) set(observation.session, message.mutable_session());
  message.set_sent_ns(observation.sent_ns);
  message.set_daemon_ns(observation.daemon_ns);
  std::visit([&](const auto& body) { set_body(body, message); }, observation.body);
  return message.SerializeAsString();
}

void append_daemon_time(std::int64_t daemon_ns, std::string& payload) {
  pb::Observation only;
  only.set_daemon_ns(daemon_ns);
  only.AppendToString(&payload);
}

Result<Observation> decode_observation(std::string_view payload) {
  pb::Observation message;
  if (Status status = parse(payload, message); !status) return tl::unexpected(status.error());
  Observation observation;
  observation.case_id = message.case_id();
  observation.frame = message.frame();
  observation.source = message.source();
  observation.sequence = message.sequence();
  observation.acquired_ns = message.acquired_ns();
  observation.acquired_wall_ns = message.acquired_wall_ns();
  observation.session = session_key_from(message.session());
  observation.sent_ns = message.sent_ns();
  observation.daemon_ns = message.daemon_ns();
  Checked checked;
  switch (message.body_case()) {
    case pb::Observation::kTumourBoundary:
      observation.body = get_body(message.tumour_boundary(), checked);
      break;
    case pb::Observation::kCorticalSurface:
      observation.body = get_body(message.cortical_surface(), checked);
      break;
    case pb::Observation::kLandmarkPairs:
      observation.body = get_body(message.landmark_pairs(), checked);
      break;
    case pb::Observation::kPatientPose:
      observation.body = get_body(message.patient_pose(), checked);
      break;
    case pb::Observation::BODY_NOT_SET:
      checked.require(false, "observation.body", "is absent or of an unknown kind");
      break;
  }
  if (!checked.ok()) return tl::unexpected(checked.status().error());
  return observation;
}

}  // namespace brainshift::wire
