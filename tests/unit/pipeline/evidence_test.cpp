// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/pipeline/evidence.hpp"

#include <gmock/gmock.h>

#include <algorithm>

#include "common/core/random.hpp"
#include "common/geometry/surface.hpp"
#include "common/pipeline/pipeline.hpp"
#include "tests/support/results.hpp"
#include "tests/support/toy_patient.hpp"
#include "tests/unit/server/fake_inverter.hpp"

namespace brainshift::pipeline {
namespace {

using server::FakeInverter;
using testing::HasSubstr;

constexpr std::int64_t kSecond = 1'000'000'000;

std::shared_ptr<const BrainModel> patient() {
  static const auto model = std::make_shared<const BrainModel>(test_support::toy_patient(8));
  return model;
}

Observation observation(std::uint64_t sequence, const char* source, double time_s) {
  Observation made;
  made.case_id = patient()->case_id;
  made.source = source;
  made.sequence = sequence;
  made.acquired_ns = static_cast<std::int64_t>(1e9 * time_s);
  return made;
}

Observation landmarks_at(std::uint64_t sequence, const char* source, double time_s,
                         double shift = 1) {
  Observation made = observation(sequence, source, time_s);
  LandmarkPairs pairs;
  pairs.undeformed.resize(3, 4);
  pairs.undeformed << 25, 35, 30, 30, 30, 30, 25, 35, 40, 41, 42, 38;
  pairs.deformed = pairs.undeformed.colwise() + Vec3(shift, 0, 0);
  made.body = pairs;
  return made;
}

// The top of the toy brain, sunk by 2 mm.
Observation cortex(std::uint64_t sequence, double time_s) {
  Observation made = observation(sequence, "stereopsis", time_s);
  CorticalSurface body;
  Random random(3);
  body.surface.vertices.resize(3, 200);
  for (auto x : body.surface.vertices.colwise()) {
    x = Vec3(22.0 + 16.0 * random.uniform(), 22.0 + 16.0 * random.uniform(), 58.0);
  }
  body.sd_mm = 0.3;
  made.body = body;
  return made;
}

// Points of the tumour's surface, moved.
Observation boundary(std::uint64_t sequence, double time_s, const Vec3& shift = Vec3::Zero()) {
  Observation made = observation(sequence, "ius", time_s);
  TumourBoundary body;
  body.points = geometry::sample_surface(patient()->tumour, 400, 5).colwise() + shift;
  body.sd_mm = 0.3;
  made.body = body;
  return made;
}

// Remembers what it was given, asks moving data once for a displacement of (0, 0, -motion_mm), and
// answers with it.
struct FakeInversion {
  SparseData first, seen;        // before and after the question
  std::vector<NodeIndex> nodes;  // that the data asked for
  bool fails = false;
  double motion_mm = 1.0;
  std::string spoiler;  // a source with which no brain could move so
  int calls = 0;
  std::vector<double> spent_ms;  // that each call was told
  Status operator()(int, const SparseData& data, const inversion::InversionOptions& options,
                    Estimate& estimate) {
    if (fails) return fail(ErrorCode::kNotConverged, "no");
    ++calls;
    spent_ms.push_back(options.spent_ms);
    first = seen = data;
    const bool spoilt = std::any_of(data.sources.begin(), data.sources.end(),
                                    [this](const DataSource& s) { return s.name == spoiler; });
    const double sunk_mm = spoilt ? 2.0 * kMaxMotion_mm : motion_mm;
    if (options.moving != nullptr) nodes = options.moving->nodes;
    estimate.displacement = Points(Vec3(0, 0, -sunk_mm).replicate(1, patient()->mesh.num_nodes()));
    if (options.moving != nullptr) {
      const Points u = estimate.displacement(Eigen::all, options.moving->nodes);
      while (options.moving->relocate(u, seen)) {
      }
    }
    for (const DataSource& source : seen.sources) {
      estimate.sources.emplace_back();
      estimate.sources.back().source = source.name;
    }
    return {};
  }
};

class Sources : public testing::Test {
 protected:
  Pipeline pipeline(Method method) {
    return std::move(*Pipeline::build(
        *patient(), config_, method, Boundary::kContact,
        std::make_unique<FakeInverter>(
            [this](int call, const SparseData& data, const auto& options, Estimate& estimate) {
              return inversion_(call, data, options, estimate);
            })));
  }
  Result<Update> run(const Observation& one) { return pipeline_.run(one); }
  std::vector<std::string> used() const {
    std::vector<std::string> names;
    for (const DataSource& source : inversion_.seen.sources) names.push_back(source.name);
    return names;
  }

  CaseConfig config_ = test_support::toy_config();
  FakeInversion inversion_;
  Pipeline pipeline_ = pipeline(Method::kCondensed);
};

TEST_F(Sources, AreUsedTogetherTheNewestOfEach) {
  ASSERT_TRUE(run(landmarks_at(1, "ius", 0, 1.0)));
  ASSERT_TRUE(run(landmarks_at(2, "pointer", 10, 2.0)));
  EXPECT_EQ(used(), (std::vector<std::string>{"ius", "pointer"}));
  EXPECT_EQ(inversion_.seen.size(), 8);
  const auto update = value_or_fail(run(landmarks_at(3, "ius", 20, 3.0)));
  EXPECT_EQ(inversion_.seen.size(), 8);
  EXPECT_EQ(inversion_.seen.displacements(0, 0), 3.0);  // the first one of "ius" is gone
  EXPECT_EQ(inversion_.seen.displacements(0, 4), 2.0);
  ASSERT_EQ(update.estimate.sources.size(), 2u);
  EXPECT_EQ(update.estimate.sources[0].observation_sequence, 3u);
  EXPECT_EQ(update.estimate.sources[1].observation_sequence, 2u);
  EXPECT_DOUBLE_EQ(update.estimate.sources[1].age_s, 10.0);
}

TEST_F(Sources, OlderThanTheLimitAreLeftOutAndTheUpdateSaysSo) {
  ASSERT_TRUE(run(landmarks_at(1, "pointer", 0)));
  ASSERT_TRUE(run(landmarks_at(2, "ius", config_.sensing.max_age_s)));
  EXPECT_EQ(inversion_.seen.size(), 8);
  const auto update = value_or_fail(run(landmarks_at(3, "ius", config_.sensing.max_age_s + 1.0)));
  EXPECT_EQ(used(), std::vector<std::string>{"ius"});
  const auto& omissions = update.left_out;
  const auto stale = std::find_if(omissions.begin(), omissions.end(),
                                  [](const Omission& one) { return one.part == "source pointer"; });
  ASSERT_NE(stale, omissions.end());
  EXPECT_THAT(stale->reason, HasSubstr("observation 1 is 121 s old"));
}

// A replay in a cycle begins again at time 0.
TEST_F(Sources, FromTheFutureAreAsOldAsTheyAreNew) {
  ASSERT_TRUE(run(landmarks_at(1, "pointer", 500)));
  ASSERT_TRUE(run(landmarks_at(2, "ius", 0)));
  EXPECT_EQ(used(), std::vector<std::string>{"ius"});
}

TEST_F(Sources, AnObservationWithoutAnEstimateIsForgotten) {
  ASSERT_TRUE(run(landmarks_at(1, "ius", 0)));
  inversion_.fails = true;
  EXPECT_FALSE(run(landmarks_at(2, "pointer", 1)));
  inversion_.fails = false;
  ASSERT_TRUE(run(landmarks_at(3, "ius", 2)));
  EXPECT_EQ(used(), std::vector<std::string>{"ius"});
}

TEST_F(Sources, AnObservationWithAnUnusableEstimateIsTriedBesideTheNext) {
  inversion_.motion_mm = 2.0 * kMaxMotion_mm;
  const auto unusable = run(landmarks_at(1, "pointer", 0));
  ASSERT_TRUE(unusable) << "it is reported, with its reasons";
  EXPECT_EQ(unusable->estimate.quality.quality, Quality::kUnusable);
  EXPECT_FALSE(unusable->estimate.quality.reason.empty());
  inversion_.motion_mm = 1.0;
  const auto after = value_or_fail(run(landmarks_at(2, "ius", 1)));
  EXPECT_TRUE(after.usable());
  EXPECT_EQ(used(), (std::vector<std::string>{"ius", "pointer"}));
  // It is as good as any other now: what spoils the next update is that one's own observation.
  inversion_.spoiler = "stereopsis";
  EXPECT_FALSE(run(landmarks_at(3, "stereopsis", 2))->usable());
  inversion_.spoiler.clear();
  ASSERT_TRUE(run(landmarks_at(4, "ius", 3)));
  EXPECT_EQ(used(), (std::vector<std::string>{"ius", "pointer", "stereopsis"}));
}

// Registration and an inversion that was of no use count for the deadline of the update.
TEST_F(Sources, AnInversionIsToldWhatTheUpdateHasTakenBefore) {
  ASSERT_TRUE(run(landmarks_at(1, "pointer", 0)));
  inversion_.spoiler = "stereopsis";
  ASSERT_FALSE(run(landmarks_at(2, "stereopsis", 1))->usable());
  inversion_.spent_ms.clear();
  ASSERT_TRUE(run(landmarks_at(3, "ius", 2))->usable());
  ASSERT_EQ(inversion_.spent_ms.size(), 2u) << "with the quarantined source, and without";
  EXPECT_GT(inversion_.spent_ms[0], 0.0);
  EXPECT_GT(inversion_.spent_ms[1], inversion_.spent_ms[0]);
}

TEST_F(Sources, AnObservationThatSpoilsTheNextUpdateTooIsForgotten) {
  inversion_.spoiler = "pointer";
  EXPECT_FALSE(run(landmarks_at(1, "pointer", 0))->usable());
  const auto after = value_or_fail(run(landmarks_at(2, "ius", 1)));
  EXPECT_TRUE(after.usable());
  EXPECT_EQ(used(), std::vector<std::string>{"ius"});
  EXPECT_EQ(inversion_.calls, 3);  // alone, beside the next, the next without it
  const auto told = std::find_if(after.left_out.begin(), after.left_out.end(),
                                 [](const Omission& o) { return o.part == "source pointer"; });
  ASSERT_NE(told, after.left_out.end());
  EXPECT_THAT(told->reason, HasSubstr("no usable estimate could be made with observation 1"));
  ASSERT_TRUE(run(landmarks_at(3, "ius", 2)));
  EXPECT_EQ(inversion_.calls, 4);
  EXPECT_EQ(used(), std::vector<std::string>{"ius"});
}

TEST_F(Sources, ANewObservationOfAQuarantinedSourceIsTakenAgain) {
  inversion_.spoiler = "pointer";
  EXPECT_FALSE(run(landmarks_at(1, "pointer", 0))->usable());
  inversion_.spoiler.clear();
  EXPECT_TRUE(run(landmarks_at(2, "pointer", 1))->usable());
  inversion_.spoiler = "ius";
  EXPECT_FALSE(run(landmarks_at(3, "ius", 2))->usable());
  EXPECT_EQ(used(), (std::vector<std::string>{"ius", "pointer"}));  // and not tried without it
  EXPECT_EQ(inversion_.calls, 3);
}

TEST_F(Sources, AQuarantinedSourceThatIsTooOldSpoilsNothing) {
  inversion_.spoiler = "pointer";
  EXPECT_FALSE(run(landmarks_at(1, "pointer", 0))->usable());
  const auto after = value_or_fail(run(landmarks_at(2, "ius", config_.sensing.max_age_s + 1.0)));
  EXPECT_TRUE(after.usable());
  EXPECT_EQ(inversion_.calls, 2);
}

TEST_F(Sources, OfAnEarlierSessionAreForgotten) {
  ASSERT_TRUE(run(landmarks_at(1, "pointer", 0)));
  pipeline_.reset();
  ASSERT_TRUE(run(landmarks_at(2, "ius", 1)));
  EXPECT_EQ(inversion_.seen.size(), 4);
}

TEST_F(Sources, ASurfaceIsMeasuredAnewForTheEstimate) {
  ASSERT_TRUE(run(landmarks_at(1, "ius", 0)));
  ASSERT_TRUE(run(cortex(2, 5)));
  EXPECT_EQ(used(), (std::vector<std::string>{"ius", "stereopsis"}));
  const SparseData& data = inversion_.seen;
  ASSERT_GT(data.size(), 100);
  EXPECT_FALSE(data.along_direction(0));
  for (int i = 4; i < data.size(); ++i) {
    ASSERT_TRUE(data.along_direction(i));
    EXPECT_NEAR(data.directions(2, i), 1.0, 1e-9);
    EXPECT_NEAR(data.displacements(2, i), -2.0, 1e-9);
    EXPECT_NEAR(data.positions(2, i), 60.0, 1e-9);
  }
  EXPECT_EQ(data.common_error.cols(), 6);  // the camera's pose
}

// The estimate of the first update is (0, 0, -1) everywhere; nothing of it enters the second.
TEST_F(Sources, DataThatFollowTheDeformationBeginWhereTheirObservationSays) {
  ASSERT_TRUE(run(cortex(1, 0)));
  ASSERT_TRUE(run(boundary(2, 1)));
  const SparseData second = inversion_.first;
  pipeline_.reset();
  ASSERT_TRUE(run(cortex(1, 0)));
  const SparseData cortex_alone = inversion_.first;
  ASSERT_TRUE(run(boundary(2, 1)));
  EXPECT_EQ(inversion_.first.positions, second.positions);
  EXPECT_EQ(inversion_.first.displacements, second.displacements);
  EXPECT_EQ(Points(second.positions.rightCols(cortex_alone.size())), cortex_alone.positions);
}

TEST_F(Sources, ATumourBoundaryIsMeasuredAnewForTheEstimate) {
  config_.sensing.probe_pose_sd_mm = config_.sensing.probe_pose_sd_deg = 0.5;
  config_.sensing.boundary_average_mm = 0.0;
  pipeline_ = pipeline(Method::kCondensed);
  ASSERT_TRUE(run(boundary(1, 0, Vec3(0, 0, -1))));
  const SparseData& data = inversion_.seen;
  ASSERT_EQ(data.size(), config_.inversion.sparse_points);
  for (int i = 0; i < data.size(); ++i) {
    ASSERT_TRUE(data.along_direction(i));
    // Exact where the fake estimate is the truth.
    EXPECT_NEAR(data.directions.col(i).dot(data.displacements.col(i)), -data.directions(2, i),
                1e-9);
  }
  // The probe's pose, whose size is known, and what neighbours on the outline are off by alike.
  ASSERT_GT(data.common_error.cols(), 6);
  ASSERT_EQ(data.common_variance.rows(), data.common_error.cols());
  EXPECT_TRUE(data.common_variance.topRows(6).isOnes(0.0));
  EXPECT_TRUE(data.common_variance.bottomRows(1).leftCols(1).isZero(0.0)) << "none";
  for (int i = 0; i < data.size(); ++i) {  // along the normal
    const auto own = data.common_error.middleRows<3>(3 * i).rightCols(1);
    EXPECT_NEAR(own.norm(), std::abs(data.directions.col(i).dot(own.col(0))), 1e-12);
  }
  config_.sensing.boundary_outline_errors = false;
  pipeline_ = pipeline(Method::kCondensed);
  ASSERT_TRUE(run(boundary(1, 0, Vec3(0, 0, -1))));
  EXPECT_EQ(inversion_.seen.common_error.cols(), 6);
  EXPECT_EQ(inversion_.seen.common_variance.size(), 0);
}

TEST_F(Sources, OfVeryManyPointsAPartIsMeasuredAndSaysTheSame) {
  config_.sensing.boundary_average_mm = 0.0;
  pipeline_ = pipeline(Method::kCondensed);
  Observation many = boundary(1, 0);
  auto& points = std::get<TumourBoundary>(many.body).points;
  points = geometry::sample_surface(patient()->tumour, 4 * kMostAligned, 5);
  points.colwise() += Vec3(0, 0, -1);
  // More gross errors than points that may be looked at.
  for (Eigen::Index i = 0; i < points.cols(); i += 3) points.col(i) += Vec3(0, 0, 12);
  const auto update = run(many);
  ASSERT_TRUE(update);
  const SparseData data = inversion_.seen;
  ASSERT_EQ(data.size(), config_.inversion.sparse_points);
  int off = 0;  // a gross error may come to lie on the tumour
  for (int i = 0; i < data.size(); ++i) {
    off += std::abs(data.directions.col(i).dot(data.displacements.col(i)) + data.directions(2, i)) >
           0.05;
  }
  EXPECT_LT(off, data.size() / 10);
  EXPECT_GT(update->estimate.sources.front().outliers, kMostAligned / 4);
  EXPECT_LT(update->estimate.sources.front().outliers, kMostAligned / 2);

  Observation wide = cortex(1, 0);
  auto& vertices = std::get<CorticalSurface>(wide.body).surface.vertices;
  vertices = vertices.replicate(1, 2 * kMostMeasured / vertices.cols()).eval();
  ASSERT_TRUE(run(wide));
  EXPECT_EQ(inversion_.seen.size(),
            config_.inversion.sparse_points + config_.sensing.surface_points);
}

// The noise of neighbours is averaged. What the alignment leaves differs among them, so that an
// average is not exact where the points are.
TEST_F(Sources, APointOfATumourBoundaryStandsForItsNeighbours) {
  const auto seen = [this](double average_mm) {
    config_.sensing.boundary_average_mm = average_mm;
    pipeline_ = pipeline(Method::kCondensed);
    EXPECT_TRUE(run(boundary(1, 0, Vec3(0, 0, -1))));
    return inversion_.seen;
  };
  const SparseData alone = seen(0.0), averaged = seen(3.0);
  ASSERT_EQ(averaged.size(), config_.inversion.sparse_points);
  EXPECT_LT(averaged.sd_mm.minCoeff(), alone.sd_mm.minCoeff());
  double squares = 0.0;
  for (int i = 0; i < averaged.size(); ++i) {
    const double off =
        averaged.directions.col(i).dot(averaged.displacements.col(i)) + averaged.directions(2, i);
    squares += off * off;
  }
  EXPECT_LT(std::sqrt(squares / averaged.size()), 0.05);
}

TEST_F(Sources, ATrackersErrorsAddToTheNoiseOfABoundary) {
  const auto sd = [this] {
    pipeline_ = pipeline(Method::kCondensed);
    EXPECT_TRUE(run(boundary(1, 0, Vec3(0, 0, -1))));
    return VecX(inversion_.seen.sd_mm);
  };
  config_.sensing.boundary_error_sd_mm = 0.0;
  const VecX without = sd();
  config_.sensing.boundary_error_sd_mm = 0.4;
  const VecX with = sd();
  ASSERT_EQ(with.size(), without.size());
  ASSERT_GT(with.size(), 0);
  EXPECT_NEAR((with.cwiseAbs2() - without.cwiseAbs2() - VecX::Constant(with.size(), 0.16))
                  .cwiseAbs()
                  .maxCoeff(),
              0.0, 1e-12);
}

TEST_F(Sources, LandmarksShareTheErrorOfTheirImagesRegistration) {
  ASSERT_TRUE(run(landmarks_at(1, "ius", 0)));
  EXPECT_EQ(inversion_.seen.common_error.size(), 0);
  config_.sensing.landmark_pose_sd_mm = 2.0;
  config_.sensing.landmark_pose_sd_deg = 1.0;
  pipeline_ = pipeline(Method::kCondensed);
  ASSERT_TRUE(run(landmarks_at(1, "ius", 0)));
  ASSERT_EQ(inversion_.seen.common_error.cols(), 6);
  EXPECT_EQ(inversion_.seen.common_error(0, 0), 2.0);
}

TEST_F(Sources, TheNodesOfSeveralSurfacesAreAskedForTogether) {
  config_.sensing.boundary_average_mm = 0.0;  // an average is not exact, as below
  pipeline_ = pipeline(Method::kCondensed);
  ASSERT_TRUE(run(boundary(1, 0, Vec3(0, 0, -1))));
  const std::vector<NodeIndex> of_tumour = inversion_.nodes;
  ASSERT_TRUE(run(cortex(2, 1)));
  const std::vector<NodeIndex>& all = inversion_.nodes;
  EXPECT_TRUE(std::is_sorted(all.begin(), all.end()));
  EXPECT_EQ(std::adjacent_find(all.begin(), all.end()), all.end());
  EXPECT_TRUE(std::includes(all.begin(), all.end(), of_tumour.begin(), of_tumour.end()));
  std::vector<NodeIndex> craniotomy = patient()->craniotomy;
  std::sort(craniotomy.begin(), craniotomy.end());
  EXPECT_TRUE(std::includes(all.begin(), all.end(), craniotomy.begin(), craniotomy.end()));
  // Each surface moved by its own nodes: both are exact for the fake estimate.
  const SparseData& data = inversion_.seen;
  ASSERT_EQ(data.sources.size(), 2u);
  for (int i = 0; i < data.size(); ++i) {
    const double expected = i < data.sources[0].count ? -data.directions(2, i) : -2.0;
    EXPECT_NEAR(data.directions.col(i).dot(data.displacements.col(i)), expected, 1e-9);
  }
}

TEST_F(Sources, ATumourBoundaryGuidesByARigidAlignmentWhereTheCaseOrTheMethodSaysSo) {
  const auto is_rigid = [&] {
    EXPECT_EQ(inversion_.seen.size(), config_.inversion.sparse_points);
    EXPECT_EQ(inversion_.seen.directions.cols(), 0);
    EXPECT_EQ(inversion_.seen.common_error.cols(), 12);
    for (int i = 0; i < inversion_.seen.size(); ++i) {
      EXPECT_NEAR(inversion_.seen.displacements(2, i), -1.0, 0.01);
    }
  };
  for (const Method method : kAllMethods) {
    if (method == Method::kCondensed) continue;
    ASSERT_TRUE(pipeline(method).run(boundary(1, 0, Vec3(0, 0, -1))));
    is_rigid();
  }
  config_.sensing.tumour = SurfaceGuidance::kRigid;
  ASSERT_TRUE(pipeline(Method::kCondensed).run(boundary(1, 0, Vec3(0, 0, -1))));
  is_rigid();
}

// A ball's rotation is left out of its alignment. Distances do not depend on it.
TEST_F(Sources, DistancesLeaveNoRotationOut) {
  const auto names_rotation = [&](Pipeline pipeline) {
    const auto update = value_or_fail(pipeline.run(boundary(1, 0)));
    return std::any_of(update.left_out.begin(), update.left_out.end(),
                       [](const Omission& one) { return one.part == "rotation"; });
  };
  EXPECT_FALSE(names_rotation(pipeline(Method::kCondensed)));
  config_.scene.rotation = Carry::kOff;
  EXPECT_FALSE(names_rotation(pipeline(Method::kCondensed)));
  config_.sensing.tumour = SurfaceGuidance::kRigid;
  EXPECT_TRUE(names_rotation(pipeline(Method::kCondensed)));
}

TEST_F(Sources, ASurfaceGuidesOtherMethodsByARigidAlignment) {
  ASSERT_TRUE(pipeline(Method::kPaper).run(cortex(1, 0)));
  for (int i = 0; i < inversion_.seen.size(); ++i) {
    EXPECT_FALSE(inversion_.seen.along_direction(i));
    EXPECT_NEAR(inversion_.seen.displacements(2, i), -2.0, 0.01);
  }
}

TEST_F(Sources, ASurfaceInMetresIsRefusedAndTheOthersGoOn) {
  ASSERT_TRUE(run(landmarks_at(1, "ius", 0)));
  Observation metres = cortex(2, 1);
  std::get<CorticalSurface>(metres.body).surface.vertices *= 1e-3;
  EXPECT_THAT(sentence_of(run(metres)), HasSubstr("metres"));
  ASSERT_TRUE(run(landmarks_at(3, "ius", 2)));
  EXPECT_EQ(used(), std::vector<std::string>{"ius"});
}

TEST_F(Sources, PointsThatTheAlignmentLeavesAsideGuideNothing) {
  Observation made = observation(1, "ius", 0);
  TumourBoundary body;
  body.points = patient()->tumour.vertices;
  body.sd_mm = 0.3;
  for (Eigen::Index i = 0; i < body.points.cols(); i += 10) body.points.col(i) += Vec3(0, 30, 25);
  made.body = body;
  const auto update = value_or_fail(run(made));
  EXPECT_LT(inversion_.seen.displacements.colwise().norm().maxCoeff(), 0.6);
  EXPECT_LT((inversion_.seen.positions.row(2).array() - 40.0).maxCoeff(), 11.0);
  EXPECT_EQ(update.estimate.sources.at(0).outliers, (body.points.cols() + 9) / 10);
}

}  // namespace
}  // namespace brainshift::pipeline
