// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/session/observation_rules.hpp"

#include <fmt/format.h>

#include <cmath>

namespace brainshift::server {
namespace {

constexpr std::size_t kMaxSourceLength = 64;
constexpr std::size_t kMaxQuoted = 64;

Status check_sd(const char* body, double sd_mm) {
  if (std::isfinite(sd_mm) && sd_mm >= 0.0) return {};
  return fail(ErrorCode::kInvalidArgument,
              fmt::format("{}.sd_mm = {}: must be finite and not negative", body, sd_mm));
}

Status check_points(const char* field, const Points& points) {
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    if (!points.col(i).allFinite()) {
      return fail(ErrorCode::kNotFinite, fmt::format("{}: point {} is not finite", field, i));
    }
  }
  return {};
}

struct CheckBody {
  Status operator()(const TumourBoundary& body) const {
    if (auto status = check_points("tumour_boundary.points", body.points); !status) return status;
    return check_sd("tumour_boundary", body.sd_mm);
  }
  Status operator()(const CorticalSurface& body) const {
    if (auto status = check_points("cortical_surface.surface", body.surface.vertices); !status) {
      return status;
    }
    return check_sd("cortical_surface", body.sd_mm);
  }
  Status operator()(const LandmarkPairs& body) const {
    if (auto status = check_points("landmark_pairs.undeformed", body.undeformed); !status) {
      return status;
    }
    if (auto status = check_points("landmark_pairs.deformed", body.deformed); !status) {
      return status;
    }
    return check_sd("landmark_pairs", body.sd_mm);
  }
  Status operator()(const PatientPose& body) const {
    if (!body.gravity_direction.allFinite()) {
      return fail(ErrorCode::kNotFinite, "patient_pose.gravity_direction is not finite");
    }
    if (body.fluid_level_mm && !std::isfinite(*body.fluid_level_mm)) {
      return fail(ErrorCode::kNotFinite, "patient_pose.fluid_level_mm is not finite");
    }
    return {};
  }
};

}  // namespace

Status check_observation(const Observation& observation, std::string_view case_id,
                         std::uint64_t last_sequence) {
  if (observation.case_id != case_id) {
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("observation.case_id = {}: the running session is for {}",
                            in_quotes(observation.case_id), in_quotes(case_id)));
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
  if (observation.sequence <= last_sequence) {
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("observation.sequence = {}: must be above {}, the last one accepted",
                            observation.sequence, last_sequence));
  }
  return std::visit(CheckBody{}, observation.body);
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
