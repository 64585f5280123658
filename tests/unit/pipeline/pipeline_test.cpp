// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/pipeline/pipeline.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <set>
#include <utility>

#include "common/pipeline/scene.hpp"
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

// An inversion that remembers what it was given.
struct FakeEstimator {
  std::shared_ptr<std::optional<SparseData>> seen = std::make_shared<std::optional<SparseData>>();
  std::unique_ptr<FakeInverter> make() const {
    return std::make_unique<FakeInverter>(
        [seen = seen](int, const SparseData& data, const auto&, Estimate& estimate) -> Status {
          *seen = data;
          estimate.status = EstimateStatus::kConverged;
          estimate.displacement = Points::Zero(3, 8);
          return {};
        });
  }
};

Pipeline pipeline_on(const BrainModel& brain, const CaseConfig& config = {},
                     std::unique_ptr<inversion::Inverter> inverter = FakeEstimator{}.make(),
                     Method method = Method::kPaper, Boundary boundary = Boundary::kContact) {
  auto built = Pipeline::build(brain, config, method, boundary, std::move(inverter));
  EXPECT_TRUE(built.has_value());
  return std::move(*built);
}

Pipeline pipeline(const FakeEstimator& inversion, Boundary boundary = Boundary::kContact,
                  const CaseConfig& config = {}, Method method = Method::kPaper) {
  return pipeline_on(model(), config, inversion.make(), method, boundary);
}

Observation boundary_moved_by(const Vec3& shift) {
  TumourBoundary boundary;
  boundary.points = ellipsoid({16, 11, 8}).vertices.colwise() + shift;
  boundary.sd_mm = 0.5;
  Observation observation = landmarks(7, "ius");
  observation.body = boundary;
  return observation;
}

bool leaves_out(const Update& update, const std::string& part) {
  for (const Omission& omission : update.left_out) {
    if (omission.part == part) return true;
  }
  return false;
}

TEST(Pipeline, LandmarksBecomeTheirDisplacementsWithTheCasesSigma) {
  const FakeEstimator inversion;
  CaseConfig config;
  config.inversion.sigma_mm = 0.25;
  const auto update = pipeline(inversion, Boundary::kContact, config).run(landmarks(3), {});
  ASSERT_TRUE(update.has_value());
  const SparseData& data = inversion.seen->value();
  ASSERT_EQ(data.size(), 4);
  EXPECT_EQ(data.displacements, Points(Vec3(1, 0, 0).replicate(1, 4)));
  EXPECT_EQ(data.positions, std::get<LandmarkPairs>(landmarks(3).body).undeformed);
  EXPECT_EQ(data.sd_mm, VecX(VecX::Constant(4, 0.25)));
  EXPECT_TRUE(update->T_undeformed_deformed.isApprox(RigidTransform::Identity()));
  EXPECT_EQ(update->observation_sequence, 3u);
  EXPECT_EQ(update->case_id, kCase);
  EXPECT_TRUE(update->final);
}

TEST(Pipeline, AShiftedTumourBoundaryGivesBackItsShift) {
  const FakeEstimator inversion;
  const Vec3 shift(1.5, -2.0, 1.0);
  const auto update = pipeline(inversion).run(boundary_moved_by(shift), {});
  ASSERT_TRUE(update.has_value());
  EXPECT_LT((update->T_undeformed_deformed.translation() + shift).norm(), 0.05);
  const SparseData& data = inversion.seen->value();
  ASSERT_EQ(data.size(), CaseConfig{}.inversion.sparse_points);
  EXPECT_LT((data.displacements.colwise() - shift).colwise().norm().maxCoeff(), 0.1);
}

TEST(Pipeline, GuidingPointsAreDistinctAndTheSameInEveryRun) {
  const FakeEstimator inversion;
  Pipeline once = pipeline(inversion);
  ASSERT_TRUE(once.run(boundary_moved_by({1, 0, 0}), {}).has_value());
  const SparseData first = inversion.seen->value();
  ASSERT_TRUE(once.run(boundary_moved_by({1, 0, 0}), {}).has_value());
  const SparseData second = inversion.seen->value();
  EXPECT_EQ(first.positions, second.positions);
  std::set<std::pair<double, std::pair<double, double>>> distinct;
  for (int i = 0; i < first.size(); ++i) {
    distinct.insert({first.positions(0, i), {first.positions(1, i), first.positions(2, i)}});
  }
  EXPECT_EQ(static_cast<int>(distinct.size()), first.size());
}

TEST(Pipeline, FewerBoundaryPointsThanWantedAreAllUsed) {
  const FakeEstimator inversion;
  CaseConfig config;
  config.inversion.sparse_points = 1'000'000;
  const Observation observation = boundary_moved_by({1, 0, 0});
  ASSERT_TRUE(pipeline(inversion, Boundary::kContact, config).run(observation, {}).has_value());
  EXPECT_EQ(inversion.seen->value().size(),
            std::get<TumourBoundary>(observation.body).points.cols());
}

TEST(Pipeline, RefusesWhatIsNotAssimilated) {
  const FakeEstimator inversion;
  Observation observation = landmarks(1);
  observation.body = CorticalSurface{};
  const auto surface = pipeline(inversion).run(observation, {});
  ASSERT_FALSE(surface.has_value());
  EXPECT_EQ(surface.error().code, ErrorCode::kEmptySet);
  EXPECT_THAT(surface.error().message, HasSubstr("craniotomy of the model has no triangle"));
  CaseConfig without_surface;
  without_surface.scene.surface = Carry::kOff;
  const auto off = pipeline(inversion, Boundary::kContact, without_surface).run(observation, {});
  ASSERT_FALSE(off.has_value());
  EXPECT_EQ(off.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(off.error().message, HasSubstr("scene.surface = off"));
  observation.body = PatientPose{};
  const auto pose = pipeline(inversion).run(observation, {});
  ASSERT_FALSE(pose.has_value());
  EXPECT_THAT(pose.error().message, HasSubstr("patient_pose is not assimilated"));
  EXPECT_FALSE(inversion.seen->has_value());
}

TEST(Pipeline, RefusesLandmarksThatDoNotPairUpOrAreTooFew) {
  const FakeEstimator inversion;
  Observation observation = landmarks(1);
  auto& pairs = std::get<LandmarkPairs>(observation.body);
  pairs.deformed.conservativeResize(3, 3);
  const auto unpaired = pipeline(inversion).run(observation, {});
  ASSERT_FALSE(unpaired.has_value());
  EXPECT_THAT(unpaired.error().message, HasSubstr("4 undeformed but 3 deformed"));

  pairs.undeformed.conservativeResize(3, 2);
  pairs.deformed.conservativeResize(3, 2);
  const auto few = pipeline(inversion).run(observation, {});
  ASSERT_FALSE(few.has_value());
  EXPECT_EQ(few.error().code, ErrorCode::kInvalidArgument);
  EXPECT_FALSE(inversion.seen->has_value());
}

TEST(Pipeline, AnErrorOfTheInversionPassesThroughUnchanged) {
  auto failing =
      std::make_unique<FakeInverter>([](int, const SparseData&, const auto&, Estimate&) -> Status {
        return fail(ErrorCode::kNotConverged, "the reason");
      });
  const auto update = pipeline_on(model(), {}, std::move(failing)).run(landmarks(1));
  ASSERT_FALSE(update.has_value());
  EXPECT_EQ(update.error().code, ErrorCode::kNotConverged);
  EXPECT_EQ(update.error().message, "the reason");
}

TEST(Pipeline, IteratesAreMarkedAndTheStopTokenReachesTheInversion) {
  std::stop_source stop;
  bool stoppable = false;
  auto iterating = std::make_unique<FakeInverter>(
      [&](int, const SparseData&, const auto& options, Estimate& estimate) -> Status {
        stoppable = options.stop.stop_possible();
        Estimate iterate;
        iterate.status = EstimateStatus::kIterating;
        iterate.displacement = Points::Ones(3, 8);
        options.on_iterate(iterate);
        estimate.status = EstimateStatus::kConverged;
        estimate.displacement = Points::Zero(3, 8);
        return {};
      });
  std::vector<Update> iterates;
  RunOptions options;
  options.stop = stop.get_token();
  options.on_iterate = [&](Update update) { iterates.push_back(std::move(update)); };
  const auto update = pipeline_on(model(), {}, std::move(iterating)).run(landmarks(1), options);
  ASSERT_TRUE(update.has_value());
  ASSERT_EQ(iterates.size(), 1u);
  EXPECT_FALSE(iterates[0].final);
  EXPECT_EQ(iterates[0].observation_sequence, 1u);
  EXPECT_EQ(iterates[0].estimate.displacement(0, 0), 1.0);
  EXPECT_TRUE(update->final);
  EXPECT_EQ(update->estimate.status, EstimateStatus::kConverged);
  EXPECT_TRUE(stoppable);
}

// The inverter writes where the update is read: no copy between them.
TEST(Pipeline, TheInverterWritesIntoTheUpdateItself) {
  const double* written = nullptr;
  auto inverter = std::make_unique<FakeInverter>(
      [&](int, const SparseData&, const auto&, Estimate& estimate) -> Status {
        estimate.displacement = Points::Zero(3, 8);
        written = estimate.displacement.data();
        return {};
      });
  const auto update = pipeline_on(model(), {}, std::move(inverter)).run(landmarks(1));
  ASSERT_TRUE(update.has_value());
  EXPECT_EQ(update->estimate.displacement.data(), written);
}

TEST(Pipeline, ResetForgetsEvidenceAndTheInvertersState) {
  const FakeEstimator inversion;
  auto inverter = inversion.make();
  const FakeInverter& watched = *inverter;
  Pipeline two = pipeline_on(model(), {}, std::move(inverter));
  ASSERT_TRUE(two.run(landmarks(1, "ius")).has_value());
  ASSERT_TRUE(two.run(landmarks(2, "pointer")).has_value());
  EXPECT_EQ(inversion.seen->value().sources.size(), 2u);
  two.reset();
  EXPECT_EQ(watched.resets, 1);
  ASSERT_TRUE(two.run(landmarks(1, "pointer")).has_value());
  EXPECT_EQ(inversion.seen->value().sources.size(), 1u);
}

TEST(Pipeline, SaysWhatItLeavesOut) {
  const auto contact = pipeline(FakeEstimator{}, Boundary::kContact).run(landmarks(1), {});
  ASSERT_TRUE(contact.has_value());
  EXPECT_TRUE(leaves_out(*contact, "pressure"));
  EXPECT_TRUE(leaves_out(*contact, "uncertainty"));
  EXPECT_FALSE(leaves_out(*contact, "contact"));
  const auto fixed = pipeline(FakeEstimator{}, Boundary::kFixed).run(landmarks(1), {});
  ASSERT_TRUE(fixed.has_value());
  EXPECT_TRUE(leaves_out(*fixed, "contact"));
  for (const Omission& omission : fixed->left_out) {
    if (omission.part != "contact") continue;
    // The paper's Table: 3.4 mm at the craniotomy without contact, 1.6 mm with it.
    EXPECT_THAT(omission.estimated_error, HasSubstr("3.4 mm of error remain"));
  }
  for (const Omission& omission : fixed->left_out) {
    EXPECT_FALSE(omission.reason.empty()) << omission.part;
    EXPECT_FALSE(omission.estimated_error.empty()) << omission.part;
  }
}

TEST(Pipeline, ListsThePartsOfThePriorThatTheCaseSwitchesOff) {
  PriorConfig prior;
  prior.force_density_sd_n_m3 = prior.medium_density_sd_n_m3;
  prior.gravity_direction_sd_deg = 10.0;
  prior.resection_weight_sd = 1.0;
  prior.resection_stress_sd_pa = 300.0;
  EXPECT_TRUE(prior_omissions(prior).empty());
  prior.tumour_volume_strain_sd = 0.0;
  prior.gravity_levels_mm.clear();
  prior.resection_weight_sd = 0.0;  // its stress stays
  const auto left_out = prior_omissions(prior);
  ASSERT_EQ(left_out.size(), 2u);
  EXPECT_EQ(left_out[0].part, "gravity modes");
  EXPECT_EQ(left_out[1].part, "swelling of the tumour");
  EXPECT_THAT(left_out[1].reason, HasSubstr("prior.tumour_volume_strain_sd"));
  EXPECT_THAT(left_out[1].estimated_error, HasSubstr("1.7 mm at the cortex"));
  prior.resection_stress_sd_pa = 0.0;
  EXPECT_EQ(prior_omissions(prior).size(), 3u);
}

// By default other parts stand for three; without those these are missing.
TEST(Pipeline, SaysThatAnotherPartTakesThePlaceOfOneThatIsOff) {
  PriorConfig prior;
  const auto by_default = prior_omissions(prior);
  ASSERT_EQ(by_default.size(), 3u);
  EXPECT_EQ(by_default[0].part, "buoyancy across gravity");
  EXPECT_THAT(by_default[0].estimated_error,
              HasSubstr("the coarse residual field takes its place"));
  EXPECT_EQ(by_default[1].part, "resection");
  EXPECT_THAT(by_default[1].estimated_error, HasSubstr("swelling of the tumour takes its place"));
  EXPECT_EQ(by_default[2].part, "fine residual field");
  EXPECT_THAT(by_default[2].estimated_error,
              HasSubstr("the medium residual field takes its place"));
  prior.medium_density_sd_n_m3 = 0.0;
  const auto none = prior_omissions(prior);
  ASSERT_EQ(none.size(), 4u);
  EXPECT_EQ(none[2].part, "fine residual field");
  EXPECT_THAT(none[2].estimated_error, HasSubstr("0.1 mm at the cortex"));
}

TEST(Pipeline, ReportsRotationThatASphereCannotShow) {
  const BrainModel sphere = model({10, 10, 10});
  Pipeline built = pipeline_on(sphere);
  Observation observation = landmarks(1);
  observation.body = TumourBoundary{sphere.tumour.vertices.colwise() + Vec3(1, 0, 0), 0.5};
  const auto update = built.run(observation);
  ASSERT_TRUE(update.has_value());
  EXPECT_TRUE(leaves_out(*update, "rotation"));
  for (const Omission& omission : update->left_out) {
    if (omission.part != "rotation") continue;
    EXPECT_THAT(omission.reason, HasSubstr("no rotation is shown by the points"));
  }
}

TEST(Pipeline, MethodsOtherThanCondensedLeaveUncertaintyOut) {
  for (const Method method : kAllMethods) {
    const auto update = pipeline(FakeEstimator{}, Boundary::kContact, {}, method).run(landmarks(1));
    ASSERT_TRUE(update.has_value());
    EXPECT_EQ(leaves_out(*update, "uncertainty"), method != Method::kCondensed)
        << to_string(method);
  }
  CaseConfig off;
  off.scene.uncertainty = Carry::kOff;
  const auto update =
      pipeline(FakeEstimator{}, Boundary::kContact, off, Method::kCondensed).run(landmarks(1));
  ASSERT_TRUE(update.has_value());
  EXPECT_TRUE(leaves_out(*update, "uncertainty"));
}

TEST(Pipeline, ListsWhatTheInversionLeftOut) {
  CaseConfig config;
  config.scene.far_field = Carry::kOff;
  auto inverter = FakeEstimator{}.make();
  FakeInverter& leaving_out = *inverter;
  Pipeline built =
      pipeline_on(model(), config, std::move(inverter), Method::kCondensed, Boundary::kContact);
  const auto without_errors = built.run(landmarks(1));
  ASSERT_TRUE(without_errors.has_value());
  EXPECT_FALSE(leaves_out(*without_errors, "far field"));
  leaving_out.errors = inversion::OmissionErrors{};
  leaving_out.errors->far_field_mm = 0.25;
  const auto update = built.run(landmarks(2));
  ASSERT_TRUE(update.has_value());
  EXPECT_TRUE(leaves_out(*update, "far field"));
}

TEST(Pipeline, RotationForcedOffAlignsATranslationAndSaysSo) {
  const BrainModel long_tumour = model({20, 10, 15});
  Observation observation = landmarks(1);
  observation.body = TumourBoundary{
      Eigen::AngleAxisd(0.05, Vec3::UnitZ()).toRotationMatrix() * long_tumour.tumour.vertices,
      0.5};
  const auto run = [&](Carry rotation) {
    CaseConfig config;
    config.scene.rotation = rotation;
    return pipeline_on(long_tumour, config).run(observation);
  };
  const auto with = run(Carry::kAuto), without = run(Carry::kOff);
  ASSERT_TRUE(with && without);
  EXPECT_FALSE(leaves_out(*with, "rotation"));
  EXPECT_GT((with->T_undeformed_deformed.linear() - Mat3::Identity()).norm(), 0.03);
  EXPECT_TRUE(leaves_out(*without, "rotation"));
  EXPECT_TRUE(without->T_undeformed_deformed.linear().isIdentity(1e-12));
}

TEST(Pipeline, RotationForcedOnIsNotLeftOutWhereASphereCannotShowIt) {
  const BrainModel sphere = model({10, 10, 10});
  CaseConfig on;
  on.scene.rotation = Carry::kOn;
  Pipeline built = pipeline_on(sphere, on);
  Observation observation = landmarks(1);
  observation.body = TumourBoundary{sphere.tumour.vertices.colwise() + Vec3(1, 0, 0), 0.5};
  const auto update = built.run(observation);
  ASSERT_TRUE(update.has_value());
  EXPECT_FALSE(leaves_out(*update, "rotation"));
}

TEST(Pipeline, NeedsATumourSurface) {
  BrainModel without = model();
  without.tumour = {};
  const auto built =
      Pipeline::build(without, {}, Method::kPaper, Boundary::kContact, FakeEstimator{}.make());
  ASSERT_FALSE(built.has_value());
  EXPECT_EQ(built.error().code, ErrorCode::kEmptySet);
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

}  // namespace
}  // namespace brainshift::pipeline
