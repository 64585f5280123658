// SPDX-License-Identifier: Apache-2.0
// Exact comparison of core values, field by field.
#pragma once

#include <gtest/gtest.h>

#include <cmath>

#include "common/wire/convert.hpp"
#include "common/wire/report.hpp"

namespace brainshift::wire {

template <typename A, typename B>
void expect_same_matrix(const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b) {
  ASSERT_EQ(a.rows(), b.rows());
  ASSERT_EQ(a.cols(), b.cols());
  EXPECT_TRUE(a == b) << a << "\n--\n" << b;
}

inline void expect_same(const TriangleSurface& a, const TriangleSurface& b) {
  expect_same_matrix(a.vertices, b.vertices);
  expect_same_matrix(a.triangles, b.triangles);
}

inline void expect_same(const TumourBoundary& a, const TumourBoundary& b) {
  expect_same_matrix(a.points, b.points);
  EXPECT_EQ(a.sd_mm, b.sd_mm);
}

inline void expect_same(const CorticalSurface& a, const CorticalSurface& b) {
  expect_same(a.surface, b.surface);
  EXPECT_EQ(a.sd_mm, b.sd_mm);
}

inline void expect_same(const LandmarkPairs& a, const LandmarkPairs& b) {
  expect_same_matrix(a.undeformed, b.undeformed);
  expect_same_matrix(a.deformed, b.deformed);
  EXPECT_EQ(a.sd_mm, b.sd_mm);
}

inline void expect_same(const PatientPose& a, const PatientPose& b) {
  expect_same_matrix(a.gravity_direction, b.gravity_direction);
  EXPECT_EQ(a.fluid_level_mm, b.fluid_level_mm);
}

inline void expect_same(const Observation& a, const Observation& b) {
  EXPECT_EQ(a.case_id, b.case_id);
  EXPECT_EQ(a.frame, b.frame);
  EXPECT_EQ(a.source, b.source);
  EXPECT_EQ(a.sequence, b.sequence);
  EXPECT_EQ(a.acquired_ns, b.acquired_ns);
  EXPECT_EQ(a.acquired_wall_ns, b.acquired_wall_ns);
  EXPECT_EQ(a.session, b.session);
  EXPECT_EQ(a.sent_ns, b.sent_ns);
  EXPECT_EQ(a.daemon_ns, b.daemon_ns);
  ASSERT_EQ(a.body.index(), b.body.index());
  std::visit(
      [&](const auto& body) { expect_same(body, std::get<std::decay_t<decltype(body)>>(b.body)); },
      a.body);
}

inline void expect_same(const BrainModel& a, const BrainModel& b) {
  EXPECT_EQ(a.case_id, b.case_id);
  EXPECT_EQ(a.model_id, b.model_id);
  expect_same_matrix(a.mesh.nodes, b.mesh.nodes);
  expect_same_matrix(a.mesh.tets, b.mesh.tets);
  EXPECT_EQ(a.mesh.labels, b.mesh.labels);
  expect_same_matrix(a.boundary_triangles, b.boundary_triangles);
  expect_same(a.skull, b.skull);
  expect_same(a.tumour, b.tumour);
  EXPECT_EQ(a.craniotomy, b.craniotomy);
  EXPECT_EQ(a.brainstem, b.brainstem);
  EXPECT_EQ(a.slaves, b.slaves);
  EXPECT_EQ(a.fixed, b.fixed);
  expect_same_matrix(a.gravity_direction, b.gravity_direction);
  EXPECT_EQ(a.fluid_plane_depth_mm, b.fluid_plane_depth_mm);
  EXPECT_EQ(a.slave_plane_depth_mm, b.slave_plane_depth_mm);
}

inline void expect_same(const DaemonReport& a, const DaemonReport& b) { EXPECT_EQ(a, b); }

inline void expect_same(const DaemonStatus& a, const DaemonStatus& b) {
  EXPECT_EQ(a.version, b.version);
  EXPECT_EQ(a.model_ready, b.model_ready);
  EXPECT_EQ(a.case_id, b.case_id);
  EXPECT_EQ(a.model_id, b.model_id);
  EXPECT_EQ(a.busy, b.busy);
  EXPECT_EQ(a.updates, b.updates);
  EXPECT_EQ(a.uptime_ms, b.uptime_ms);
}

inline void expect_same(const SessionRequest& a, const SessionRequest& b) {
  EXPECT_EQ(a.case_id, b.case_id);
  EXPECT_EQ(a.method, b.method);
  EXPECT_EQ(a.boundary, b.boundary);
  EXPECT_EQ(a.publish_iterates, b.publish_iterates);
  EXPECT_EQ(a.takeover, b.takeover);
  EXPECT_EQ(a.recorded_clock, b.recorded_clock);
}

inline void expect_same(const Subscription& a, const Subscription& b) { EXPECT_EQ(a, b); }

inline void expect_same(const SessionState& a, const SessionState& b) { EXPECT_EQ(a, b); }

inline void expect_same(const SessionInfo& a, const SessionInfo& b) {
  EXPECT_EQ(a.session_id, b.session_id);
  EXPECT_EQ(a.model_id, b.model_id);
  EXPECT_EQ(a.nodes, b.nodes);
  EXPECT_EQ(a.tets, b.tets);
  EXPECT_EQ(a.slaves, b.slaves);
  EXPECT_EQ(a.prepare_s, b.prepare_s);
  EXPECT_EQ(a.model_bytes, b.model_bytes);
  EXPECT_EQ(a.boot_id, b.boot_id);
}

inline void expect_same(const ObservationReceipt& a, const ObservationReceipt& b) {
  EXPECT_EQ(a.observation_sequence, b.observation_sequence);
  EXPECT_EQ(a.replaced_pending, b.replaced_pending);
}

inline void expect_same(const Error& a, const Error& b) {
  EXPECT_EQ(a.code, b.code);
  EXPECT_EQ(a.message, b.message);
}

inline void expect_same(const MeanStd& a, const MeanStd& b) {
  EXPECT_EQ(a.mean, b.mean);
  EXPECT_EQ(a.std, b.std);
}

// NaN: not computed.
inline void expect_same_or_absent(double a, double b) {
  EXPECT_EQ(std::isnan(a), std::isnan(b));
  if (!std::isnan(a)) {
    EXPECT_EQ(a, b);
  }
}

inline void expect_same(const Estimate& a, const Estimate& b) {
  EXPECT_EQ(a.status, b.status);
  EXPECT_EQ(a.reason, b.reason);
  expect_same_matrix(a.displacement, b.displacement);
  expect_same_matrix(a.sd_mm, b.sd_mm);
  EXPECT_EQ(a.contact.active, b.contact.active);
  EXPECT_EQ(a.contact.penetrating, b.contact.penetrating);
  EXPECT_EQ(a.contact.max_penetration_mm, b.contact.max_penetration_mm);
  EXPECT_EQ(a.contact.iterations, b.contact.iterations);
  EXPECT_EQ(a.active_slaves, b.active_slaves);
  expect_same_matrix(a.contact_force_n, b.contact_force_n);
  expect_same(a.initial_misfit_mm, b.initial_misfit_mm);
  expect_same(a.misfit_mm, b.misfit_mm);
  ASSERT_EQ(a.history.size(), b.history.size());
  for (std::size_t i = 0; i < a.history.size(); ++i) {
    EXPECT_EQ(a.history[i].iteration, b.history[i].iteration);
    expect_same(a.history[i].misfit_mm, b.history[i].misfit_mm);
    EXPECT_EQ(a.history[i].penetrating, b.history[i].penetrating);
    EXPECT_EQ(a.history[i].max_penetration_mm, b.history[i].max_penetration_mm);
    EXPECT_EQ(a.history[i].elapsed_ms, b.history[i].elapsed_ms);
  }
  EXPECT_EQ(a.quality.quality, b.quality.quality);
  EXPECT_EQ(a.quality.flags, b.quality.flags);
  EXPECT_EQ(a.quality.reason, b.quality.reason);
  expect_same_or_absent(a.contact.decrement, b.contact.decrement);
  expect_same_or_absent(a.contact.max_violation_mm, b.contact.max_violation_mm);
  expect_same_or_absent(a.misfit_ratio, b.misfit_ratio);
  expect_same_or_absent(a.min_volume_ratio, b.min_volume_ratio);
  EXPECT_EQ(a.inverted_elements, b.inverted_elements);
  EXPECT_EQ(a.data_outside_region, b.data_outside_region);
  EXPECT_EQ(a.prior_scales, b.prior_scales);
  EXPECT_EQ(a.prior_absent, b.prior_absent);
  EXPECT_EQ(a.prior_at_bound, b.prior_at_bound);
  ASSERT_EQ(a.hypotheses.size(), b.hypotheses.size());
  for (std::size_t i = 0; i < a.hypotheses.size(); ++i) {
    EXPECT_EQ(a.hypotheses[i].scales, b.hypotheses[i].scales);
    EXPECT_EQ(a.hypotheses[i].weight, b.hypotheses[i].weight);
  }
}

inline void expect_same(const UpdateMessage& a, const UpdateMessage& b) {
  EXPECT_EQ(a.session_id, b.session_id);
  EXPECT_EQ(a.update.case_id, b.update.case_id);
  EXPECT_EQ(a.update.model_id, b.update.model_id);
  EXPECT_EQ(a.update.sequence, b.update.sequence);
  EXPECT_EQ(a.update.observation_sequence, b.update.observation_sequence);
  EXPECT_EQ(a.update.method, b.update.method);
  EXPECT_EQ(a.update.boundary, b.update.boundary);
  EXPECT_EQ(a.update.final, b.update.final);
  expect_same(a.update.estimate, b.update.estimate);
  EXPECT_EQ(a.update.part, b.update.part);
  EXPECT_EQ(a.update.timings.register_ms, b.update.timings.register_ms);
  EXPECT_EQ(a.update.timings.invert_ms, b.update.timings.invert_ms);
  EXPECT_EQ(a.update.timings.rebuild_ms, b.update.timings.rebuild_ms);
  EXPECT_EQ(a.update.timings.encode_ms, b.update.timings.encode_ms);
  EXPECT_EQ(a.update.timings.journal_ms, b.update.timings.journal_ms);
  EXPECT_EQ(a.update.answer_time.ms, b.update.answer_time.ms);
  EXPECT_EQ(a.update.answer_time.usual_ms, b.update.answer_time.usual_ms);
  expect_same_matrix(a.update.T_undeformed_deformed.matrix(),
                     b.update.T_undeformed_deformed.matrix());
  const auto& sources = a.update.estimate.sources;
  ASSERT_EQ(sources.size(), b.update.estimate.sources.size());
  for (std::size_t i = 0; i < sources.size(); ++i) {
    const SourceSummary& other = b.update.estimate.sources[i];
    EXPECT_EQ(sources[i].source, other.source);
    EXPECT_EQ(sources[i].observation_sequence, other.observation_sequence);
    EXPECT_EQ(sources[i].age_s, other.age_s);
    EXPECT_EQ(sources[i].data, other.data);
    EXPECT_EQ(sources[i].outliers, other.outliers);
    EXPECT_EQ(std::isnan(sources[i].p_value), std::isnan(other.p_value));
    if (!std::isnan(other.p_value)) {
      EXPECT_EQ(sources[i].chi_square, other.chi_square);
      EXPECT_EQ(sources[i].degrees_of_freedom, other.degrees_of_freedom);
      EXPECT_EQ(sources[i].p_value, other.p_value);
    }
    EXPECT_EQ(sources[i].consistent, other.consistent);
  }
  ASSERT_EQ(a.update.left_out.size(), b.update.left_out.size());
  for (std::size_t i = 0; i < a.update.left_out.size(); ++i) {
    EXPECT_EQ(a.update.left_out[i].part, b.update.left_out[i].part);
    EXPECT_EQ(a.update.left_out[i].reason, b.update.left_out[i].reason);
    EXPECT_EQ(a.update.left_out[i].estimated_error, b.update.left_out[i].estimated_error);
  }
  ASSERT_EQ(a.error.has_value(), b.error.has_value());
  if (a.error) expect_same(*a.error, *b.error);
}

}  // namespace brainshift::wire
