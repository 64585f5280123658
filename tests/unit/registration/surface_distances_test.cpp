// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/surface_distances.hpp"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>

#include "common/core/random.hpp"
#include "common/geometry/surface.hpp"
#include "common/registration/alignment_data.hpp"
#include "common/registration/icp.hpp"
#include "tests/support/dense.hpp"
#include "tests/support/results.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::registration {
namespace {

using testing::HasSubstr;

// A cap of radius 60 mm about the z axis, 20 mm wide, as the cortex under a craniotomy. Its apex
// is at (0, 0, 60).
double cap_height(double x, double y) { return std::sqrt(3600.0 - x * x - y * y); }

SurfacePatch cap() {
  constexpr int kSide = 21;
  SurfacePatch patch;
  patch.surface.vertices.resize(3, kSide * kSide);
  std::vector<int> corners;
  for (int j = 0; j < kSide; ++j) {
    for (int i = 0; i < kSide; ++i) {
      const double x = i - 10.0, y = j - 10.0;
      patch.nodes.push_back(kSide * j + i);
      patch.surface.vertices.col(kSide * j + i) = Vec3(x, y, cap_height(x, y));
      if (i + 1 == kSide || j + 1 == kSide) continue;
      const int a = kSide * j + i, b = a + 1, c = a + kSide, d = c + 1;
      for (const int corner : {a, b, d, a, d, c}) corners.push_back(corner);
    }
  }
  patch.surface.triangles = Eigen::Map<Eigen::Matrix<int, 3, Eigen::Dynamic>>(
      corners.data(), 3, static_cast<Eigen::Index>(corners.size() / 3));
  patch.weights.resize(kSide * kSide, kSide * kSide);
  patch.weights.setIdentity();
  return patch;
}

std::shared_ptr<const IndexedPatch> indexed(SurfacePatch patch) {
  return IndexedPatch::build(std::move(patch)).value();
}

Points points_on_cap(int count, double half_width, std::uint64_t seed = 1) {
  Random random(seed);
  Points points(3, count);
  for (auto p : points.colwise()) {
    const double x = half_width * (2.0 * random.uniform() - 1.0);
    const double y = half_width * (2.0 * random.uniform() - 1.0);
    p = Vec3(x, y, cap_height(x, y));
  }
  return points;
}

Points still(const SurfaceDistances& surface) {
  return Points::Zero(3, static_cast<Eigen::Index>(surface.nodes().size()));
}

SurfaceDistances built(const Points& measured, const SurfaceDistanceOptions& options = {}) {
  return value_or_fail(SurfaceDistances::build(indexed(cap()), measured, options));
}

TEST(SurfaceDistances, OfASunkenCortexAreTheDepthAlongItsNormal) {
  const Vec3 sink(0, 0, -3);
  const SurfaceDistances surface = built(points_on_cap(400, 7.0).colwise() + sink);
  const SparseData data = surface.at(still(surface));
  ASSERT_EQ(data.size(), 300);
  for (int i = 0; i < data.size(); ++i) {
    const Vec3 n = data.directions.col(i);
    EXPECT_NEAR(n.norm(), 1.0, 1e-12);
    EXPECT_GT(n.z(), 0.95);
    // Along the normal of the undeformed surface, up to its curvature over the slide of the foot
    // point.
    EXPECT_NEAR(n.dot(data.displacements.col(i)), n.dot(sink), 0.02);
    EXPECT_LT((data.displacements.col(i) - n * n.dot(data.displacements.col(i))).norm(), 1e-12);
  }
}

TEST(SurfaceDistances, EndWhenTheyAreTold) {
  std::stop_source stop;
  SurfaceDistanceOptions options;
  options.stop = stop.get_token();
  EXPECT_TRUE(SurfaceDistances::build(indexed(cap()), points_on_cap(5000, 7.0), options));
  stop.request_stop();
  EXPECT_EQ(refusal_of(SurfaceDistances::build(indexed(cap()), points_on_cap(5000, 7.0), options),
                       ErrorCode::kNotConverged),
            "cortical surface: was stopped");
}

// A distance hardly notices where along the surface it is taken.
TEST(SurfaceDistances, AreSettledAcrossTheSurfaceSoonerThanAlongIt) {
  const SurfaceDistances surface = built(points_on_cap(400, 6.0));
  const SparseData before = surface.at(still(surface));
  const auto moved = [&](double across_mm, double along_mm) {
    SparseData now = before;
    const Vec3 n = now.directions.col(7);
    now.positions.col(7) += across_mm * n + along_mm * n.unitOrthogonal();
    return surface.moved(before, now);
  };
  EXPECT_FALSE(moved(0.9 * kSettled_mm, 0.0));
  EXPECT_TRUE(moved(-1.1 * kSettled_mm, 0.0));
  EXPECT_FALSE(moved(0.0, 0.9 * kSettledAlong_mm));
  EXPECT_TRUE(moved(0.0, 1.1 * kSettledAlong_mm));
  SparseData fewer = before;
  fewer.positions.conservativeResize(3, before.size() - 1);
  fewer.displacements.conservativeResize(3, before.size() - 1);
  fewer.sd_mm.conservativeResize(before.size() - 1);
  EXPECT_TRUE(surface.moved(before, fewer));
}

TEST(SurfaceDistances, OfTheRightDeformationAreExactWhateverSlid) {
  const Vec3 move(2.5, -1.0, -3.0);
  const SurfaceDistances surface = built(points_on_cap(400, 6.0).colwise() + move);
  Points u = still(surface);
  u.colwise() += move;
  const SparseData data = surface.at(u);
  ASSERT_GT(data.size(), 200);
  for (int i = 0; i < data.size(); ++i) {
    const Vec3 n = data.directions.col(i);
    // The faces lie up to h^2 / (8 R) below the cap.
    EXPECT_NEAR(n.dot(data.displacements.col(i)), n.dot(move), 0.005) << i;
  }
  EXPECT_TRUE(surface.moved(surface.at(still(surface)), data));
  EXPECT_FALSE(surface.moved(data, data));
}

TEST(SurfaceDistances, PointsBesideThePatchGiveNoData) {
  Points measured(3, 60);
  measured.leftCols(30) = points_on_cap(30, 8.0);
  measured.rightCols(30) = points_on_cap(30, 8.0).colwise() + Vec3(25, 0, 0);
  const SurfaceDistances surface = built(measured);
  EXPECT_EQ(surface.at(still(surface)).size(), 30);
}

TEST(SurfaceDistances, TheSamePointsGuideEveryTime) {
  const Points measured = points_on_cap(1000, 8.0);
  const SurfaceDistances first = built(measured), second = built(measured);
  EXPECT_EQ(first.at(still(first)).positions, second.at(still(second)).positions);
}

TEST(SurfaceDistances, TheCamerasPoseIsACommonError) {
  SurfaceDistanceOptions options;
  options.pose_sd_mm = 0.3;
  options.pose_sd_deg = 0.5;
  const SurfaceDistances surface = built(points_on_cap(100, 8.0), options);
  const SparseData data = surface.at(still(surface));
  ASSERT_EQ(data.common_error.cols(), 6);
  const Vec3 arm = data.positions.col(5) - data.positions.rowwise().mean();
  const double turn = 0.5 * std::numbers::pi / 180.0;
  const Mat3 variance =
      data.common_error.middleRows<3>(15) * data.common_error.middleRows<3>(15).transpose();
  const Mat3 expected =
      0.09 * Mat3::Identity() +
      turn * turn * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
  EXPECT_LT((variance - expected).norm(), 1e-12);
  EXPECT_EQ(built(points_on_cap(100, 8.0)).at(still(surface)).common_error.size(), 0);
}

TEST(SurfaceDistances, RefuseWhatLiesElsewhereOrIsNotFinite) {
  EXPECT_THAT(refusal_of(SurfaceDistances::build(
                             indexed(cap()), points_on_cap(100, 8.0).colwise() + Vec3(0, 0, 80)),
                         ErrorCode::kInvalidArgument),
              HasSubstr("0 of 100 points lie over the craniotomy"));
  Points measured = points_on_cap(100, 8.0);
  measured(1, 17) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refusal_of(SurfaceDistances::build(indexed(cap()), measured), ErrorCode::kNotFinite),
              HasSubstr("point 17"));
  refusal_of(IndexedPatch::build(SurfacePatch{}), ErrorCode::kEmptySet);
}

TEST(SurfaceDistances, OfAnEstimateThatIsNotFiniteAreNone) {
  const SurfaceDistances surface = built(points_on_cap(100, 8.0));
  Points u = still(surface);
  u(0, 5) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(surface.at(u).size(), 0);
}

// ---- the tumour ----

constexpr double kRadius_mm = 10.0;

// The toy patient with a tumour of these semi-axes, well inside the brain.
BrainModel patient_with(const Vec3& semi_axes_mm, double edge_mm = 1.5) {
  BrainModel patient = test_support::toy_patient(8);
  patient.tumour = geometry::ellipsoid_surface(Vec3(30, 30, 33), semi_axes_mm, edge_mm);
  return patient;
}

Points boundary_points(const TriangleSurface& tumour, const Points& vertices, int count = 400) {
  return geometry::sample_surface({vertices, tumour.triangles}, count, 3);
}

SurfaceDistances of_tumour(const BrainModel& patient, const Points& measured,
                           const RigidTransform& T = RigidTransform::Identity(),
                           SurfaceDistanceOptions options = {}) {
  options.points = 400;
  return value_or_fail(
      SurfaceDistances::build(indexed(tumour_patch(patient)), measured, options, T));
}

// The amplitude a of the displacement a (x - centre) that data show when nothing else moves but
// what their common errors allow: its estimate and standard deviation by generalised least squares.
struct Amplitude {
  double value = 0.0, sd = 0.0;
};

Amplitude dilation_shown_by(const SparseData& data) {
  const Vec3 centre(30, 30, 33);
  const auto rows_of = [&](const VecX& field) {  // along the directions; 3 rows for whole data
    VecX rows(data.rows());
    Eigen::Index row = 0;
    for (int i = 0; i < data.size(); ++i) {
      const Vec3 value = field.segment<3>(3 * i);
      if (data.along_direction(i)) {
        rows[row++] = data.directions.col(i).dot(value);
      } else {
        rows.segment<3>(row) = value;
        row += 3;
      }
    }
    return rows;
  };
  const Points growth = data.positions.colwise() - centre;
  const VecX signal = rows_of(growth.reshaped()), seen = rows_of(data.displacements.reshaped());
  Eigen::MatrixXd covariance =
      data.sd_mm[0] * data.sd_mm[0] * Eigen::MatrixXd::Identity(signal.size(), signal.size());
  for (const auto column : data.common_error.colwise()) {
    const VecX rows = rows_of(column);
    covariance += rows * rows.transpose();
  }
  const VecX whitened = test_support::solve_positive(covariance, signal);
  return {whitened.dot(seen) / whitened.dot(signal), 1.0 / std::sqrt(whitened.dot(signal))};
}

TEST(TumourDistances, ShowADilationThatARigidAlignmentHides) {
  const BrainModel patient = patient_with(Vec3::Constant(kRadius_mm));
  const Vec3 centre(30, 30, 33);
  const Points grown = (1.05 * (patient.tumour.vertices.colwise() - centre)).colwise() + centre;
  const Points measured = boundary_points(patient.tumour, grown);
  SurfaceDistanceOptions options;
  options.pose_sd_mm = 1.0;
  options.pose_sd_deg = 1.0;
  const SurfaceDistances surface =
      of_tumour(patient, measured, RigidTransform::Identity(), options);
  const Amplitude shown = dilation_shown_by(surface.first());
  EXPECT_NEAR(shown.value, 0.05, 0.002);
  EXPECT_LT(shown.sd, 0.005);

  const auto index = value_or_fail(geometry::ClosestPointIndex::build(patient.tumour));
  const auto icp = value_or_fail(align(measured, index, RigidTransform::Identity()));
  const Amplitude hidden = dilation_shown_by(sparse_data_from_alignment(measured, icp, 0.5));
  EXPECT_NEAR(hidden.value, 0.0, 0.005);
  EXPECT_GT(hidden.sd, 0.05);
}

TEST(TumourDistances, OfABallSayNothingOfItsRotation) {
  const BrainModel patient = patient_with(Vec3::Constant(kRadius_mm));
  const SurfaceDistances surface =
      of_tumour(patient, boundary_points(patient.tumour, patient.tumour.vertices));
  const SparseData data = surface.first();
  ASSERT_EQ(data.size(), 400);
  const Vec3 w(0.3, -0.5, 0.8);
  for (int i = 0; i < data.size(); ++i) {
    const Vec3 turned = w.cross(Vec3(data.positions.col(i)) - Vec3(30, 30, 33));
    // Rows of facet normals would be up to 0.08 of the motion.
    EXPECT_NEAR(data.directions.col(i).dot(turned), 0.0, 1e-2 * kRadius_mm * w.norm());
  }
}

// A rigid motion far larger than the tumour's curvature allows closest points to find.
RigidTransform large_motion() {
  RigidTransform motion = RigidTransform::Identity();
  motion.linear() = Eigen::AngleAxisd(0.1, Vec3(1, -1, 2).normalized()).toRotationMatrix();
  motion.translation() = Vec3(9, -14, -6);
  return motion;
}

TEST(TumourDistances, StartFromTheRigidMotionWhereTheShiftExceedsTheTumour) {
  const BrainModel patient = patient_with(Vec3(12, 9, 7));
  const RigidTransform motion = large_motion();
  const Points measured =
      (motion.linear() * boundary_points(patient.tumour, patient.tumour.vertices)).colwise() +
      Vec3(motion.translation());
  const SparseData data = of_tumour(patient, measured, motion.inverse()).first();
  ASSERT_EQ(data.size(), 400);
  for (int i = 0; i < data.size(); ++i) {
    const Vec3 x = data.positions.col(i), n = data.directions.col(i);
    EXPECT_NEAR(n.dot(data.displacements.col(i)), n.dot(motion * x - x), 1e-6) << i;
  }
}

// Fields that are linear in space with a small quadratic part, by their 21 amplitudes.
constexpr int kAmplitudes = 21;
VecX powers(const Vec3& x) {
  const Vec3 y = (x - Vec3(30, 30, 33)) / kRadius_mm;
  VecX values(7);
  values << 1.0, y, y[0] * y[0], y[1] * y[1], y[2] * y[2];
  return values;
}
Vec3 field_at(const Vec3& x, const VecX& amplitudes) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 7>>(amplitudes.data()) * powers(x);
}
Points field_at_all(const Points& x, const VecX& amplitudes) {
  Points u(3, x.cols());
  for (Eigen::Index i = 0; i < x.cols(); ++i) u.col(i) = field_at(x.col(i), amplitudes);
  return u;
}

// Posterior mean of the amplitudes given the data. Standard deviations, mm at the tumour's surface:
// shift 20, linear 0.5, quadratic 0.2.
VecX toy_inversion(const SparseData& data) {
  VecX information(kAmplitudes);
  information << VecX::Constant(3, 1.0 / 400.0), VecX::Constant(9, 4.0), VecX::Constant(9, 25.0);
  Eigen::MatrixXd normal = information.asDiagonal();
  VecX right = VecX::Zero(kAmplitudes);
  for (int i = 0; i < data.size(); ++i) {
    const Vec3 n = data.directions.col(i);
    VecX row(kAmplitudes);
    Eigen::Map<Eigen::Matrix<double, 3, 7>>(row.data()) =
        n * powers(data.positions.col(i)).transpose();
    const double weight = 1.0 / (data.sd_mm[i] * data.sd_mm[i]);
    normal += weight * row * row.transpose();
    right += weight * n.dot(data.displacements.col(i)) * row;
  }
  return test_support::solve_positive(normal, right);
}

TEST(TumourDistances, AndAnInversionInTurnFindTheDeformedSurfaceAndSettle) {
  const BrainModel patient = patient_with(Vec3(12, 9, 7));
  VecX truth(kAmplitudes);
  truth << 9.0, -14.0, -6.0, 0.5, 0.3, -0.2, -0.4, 0.6, 0.2, 0.1, -0.3, -0.5, 0.2, 0.0, 0.1, 0.0,
      0.2, 0.0, -0.1, 0.0, 0.2;
  const TriangleSurface& tumour = patient.tumour;
  const Points true_vertices = tumour.vertices + field_at_all(tumour.vertices, truth);
  SurfaceDistanceOptions options;
  options.sd_mm = 0.05;
  RigidTransform start = RigidTransform::Identity();  // as an ICP finds the shift
  start.translation() = -truth.head<3>();
  const SurfaceDistances surface =
      of_tumour(patient, boundary_points(tumour, true_vertices), start, options);
  const Points at_nodes = patient.mesh.nodes(Eigen::all, surface.nodes());
  SparseData data = surface.first();
  VecX estimate = toy_inversion(data);
  int rounds = 1;
  for (; rounds < 20; ++rounds) {
    SparseData now = surface.at(field_at_all(at_nodes, estimate));
    if (!surface.moved(data, now)) break;
    data = std::move(now);
    estimate = toy_inversion(data);
  }
  EXPECT_LE(rounds, 6);
  const auto found = value_or_fail(geometry::ClosestPointIndex::build(
      {tumour.vertices + field_at_all(tumour.vertices, estimate), tumour.triangles}));
  double farthest = 0.0;
  for (const auto vertex : true_vertices.colwise()) {
    farthest = std::max(farthest, found.closest(vertex).distance_mm);
  }
  EXPECT_LT(farthest, 0.05);
  // Sliding included, as far as the shape and the prior show it.
  EXPECT_LT((estimate - truth).head<3>().norm(), 0.2);
}

TEST(TumourDistances, OfAnOpenSurfaceLeaveOutThePointsBesideIt) {
  BrainModel patient = patient_with(Vec3::Constant(kRadius_mm));
  const TriangleSurface whole = patient.tumour;
  std::vector<int> lower;
  for (int t = 0; t < whole.num_triangles(); ++t) {
    if (whole.vertices(2, whole.triangles(0, t)) < 33.0) lower.push_back(t);
  }
  patient.tumour.triangles = whole.triangles(Eigen::all, lower);
  const Points measured = boundary_points(whole, whole.vertices, 200);
  const SparseData data = of_tumour(patient, measured).first();
  EXPECT_GT(data.size(), 70);
  EXPECT_LT(data.size(), 130);
  for (int i = 0; i < data.size(); ++i) {
    EXPECT_LT(data.positions(2, i), 36.0);
    EXPECT_NEAR(data.displacements.col(i).norm(), 0.0, 1e-6);
  }
}

TEST(TumourDistances, RefusePointsFarFromTheSurfaceInTheirOwnWords) {
  const BrainModel patient = patient_with(Vec3::Constant(kRadius_mm));
  const Points away =
      boundary_points(patient.tumour, patient.tumour.vertices, 50).colwise() + Vec3(0, 70, 0);
  SurfaceDistanceOptions options;
  options.fewest = 3;
  options.measured = "tumour boundary";
  options.surface = "tumour";
  const auto patch = indexed(tumour_patch(patient));
  EXPECT_THAT(
      refusal_of(SurfaceDistances::build(patch, away, options), ErrorCode::kInvalidArgument),
      HasSubstr("tumour boundary: 0 of 50 points lie over the tumour within 30 mm, at "
                "least 3 are needed"));
  RigidTransform back = RigidTransform::Identity();
  back.translation() = Vec3(0, -70, 0);
  EXPECT_TRUE(SurfaceDistances::build(patch, away, options, back));
}

// Points that are each off along the normal; 100 of them guide.
class Superobservations : public testing::Test {
 protected:
  static Points noisy(double sd_mm, int count = 1000) {
    Points points = points_on_cap(count, 7.0);
    Random random(5);
    for (auto p : points.colwise()) p += sd_mm * random.normal() * p.normalized();
    return points;
  }
  static VecX heights(const SparseData& data) {
    VecX values(data.size());
    for (int i = 0; i < data.size(); ++i) {
      values[i] = data.directions.col(i).dot(data.displacements.col(i));
    }
    return values;
  }
  static SurfaceDistanceOptions averaged() {
    SurfaceDistanceOptions options;
    options.points = 100;
    options.sd_mm = 0.5;
    options.average_mm = 3.0;
    return options;
  }
};

TEST_F(Superobservations, AreOffByWhatTheySay) {
  const SparseData data = built(noisy(0.5), averaged()).first();
  ASSERT_EQ(data.size(), 100);
  const VecX off = heights(data);
  // About ten for each: sd near 0.5 sqrt(pi / 20) = 0.2 mm.
  EXPECT_NEAR(data.sd_mm.mean(), 0.2, 0.04);
  const double rms = (off.array() / data.sd_mm.array()).matrix().norm() / 10.0;
  EXPECT_NEAR(rms, 1.0, 0.2);
  EXPECT_LT(std::abs(off.mean()), 0.06);  // three standard errors
}

TEST_F(Superobservations, KeepWhatNeighboursShare) {
  SurfaceDistanceOptions options = averaged();
  const VecX alone = built(noisy(0.5), options).first().sd_mm;
  options.shared_sd_mm = 0.4;
  const VecX shared = built(noisy(0.5), options).first().sd_mm;
  EXPECT_LT((shared.cwiseAbs2() - alone.cwiseAbs2() - VecX::Constant(100, 0.16)).norm(), 1e-12);
}

// A fifth of the points are 8 mm off, as many inwards as outwards: a mean would have 3 mm of that
// where three of ten neighbours are.
TEST_F(Superobservations, AreNotMovedByGrossErrors) {
  Points points = noisy(0.1, 400);
  for (Eigen::Index i = 0; i < points.cols(); i += 5) {
    points.col(i) += (i % 2 == 0 ? 8.0 : -8.0) * points.col(i).normalized();
  }
  SurfaceDistanceOptions options = averaged();
  options.points = 40;
  const VecX off = heights(built(points, options).first());
  int gross = 0;
  for (const double one : off) gross += std::abs(one) > 0.5 ? 1 : 0;
  EXPECT_LE(gross, 2);  // clusters that are mostly gross by chance
}

TEST_F(Superobservations, OfFewerThanThreeNeighboursAreThePointsThemselves) {
  const Points points = noisy(0.5, 90);
  SurfaceDistanceOptions options = averaged();
  options.average_mm = 0.0;
  const SparseData plain = built(points, options).first();
  options.average_mm = 1e-3;
  const SparseData alone = built(points, options).first();
  EXPECT_EQ(alone.displacements, plain.displacements);
  EXPECT_EQ(alone.sd_mm, plain.sd_mm);
}

// Neighbours lie around a point on one side more than on another. What the whole surface does, here
// 3 mm lower, is no reason for their median to differ from the point's own distance.
TEST_F(Superobservations, FollowTheSurfaceAsItMoves) {
  const Vec3 sink(0, 0, -3);
  const SurfaceDistances surface = built(noisy(0.0).colwise() + sink, averaged());
  const Points moved = still(surface).colwise() + sink;
  EXPECT_LT((heights(surface.at(moved)).array() -
             (surface.at(moved).directions.transpose() * sink).array())
                .cwiseAbs()
                .maxCoeff(),
            0.02);
}

// The same where it is stretched, sheared and turned.
TEST_F(Superobservations, FollowTheSurfaceAsItIsStrained) {
  Eigen::Matrix3d strain;
  strain << 0.12, 0.09, -0.06, 0.0, -0.09, 0.15, 0.03, -0.12, 0.18;
  const Points rest = noisy(0.0);
  Points measured = rest + strain * rest;
  SurfaceDistanceOptions options = averaged();
  options.average_mm = 0.0;
  const VecX own = heights(built(measured, options).first());
  options.average_mm = 3.0;
  const VecX averaged = heights(built(measured, options).first());
  ASSERT_EQ(own.size(), averaged.size());
  ASSERT_GT(own.maxCoeff() - own.minCoeff(), 0.5) << "the test shows nothing";
  EXPECT_LT((averaged - own).cwiseAbs().maxCoeff(), 0.02);
}

}  // namespace
}  // namespace brainshift::registration
