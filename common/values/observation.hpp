// SPDX-License-Identifier: Apache-2.0
// Observation: what the operating room measured, before any interpretation. All coordinates mm.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>

#include "common/core/mesh.hpp"
#include "common/core/types.hpp"
#include "common/values/session_state.hpp"

namespace brainshift {

// Tumour boundary traced in tracked ultrasound, deformed configuration. points: 3 x m.
struct TumourBoundary {
  Points points;
  double sd_mm = 0.0;
};

// Exposed cortical surface from stereopsis, deformed configuration. It may have no triangles
// (points only).
struct CorticalSurface {
  TriangleSurface surface;
  double sd_mm = 0.0;
};

// Homologous points: undeformed (3 x m) and where each was found after deformation (3 x m).
struct LandmarkPairs {
  Points undeformed;
  Points deformed;
  double sd_mm = 0.0;
};

// Patient pose or fluid level change. gravity_direction: unit vector in RAS.
struct PatientPose {
  Vec3 gravity_direction = Vec3(0, -1, 0);
  std::optional<double> fluid_level_mm;  // below the lowest craniotomy node, along gravity
};

struct Observation {
  std::string case_id;
  std::string frame = "ras";          // only "ras" enters the inversion
  std::string source;                 // e.g. "ius", "stereopsis", "pointer"
  std::uint64_t sequence = 0;         // counts up per source, from 1, below 2^63
  std::int64_t acquired_ns = 0;       // monotonic clock of the source
  std::int64_t acquired_wall_ns = 0;  // metadata only, UTC since the epoch
  SessionKey session;                 // that it is for; empty in a recording
  std::int64_t sent_ns = 0;           // the source's clock at hand-over; 0: not stated
  // acquired_ns on the clock of the daemon that journalled it; 0: not journalled, or a replay.
  std::int64_t daemon_ns = 0;
  std::variant<TumourBoundary, CorticalSurface, LandmarkPairs, PatientPose> body;
};

}  // namespace brainshift
