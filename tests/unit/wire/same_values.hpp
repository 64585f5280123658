// SPDX-License-Identifier: Apache-2.0
// Exact comparison of core values, field by field.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

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
  expect_same_matrix(a.septa.triangles, b.septa.triangles);
  expect_same_matrix(a.ventricle_wall, b.ventricle_wall);
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
inline void expect_same(const Subscription& a, const Subscription& b) { EXPECT_EQ(a, b); }
inline void expect_same(const SessionState& a, const SessionState& b) { EXPECT_EQ(a, b); }

// members: of a value, tied together.
template <typename T, typename Members>
void expect_same_members(const T& a, const T& b, const Members& members) {
  EXPECT_EQ(members(a), members(b));
}

inline void expect_same(const DaemonStatus& a, const DaemonStatus& b) {
  expect_same_members(a, b, [](const DaemonStatus& s) {
    return std::tie(s.version, s.model_ready, s.case_id, s.model_id, s.busy, s.updates,
                    s.uptime_ms);
  });
}

inline void expect_same(const SessionRequest& a, const SessionRequest& b) {
  expect_same_members(a, b, [](const SessionRequest& r) {
    return std::tie(r.case_id, r.method, r.boundary, r.publish_iterates, r.takeover,
                    r.recorded_clock);
  });
}

inline void expect_same(const SessionInfo& a, const SessionInfo& b) {
  expect_same_members(a, b, [](const SessionInfo& i) {
    return std::tie(i.session_id, i.model_id, i.nodes, i.tets, i.slaves, i.prepare_s, i.model_bytes,
                    i.boot_id);
  });
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
  expect_same_matrix(a.known, b.known);
  expect_same_or_absent(a.region_known, b.region_known);
  expect_same_or_absent(a.ventricle_change_mm3, b.ventricle_change_mm3);
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
    expect_same(a.history[i].misfit_mm, b.history[i].misfit_mm);
    expect_same_members(a.history[i], b.history[i], [](const IterationRecord& r) {
      return std::tie(r.iteration, r.penetrating, r.max_penetration_mm, r.elapsed_ms);
    });
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
  expect_same_members(a.update, b.update, [](const Update& u) {
    return std::tie(u.case_id, u.model_id, u.sequence, u.observation_sequence, u.method, u.boundary,
                    u.final, u.part);
  });
  expect_same(a.update.estimate, b.update.estimate);
  expect_same_members(a.update.timings, b.update.timings, [](const StageTimings& t) {
    return std::tie(t.register_ms, t.invert_ms, t.rebuild_ms, t.encode_ms, t.journal_ms);
  });
  EXPECT_EQ(a.update.answer_time.ms, b.update.answer_time.ms);
  EXPECT_EQ(a.update.answer_time.usual_ms, b.update.answer_time.usual_ms);
  EXPECT_EQ(a.update.answer_time.age_ms, b.update.answer_time.age_ms);
  expect_same_matrix(a.update.T_undeformed_deformed.matrix(),
                     b.update.T_undeformed_deformed.matrix());
  const auto& sources = a.update.estimate.sources;
  ASSERT_EQ(sources.size(), b.update.estimate.sources.size());
  for (std::size_t i = 0; i < sources.size(); ++i) {
    const SourceSummary& other = b.update.estimate.sources[i];
    expect_same_members(sources[i], other, [](const SourceSummary& s) {
      return std::tie(s.source, s.observation_sequence, s.age_s, s.data, s.outliers, s.consistent);
    });
    EXPECT_EQ(std::isnan(sources[i].p_value), std::isnan(other.p_value));
    if (!std::isnan(other.p_value)) {
      EXPECT_EQ(sources[i].chi_square, other.chi_square);
      EXPECT_EQ(sources[i].degrees_of_freedom, other.degrees_of_freedom);
      EXPECT_EQ(sources[i].p_value, other.p_value);
    }
  }
  ASSERT_EQ(a.update.left_out.size(), b.update.left_out.size());
  for (std::size_t i = 0; i < a.update.left_out.size(); ++i) {
    expect_same_members(a.update.left_out[i], b.update.left_out[i], [](const Omission& o) {
      return std::tie(o.part, o.reason, o.estimated_error);
    });
  }
  ASSERT_EQ(a.error.has_value(), b.error.has_value());
  if (a.error) expect_same(*a.error, *b.error);
}

}  // namespace brainshift::wire
