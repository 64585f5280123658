// SPDX-License-Identifier: Apache-2.0
// One value of every message, full of numbers that are easily damaged.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "common/wire/convert.hpp"

namespace brainshift::wire {

// No short decimal form, negative zero, denormal, extremes.
inline const std::vector<double>& awkward_doubles() {
  static const std::vector<double> values = {0.1,
                                             -1.0 / 3.0,
                                             -0.0,
                                             std::numeric_limits<double>::denorm_min(),
                                             std::numeric_limits<double>::max(),
                                             std::numeric_limits<double>::lowest(),
                                             std::nextafter(1.0, 2.0),
                                             1e-300,
                                             123456789.123456789};
  return values;
}

// The same kind of numbers among those that a 32-bit float holds exactly.
inline const std::vector<float>& awkward_floats() {
  static const std::vector<float> values = {0.1f,
                                            -1.0f / 3.0f,
                                            -0.0f,
                                            std::numeric_limits<float>::denorm_min(),
                                            std::numeric_limits<float>::max(),
                                            std::numeric_limits<float>::lowest()};
  return values;
}

inline Points awkward_points(int count) {
  Points points(3, count);
  for (Eigen::Index i = 0; i < points.size(); ++i) {
    points(i) = awkward_doubles()[static_cast<std::size_t>(i) % awkward_doubles().size()];
  }
  return points;
}

inline TriangleSurface sample_surface() {
  TriangleSurface surface;
  surface.vertices = awkward_points(4);
  surface.triangles.resize(3, 4);
  surface.triangles << 0, 0, 1, 0, 2, 1, 2, 3, 1, 3, 3, 2;
  return surface;
}

inline Observation sample_observation(int kind) {
  Observation observation;
  observation.case_id = "Fall Köln 7";
  observation.frame = "ras";
  observation.source = "ius";
  observation.sequence = std::numeric_limits<std::uint64_t>::max();
  observation.acquired_ns = std::numeric_limits<std::int64_t>::min();
  observation.acquired_wall_ns = std::numeric_limits<std::int64_t>::max();
  observation.session = {~std::uint64_t{0}, 7, "0123456789abcdef"};
  observation.sent_ns = -1;
  observation.daemon_ns = std::numeric_limits<std::int64_t>::max();
  switch (kind) {
    case 0: observation.body = TumourBoundary{awkward_points(7), 0.1}; break;
    case 1: observation.body = CorticalSurface{sample_surface(), 0.0}; break;
    case 2:
      observation.body = LandmarkPairs{awkward_points(3), awkward_points(3) * -1.0, 0.3};
      break;
    default: observation.body = PatientPose{Vec3(0.6, -0.0, -0.8), -0.0}; break;
  }
  return observation;
}

inline BrainModel sample_model() {
  BrainModel model;
  model.case_id = "colin27";
  model.model_id = "0123456789abcdef";
  model.mesh.nodes = awkward_points(5);
  model.mesh.tets.resize(4, 2);
  model.mesh.tets << 0, 1, 1, 2, 2, 3, 3, 4;
  model.mesh.labels = {0, -7};
  model.boundary_triangles.resize(3, 2);
  model.boundary_triangles << 4, 0, 3, 1, 2, 2;
  model.septa.triangles.resize(3, 1);
  model.septa.triangles << 2, 0, 4;
  model.ventricle_wall.resize(3, 1);
  model.ventricle_wall << 1, 4, 3;
  model.skull = sample_surface();
  model.tumour = sample_surface();
  model.craniotomy = {0};
  model.brainstem = {4};
  model.slaves = {1, 3};
  model.fixed = {2};
  model.gravity_direction = Vec3(0.6, 0.0, -0.8);
  model.fluid_plane_depth_mm = -1.0 / 3.0;
  model.slave_plane_depth_mm = 19.666;
  return model;
}

inline UpdateMessage sample_update() {
  UpdateMessage message;
  message.session_id = std::numeric_limits<std::uint64_t>::max();
  Update& update = message.update;
  update.case_id = "colin27";
  update.model_id = "0123456789abcdef";
  update.sequence = 1;
  update.observation_sequence = 1ull << 63;
  update.boundary = Boundary::kFixed;
  update.final = false;
  Estimate& estimate = update.estimate;
  estimate.status = EstimateStatus::kIterating;
  estimate.reason = "iteration 2 of at most 60";
  estimate.displacement.resize(3, 4);
  estimate.sd_mm.resize(4);
  for (int i = 0; i < 12; ++i) {
    const double value = awkward_floats()[static_cast<std::size_t>(i) % awkward_floats().size()];
    estimate.displacement(i) = value;
    if (i < 4) estimate.sd_mm[i] = value;
  }
  estimate.contact = {2, 1, 0.1, 3};
  estimate.active_slaves = {3, 0};
  estimate.contact_force_n = Eigen::Vector2d(0.25, -1.0 / 1024.0);
  estimate.initial_misfit_mm = {3.1, 0.9};
  estimate.misfit_mm = {0.1, 1.0 / 3.0};
  estimate.history = {{1, {1.1, 0.3}, 40, 0.7, 100.1}, {2, {0.1, 1.0 / 3.0}, 0, 0.0, 200.2}};
  estimate.sources = {{"ius", 41, 0.25, 200, 3, 31.5, 28.7, 0.1, true},
                      {"stéréo", 40, -1.0 / 3.0, 300, 0}};
  estimate.sources[1].consistent = false;
  update.timings = {0.1, 1e4, 1e-300, 0.0, 7.0};
  update.answer_time = {812.5, 34.25, 1e5 / 3.0};
  update.T_undeformed_deformed = Eigen::Translation3d(0.1, -2.0 / 3.0, 5.0) *
                                 Eigen::AngleAxisd(0.1, Vec3(1.0, 2.0, 3.0).normalized());
  update.left_out = {{"pore pressure", "updates are 10 s apart", "0.02 %"}, {"", "", ""}};
  return message;
}

// The sample with a verdict, strengths for whatever parts there are, and every figure behind them.
inline UpdateMessage sample_judged_update() {
  UpdateMessage message = sample_update();
  message.update.final = true;
  Estimate& estimate = message.update.estimate;
  estimate.status = EstimateStatus::kDeadline;
  estimate.quality.flags.set(QualityFlag::kDeadline);
  estimate.quality.flags.set(QualityFlag::kInvertedElements);
  estimate.quality.quality = Quality::kUnusable;
  estimate.quality.reason = "éléments retournés (3)";
  estimate.known = Eigen::Vector4d(0, 1, 128, 255) / 255.0;  // as bytes hold it
  estimate.region_known = 1.0 / 3.0;
  estimate.ventricle_change_mm3 = -8125.5;
  estimate.contact.decrement = 1.0 / 3.0;
  estimate.contact.max_violation_mm = -0.1;  // every slave is open
  estimate.misfit_ratio = 1.7;
  estimate.min_volume_ratio = -0.25;
  estimate.inverted_elements = 3;
  estimate.data_outside_region = 12;
  estimate.hypotheses.resize(3);
  for (std::size_t part = 0; part < kPriorParts; ++part) {
    estimate.prior_scales[part] = 0.1 * static_cast<double>(part);
    estimate.prior_absent[part] = 1.0 / (1.0 + static_cast<double>(part));
    estimate.prior_at_bound[part] = part % 2 == 1;
    for (std::size_t i = 0; i < estimate.hypotheses.size(); ++i) {
      estimate.hypotheses[i].scales[part] = static_cast<double>(i * part) / 3.0;
    }
  }
  estimate.hypotheses[0].weight = 0.7;
  estimate.hypotheses[1].weight = 0.3;
  estimate.hypotheses[2].weight = 0.0;
  return message;
}

inline UpdateMessage sample_failure() {
  UpdateMessage message;
  message.session_id = 3;
  message.update.case_id = "colin27";
  message.update.observation_sequence = 2;
  message.error = Error{ErrorCode::kEmptySet, "observation 2 holds no point"};
  return message;
}

}  // namespace brainshift::wire
