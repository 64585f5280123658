// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/replay/leave_one_out.hpp"

#include <gmock/gmock.h>

#include "common/geometry/surface.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/client/tools/replay/box.hpp"
#include "tests/unit/client/tools/replay/scripted_daemon.hpp"

namespace brainshift::client {
namespace {

// Landmarks of a box of 10 mm that all moved by 1 mm, but for the first, which moved by 3 mm.
LandmarkPairs one_that_differs(int count) {
  LandmarkPairs pairs;
  pairs.undeformed = 5.0 * Points::Ones(3, count) + 2.0 * Points::Random(3, count);
  pairs.deformed = pairs.undeformed;
  pairs.deformed.row(0).array() += 1.0;
  pairs.deformed(0, 0) += 2.0;
  pairs.sd_mm = 0.1;
  return pairs;
}

RecordedObservation observed_by(const std::string& source, decltype(Observation::body) body) {
  RecordedObservation recorded;
  recorded.observation.source = source;
  recorded.observation.sequence = 41;
  recorded.observation.body = std::move(body);
  return recorded;
}

// A daemon whose field is the mean motion of the landmarks of the observation, without uncertainty.
ScriptedDaemon mean_daemon() {
  ScriptedDaemon daemon;
  daemon.script = [](const Observation& observation) {
    const auto& pairs = std::get<LandmarkPairs>(observation.body);
    UpdateMessage answer = update(observation.sequence, true);
    const Vec3 mean = (pairs.deformed - pairs.undeformed).rowwise().mean();
    const int nodes = box_model().mesh.num_nodes();
    answer.update.estimate.displacement = mean.replicate(1, nodes);
    answer.update.estimate.sd_mm = VecX::Constant(nodes, 0.1);
    return std::vector{answer};
  };
  return daemon;
}

TEST(LeaveOneOut, NothingOfALandmarkIsReadToPredictIt) {
  ScriptedDaemon daemon = mean_daemon();
  const auto scores = value_or_fail(leave_one_out(
      daemon.link(), kOptions, {observed_by("tracks", one_that_differs(6))}, box_model()));
  ASSERT_EQ(scores.size(), 1u);
  const LeftOutScore& score = scores[0];
  EXPECT_EQ(score.source, "tracks");
  EXPECT_EQ(score.kind, "landmarks");
  EXPECT_EQ(score.points, 6);
  // The first is off by 2 mm; every other by a fifth of it, for the first is among its five.
  EXPECT_NEAR(score.error.mean, (2.0 + 5 * 0.4) / 6.0, 1e-9);
  EXPECT_NEAR(score.initial.mean, (3.0 + 5 * 1.0) / 6.0, 1e-9);
  EXPECT_TRUE(score.rigid);
  EXPECT_NEAR(*score.coverage_90, 12.0 / 18.0, 1e-9) << "of 1.645 * 0.14 mm: not along x";
}

TEST(LeaveOneOut, AFieldThatIsNotUsableLeavesItsLandmarkUnscored) {
  ScriptedDaemon daemon = mean_daemon();
  const auto well = daemon.script;
  int answers = 0;
  daemon.script = [&](const Observation& observation) {
    return ++answers == 2 ? std::vector{unusable_update(observation.sequence)} : well(observation);
  };
  const auto scores = value_or_fail(leave_one_out(
      daemon.link(), kOptions, {observed_by("tracks", one_that_differs(6))}, box_model()));
  ASSERT_EQ(scores.size(), 1u);
  EXPECT_EQ(scores[0].points, 5);
  EXPECT_EQ(scores[0].failed, 1);
  EXPECT_NEAR(scores[0].error.mean, 0.4, 1e-9) << "the first is the one without";
}

TEST(LeaveOneOut, FewLandmarksHaveNoScoreAndSilenceIsAnError) {
  ScriptedDaemon daemon = mean_daemon();
  const auto scores = leave_one_out(daemon.link(), kOptions,
                                    {observed_by("tracks", one_that_differs(4))}, box_model());
  EXPECT_TRUE(value_or_fail(scores).empty());
  daemon.script = [](const Observation&) { return std::vector<UpdateMessage>{}; };
  refusal_of(leave_one_out(daemon.link(), kOptions, {observed_by("tracks", one_that_differs(6))},
                           box_model()),
             ErrorCode::kUnavailable);
}

TEST(LeaveOneOut, BoundaryPointsArePredictedAnOctantAtATime) {
  BrainModel model = box_model();
  model.tumour = geometry::ellipsoid_surface(Vec3(5, 5, 5), Vec3(2, 2, 2), 0.5);
  TumourBoundary boundary{model.tumour.vertices, 0.3};
  boundary.points.row(0).array() += 1.0;
  ScriptedDaemon daemon;
  std::vector<Eigen::Index> sizes;
  daemon.script = [&](const Observation& observation) {
    sizes.push_back(std::get<TumourBoundary>(observation.body).points.cols());
    UpdateMessage answer = update(observation.sequence, true);
    answer.update.estimate.displacement = Vec3(1, 0, 0).replicate(1, model.mesh.num_nodes());
    return std::vector{answer};
  };
  const auto scores =
      value_or_fail(leave_one_out(daemon.link(), kOptions, {observed_by("ius", boundary)}, model));
  ASSERT_EQ(scores.size(), 1u);
  EXPECT_EQ(scores[0].kind, "tumour boundary");
  EXPECT_EQ(scores[0].points, boundary.points.cols());
  EXPECT_GT(scores[0].initial.mean, 0.3);
  EXPECT_NEAR(scores[0].error.mean, 0.0, 1e-9);
  ASSERT_EQ(sizes.size(), 9u) << "all once, then eight octants";
  for (std::size_t i = 1; i < 9; ++i) EXPECT_LT(sizes[i], sizes[0]);
}

}  // namespace
}  // namespace brainshift::client
