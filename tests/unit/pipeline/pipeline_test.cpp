// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/pipeline/pipeline.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <set>
#include <utility>

#include "common/core/random.hpp"
#include "common/pipeline/registration_stage.hpp"
#include "common/pipeline/scene.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/server/fake_inverter.hpp"

namespace brainshift::pipeline {
namespace {

using server::FakeInverter;
using server::kCase;
using server::landmarks;
using testing::HasSubstr;

// Ellipsoid about the origin, latitude and longitude triangles; closed up to its two small polar
// caps.
TriangleSurface ellipsoid(const Vec3& axes) {
  constexpr int kRings = 24;
  constexpr int kSectors = 48;
  TriangleSurface surface;
  surface.vertices.resize(3, (kRings + 1) * kSectors);
  for (int r = 0; r <= kRings; ++r) {
    for (int s = 0; s < kSectors; ++s) {
      const double theta = std::numbers::pi * (r + 0.001) / (kRings + 0.002);
      const double phi = 2.0 * std::numbers::pi * s / kSectors;
      surface.vertices.col(r * kSectors + s) = axes.cwiseProduct(
          Vec3(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)));
    }
  }
  surface.triangles.resize(3, 2 * kRings * kSectors);
  int t = 0;
  for (int r = 0; r < kRings; ++r) {
    for (int s = 0; s < kSectors; ++s) {
      const int a = r * kSectors + s;
      const int b = r * kSectors + (s + 1) % kSectors;
      surface.triangles.col(t++) << a, a + kSectors, b;
      surface.triangles.col(t++) << b, a + kSectors, b + kSectors;
    }
  }
  return surface;
}

// A cube of the given edge as five tetrahedra.
TetMesh cube(double edge) {
  TetMesh mesh;
  mesh.nodes.resize(3, 8);
  for (int i = 0; i < 8; ++i) mesh.nodes.col(i) = edge * Vec3(i & 1, (i >> 1) & 1, (i >> 2) & 1);
  mesh.tets.resize(4, 5);
  mesh.tets.col(0) << 0, 1, 2, 4;
  mesh.tets.col(1) << 1, 3, 2, 7;
  mesh.tets.col(2) << 1, 5, 7, 4;
  mesh.tets.col(3) << 2, 7, 6, 4;
  mesh.tets.col(4) << 1, 2, 4, 7;
  for (int t = 0; t < 5; ++t) {
    const Vec3 o = mesh.nodes.col(mesh.tets(0, t));
    const Vec3 a = mesh.nodes.col(mesh.tets(1, t)) - o;
    const Vec3 b = mesh.nodes.col(mesh.tets(2, t)) - o;
    const Vec3 c = mesh.nodes.col(mesh.tets(3, t)) - o;
    if (a.dot(b.cross(c)) < 0) std::swap(mesh.tets(2, t), mesh.tets(3, t));
  }
  return mesh;
}

BrainModel model(const Vec3& tumour_axes = {16, 11, 8}) {
  BrainModel model;
  model.case_id = kCase;
  model.model_id = "0123456789abcdef";
  model.mesh = cube(100.0);
  model.tumour = ellipsoid(tumour_axes);
  return model;
}

Observation boundary_moved_by(const Vec3& shift) {
  TumourBoundary boundary;
  boundary.points = ellipsoid({16, 11, 8}).vertices.colwise() + shift;
  boundary.sd_mm = 0.5;
  Observation observation = landmarks(7, "ius");
  observation.body = boundary;
  return observation;
}

const Omission* left_out(const Update& update, const std::string& part) {
  for (const Omission& omission : update.left_out) {
    if (omission.part == part) return &omission;
  }
  return nullptr;
}

class PipelineTest : public testing::Test {
 protected:
  // An inversion that remembers what it was given.
  std::unique_ptr<FakeInverter> remembering() {
    return std::make_unique<FakeInverter>(
        [this](int, const SparseData& data, const auto&, Estimate& estimate) -> Status {
          seen_ = data;
          estimate.status = EstimateStatus::kConverged;
          estimate.displacement = Points::Zero(3, 8);
          return {};
        });
  }
  Pipeline pipeline(const BrainModel& brain, std::unique_ptr<inversion::Inverter> inverter) {
    return value_or_fail(Pipeline::build(brain, config_, method_, boundary_, std::move(inverter)));
  }
  Result<Update> run(const Observation& observation, const BrainModel& brain = model()) {
    return pipeline(brain, remembering()).run(observation);
  }
  Result<Update> run_with(FakeInverter::Update inversion, const RunOptions& options = {}) {
    return pipeline(model(), std::make_unique<FakeInverter>(std::move(inversion)))
        .run(landmarks(1), options);
  }

  CaseConfig config_;
  Method method_ = Method::kPaper;
  Boundary boundary_ = Boundary::kContact;
  std::optional<SparseData> seen_;
};

TEST_F(PipelineTest, LandmarksBecomeTheirDisplacementsWithTheCasesSigma) {
  config_.inversion.sigma_mm = 0.25;
  const auto update = value_or_fail(run(landmarks(3)));
  ASSERT_EQ(seen_->size(), 4);
  EXPECT_EQ(seen_->displacements, Points(Vec3(1, 0, 0).replicate(1, 4)));
  EXPECT_EQ(seen_->positions, std::get<LandmarkPairs>(landmarks(3).body).undeformed);
  EXPECT_EQ(seen_->sd_mm, VecX(VecX::Constant(4, 0.25)));
  EXPECT_TRUE(update.T_undeformed_deformed.isApprox(RigidTransform::Identity()));
  EXPECT_EQ(update.observation_sequence, 3u);
  EXPECT_EQ(update.case_id, kCase);
  EXPECT_TRUE(update.final);
}

TEST_F(PipelineTest, ManyLandmarksWeighAsMuchInGroups) {
  method_ = Method::kCondensed;
  config_.inversion.sigma_mm = 0.25;
  Random random(4);
  Mat3 strain;
  for (double& entry : strain.reshaped()) entry = 0.02 * random.normal();
  LandmarkPairs pairs{Points(3, 900), Points(3, 900), 0.1};
  for (int i = 0; i < 900; ++i) {  // no two within kOneFeature_mm
    pairs.undeformed.col(i) = 10.0 * Vec3(i % 10, (i / 10) % 10, i / 100);
    for (double& x : pairs.undeformed.col(i)) x += 7.0 * random.uniform();
  }
  pairs.deformed = pairs.undeformed + strain * pairs.undeformed;
  Observation observation = landmarks(1);
  observation.body = pairs;
  ASSERT_TRUE(run(observation).has_value());
  ASSERT_EQ(seen_->size(), kMostLandmarks);
  EXPECT_NEAR(seen_->sd_mm.cwiseAbs2().cwiseInverse().sum(), 900 / (0.25 * 0.25), 1e-6);
  EXPECT_TRUE(seen_->displacements.isApprox(strain * seen_->positions, 1e-12));
}

TEST_F(PipelineTest, ManyLandmarksOfOneFeatureWeighAsOne) {
  method_ = Method::kCondensed;
  config_.inversion.sigma_mm = 0.25;
  Random random(4);
  LandmarkPairs pairs{Points(3, 900), Points(3, 900), 0.1};
  for (int i = 0; i < 900; ++i) {
    pairs.undeformed.col(i) = 10.0 * Vec3(i % 10, (i / 10) % 10, 0);
    for (double& x : pairs.undeformed.col(i)) x += 0.5 * random.uniform();
  }
  pairs.deformed = pairs.undeformed.colwise() + Vec3(1, 0, 0);
  Observation observation = landmarks(1);
  observation.body = pairs;
  ASSERT_TRUE(run(observation).has_value());
  ASSERT_EQ(seen_->size(), 100);
  EXPECT_EQ(seen_->sd_mm, VecX(VecX::Constant(100, 0.25)));
  EXPECT_TRUE(seen_->displacements.isApprox(Points(Vec3(1, 0, 0).replicate(1, 100))));
}

TEST_F(PipelineTest, AShiftedTumourBoundaryGivesBackItsShift) {
  const Vec3 shift(1.5, -2.0, 1.0);
  const auto update = value_or_fail(run(boundary_moved_by(shift)));
  EXPECT_LT((update.T_undeformed_deformed.translation() + shift).norm(), 0.05);
  ASSERT_EQ(seen_->size(), CaseConfig{}.inversion.sparse_points);
  EXPECT_LT((seen_->displacements.colwise() - shift).colwise().norm().maxCoeff(), 0.1);
}

TEST_F(PipelineTest, GuidingPointsAreDistinctAndTheSameInEveryRun) {
  Pipeline once = pipeline(model(), remembering());
  ASSERT_TRUE(once.run(boundary_moved_by({1, 0, 0})).has_value());
  const SparseData first = *seen_;
  ASSERT_TRUE(once.run(boundary_moved_by({1, 0, 0})).has_value());
  EXPECT_EQ(first.positions, seen_->positions);
  std::set<std::pair<double, std::pair<double, double>>> distinct;
  for (int i = 0; i < first.size(); ++i) {
    distinct.insert({first.positions(0, i), {first.positions(1, i), first.positions(2, i)}});
  }
  EXPECT_EQ(static_cast<int>(distinct.size()), first.size());
}

TEST_F(PipelineTest, FewerBoundaryPointsThanWantedAreAllUsed) {
  config_.inversion.sparse_points = 1'000'000;
  const Observation observation = boundary_moved_by({1, 0, 0});
  ASSERT_TRUE(run(observation).has_value());
  EXPECT_EQ(seen_->size(), std::get<TumourBoundary>(observation.body).points.cols());
}

TEST_F(PipelineTest, RefusesWhatIsNotAssimilated) {
  Observation observation = landmarks(1);
  observation.body = CorticalSurface{};
  const auto surface = run(observation);
  EXPECT_THAT(refusal_of(surface, ErrorCode::kEmptySet),
              HasSubstr("craniotomy of the model has no triangle"));
  config_.scene.surface = Carry::kOff;
  EXPECT_THAT(refusal_of(run(observation), ErrorCode::kInvalidArgument),
              HasSubstr("scene.surface = off"));
  observation.body = PatientPose{};
  EXPECT_THAT(sentence_of(run(observation)), HasSubstr("patient_pose is not assimilated"));
  EXPECT_FALSE(seen_.has_value());
}

TEST_F(PipelineTest, RefusesLandmarksThatDoNotPairUpOrAreTooFew) {
  Observation observation = landmarks(1);
  auto& pairs = std::get<LandmarkPairs>(observation.body);
  pairs.deformed.conservativeResize(3, 3);
  EXPECT_THAT(sentence_of(run(observation)), HasSubstr("4 undeformed but 3 deformed"));

  pairs.undeformed.conservativeResize(3, 2);
  pairs.deformed.conservativeResize(3, 2);
  refusal_of(run(observation), ErrorCode::kInvalidArgument);
  EXPECT_FALSE(seen_.has_value());
}

TEST_F(PipelineTest, AnErrorOfTheInversionPassesThroughUnchanged) {
  const auto update = run_with([](int, const SparseData&, const auto&, auto&) -> Status {
    return fail(ErrorCode::kNotConverged, "the reason");
  });
  EXPECT_EQ(refusal_of(update, ErrorCode::kNotConverged), "the reason");
}

TEST_F(PipelineTest, IteratesAreMarkedAndTheStopTokenReachesTheInversion) {
  std::stop_source stop;
  bool stoppable = false;
  std::vector<Update> iterates;
  RunOptions options;
  options.stop = stop.get_token();
  options.on_iterate = [&](Update update) { iterates.push_back(std::move(update)); };
  const auto update = value_or_fail(run_with(
      [&](int, const SparseData&, const auto& asked, Estimate& estimate) -> Status {
        stoppable = asked.stop.stop_possible();
        Estimate iterate;
        iterate.status = EstimateStatus::kIterating;
        iterate.displacement = Points::Ones(3, 8);
        asked.on_iterate(iterate);
        estimate.status = EstimateStatus::kConverged;
        estimate.displacement = Points::Zero(3, 8);
        return {};
      },
      options));
  ASSERT_EQ(iterates.size(), 1u);
  EXPECT_FALSE(iterates[0].final);
  EXPECT_EQ(iterates[0].observation_sequence, 1u);
  EXPECT_EQ(iterates[0].estimate.displacement(0, 0), 1.0);
  EXPECT_TRUE(update.final);
  EXPECT_EQ(update.estimate.status, EstimateStatus::kConverged);
  EXPECT_TRUE(stoppable);
}

// The inverter writes where the update is read: no copy between them.
TEST_F(PipelineTest, TheInverterWritesIntoTheUpdateItself) {
  const double* written = nullptr;
  const auto update =
      value_or_fail(run_with([&](int, const SparseData&, const auto&, auto& estimate) -> Status {
        estimate.displacement = Points::Zero(3, 8);
        written = estimate.displacement.data();
        return {};
      }));
  EXPECT_EQ(update.estimate.displacement.data(), written);
}

TEST_F(PipelineTest, ResetForgetsEvidenceAndTheInvertersState) {
  auto inverter = remembering();
  const FakeInverter& watched = *inverter;
  Pipeline two = pipeline(model(), std::move(inverter));
  ASSERT_TRUE(two.run(landmarks(1, "ius")).has_value());
  ASSERT_TRUE(two.run(landmarks(2, "pointer")).has_value());
  EXPECT_EQ(seen_->sources.size(), 2u);
  two.reset();
  EXPECT_EQ(watched.resets, 1);
  ASSERT_TRUE(two.run(landmarks(1, "pointer")).has_value());
  EXPECT_EQ(seen_->sources.size(), 1u);
}

// ---------- what an update says it leaves out ----------

TEST_F(PipelineTest, SaysWhatItLeavesOut) {
  const auto contact = value_or_fail(run(landmarks(1)));
  EXPECT_NE(left_out(contact, "pressure"), nullptr);
  EXPECT_NE(left_out(contact, "uncertainty"), nullptr);
  EXPECT_EQ(left_out(contact, "contact"), nullptr);
  boundary_ = Boundary::kFixed;
  const auto fixed = value_or_fail(run(landmarks(1)));
  ASSERT_NE(left_out(fixed, "contact"), nullptr);
  // The paper's Table: 3.4 mm at the craniotomy without contact, 1.6 mm with it.
  EXPECT_THAT(left_out(fixed, "contact")->estimated_error, HasSubstr("3.4 mm of error remain"));
  for (const Omission& omission : fixed.left_out) {
    EXPECT_FALSE(omission.reason.empty()) << omission.part;
    EXPECT_FALSE(omission.estimated_error.empty()) << omission.part;
  }
}

TEST_F(PipelineTest, MethodsOtherThanCondensedLeaveUncertaintyOut) {
  for (const Method method : kAllMethods) {
    method_ = method;
    const auto update = value_or_fail(run(landmarks(1)));
    EXPECT_EQ(left_out(update, "uncertainty") != nullptr, method != Method::kCondensed)
        << to_string(method);
  }
  method_ = Method::kCondensed;
  config_.scene.uncertainty = Carry::kOff;
  const auto update = value_or_fail(run(landmarks(1)));
  EXPECT_NE(left_out(update, "uncertainty"), nullptr);
}

TEST_F(PipelineTest, ListsWhatTheInversionLeftOut) {
  config_.scene.far_field = Carry::kOff;
  method_ = Method::kCondensed;
  auto inverter = remembering();
  FakeInverter& leaving_out = *inverter;
  Pipeline built = pipeline(model(), std::move(inverter));
  const auto without_errors = value_or_fail(built.run(landmarks(1)));
  EXPECT_EQ(left_out(without_errors, "far field"), nullptr);
  leaving_out.errors = inversion::OmissionErrors{};
  leaving_out.errors->far_field_mm = 0.25;
  const auto update = value_or_fail(built.run(landmarks(2)));
  EXPECT_NE(left_out(update, "far field"), nullptr);
}

// A sphere shows no rotation: it is left out, unless it is forced on.
TEST_F(PipelineTest, ReportsRotationThatASphereCannotShowUnlessItIsForcedOn) {
  const BrainModel sphere = model({10, 10, 10});
  Observation observation = landmarks(1);
  observation.body = TumourBoundary{sphere.tumour.vertices.colwise() + Vec3(1, 0, 0), 0.5};
  const auto update = value_or_fail(run(observation, sphere));
  ASSERT_NE(left_out(update, "rotation"), nullptr);
  EXPECT_THAT(left_out(update, "rotation")->reason,
              HasSubstr("no rotation is shown by the points"));
  config_.scene.rotation = Carry::kOn;
  const auto forced = value_or_fail(run(observation, sphere));
  EXPECT_EQ(left_out(forced, "rotation"), nullptr);
}

TEST_F(PipelineTest, RotationForcedOffAlignsATranslationAndSaysSo) {
  const BrainModel brain = model({20, 10, 15});
  Observation observation = landmarks(1);
  observation.body = TumourBoundary{
      Eigen::AngleAxisd(0.05, Vec3::UnitZ()).toRotationMatrix() * brain.tumour.vertices, 0.5};
  const auto with = value_or_fail(run(observation, brain));
  config_.scene.rotation = Carry::kOff;
  const auto without = value_or_fail(run(observation, brain));
  EXPECT_EQ(left_out(with, "rotation"), nullptr);
  EXPECT_GT((with.T_undeformed_deformed.linear() - Mat3::Identity()).norm(), 0.03);
  EXPECT_NE(left_out(without, "rotation"), nullptr);
  EXPECT_TRUE(without.T_undeformed_deformed.linear().isIdentity(1e-12));
}

TEST_F(PipelineTest, NeedsATumourSurface) {
  BrainModel without = model();
  without.tumour = {};
  refusal_of(Pipeline::build(without, {}, method_, boundary_, remembering()), ErrorCode::kEmptySet);
}

// R^2 / c_v by hand: a cube of 100 mm has the volume of a ball of 62.035 mm; Table 1 gives
// lambda = 24150 Pa, c_v = 1e-7 * 28350 = 2.835e-3 m^2/s.
TEST(ConsolidationTime, AgreesWithHandCalculation) {
  EXPECT_NEAR(consolidation_time_s(cube(100.0), Material{}), 0.062035 * 0.062035 / 2.835e-3, 1e-4);
}

TEST(ConsolidationTime, FollowsTheMaterialOfTheCase) {
  const double table = consolidation_time_s(cube(100.0), Material{});
  Material tight;
  tight.permeability_m3_s_kg = 1e-9;
  EXPECT_NEAR(consolidation_time_s(cube(100.0), tight), 100.0 * table, 1e-9 * table);
  // Fluid that can be stored drains later; S = 1 / (lambda + 2 G) doubles the capacity.
  Material storing;
  storing.storage_per_pa = 1.0 / 28350.0;
  EXPECT_NEAR(consolidation_time_s(cube(100.0), storing), 2.0 * table, 1e-9 * table);
  Material uncoupled;
  uncoupled.biot_coefficient = 0.0;
  EXPECT_EQ(consolidation_time_s(cube(100.0), uncoupled), 0.0);
}

TEST(ConsolidationTime, GrowsWithTheSquareOfTheSize) {
  const double small = consolidation_time_s(cube(50.0), Material{});
  ASSERT_GT(small, 0.0);
  EXPECT_NEAR(consolidation_time_s(cube(100.0), Material{}) / small, 4.0, 1e-12);
}

// Terzaghi's layer of thickness 1, drained at x = 0, sealed at x = 1, in finite differences: the
// pressure that is left is the settlement that is missing.
TEST(UndrainedFraction, BoundsWhatALayerThatConsolidatesIsMissing) {
  constexpr int kCells = 100;
  constexpr double kStep = 0.4 / (kCells * kCells);  // explicit Euler is stable below 0.5 h^2
  VecX pressure = VecX::Ones(kCells);
  double time = 0.0;
  for (const double until : {0.01, 0.1, 0.5, 1.0, 2.0}) {
    for (; time < until; time += kStep) {
      const VecX old = pressure;
      for (int i = 0; i < kCells; ++i) {
        const double below = i == 0 ? -old[0] : old[i - 1];  // p = 0 on the face
        const double above = i == kCells - 1 ? old[i] : old[i + 1];
        pressure[i] += kStep * kCells * kCells * (below - 2.0 * old[i] + above);
      }
    }
    EXPECT_LE(pressure.mean(), undrained_fraction(time, 1.0)) << until;
    EXPECT_LE(undrained_fraction(time, 1.0), implicit_step_fraction(time, 1.0)) << until;
    EXPECT_GE(pressure.mean(), 0.7 * undrained_fraction(time, 1.0)) << until;
  }
}

// What stands for any allocation of an update that fails.
TEST_F(PipelineTest, AnExceptionCostsOneObservationAndItsInverter) {
  int made = 0;
  const MakeInverter another = [&]() -> Result<std::unique_ptr<inversion::Inverter>> {
    if (++made == 1) return fail(ErrorCode::kInternal, "no memory yet");
    return remembering();
  };
  auto broken = std::make_unique<FakeInverter>(
      [](int, const SparseData&, const auto&, Estimate&) -> Status { throw std::bad_alloc(); });
  auto pipeline = value_or_fail(
      Pipeline::build(model(), config_, method_, boundary_, std::move(broken), another));
  EXPECT_THROW((void)pipeline.run(landmarks(1, "pointer")), std::bad_alloc);
  EXPECT_EQ(refusal_of(pipeline.run(landmarks(2, "ius")), ErrorCode::kInternal), "no memory yet");
  ASSERT_TRUE(pipeline.run(landmarks(3, "ius")));
  EXPECT_EQ(made, 2);
  EXPECT_EQ(seen_->size(), 4) << "nothing of the first is left";
}

}  // namespace
}  // namespace brainshift::pipeline
