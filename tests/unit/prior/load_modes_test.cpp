// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/prior/load_modes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <vector>

#include "common/fem/elasticity.hpp"
#include "common/geometry/slit_mesh.hpp"
#include "common/geometry/surface.hpp"
#include "tests/support/dense.hpp"
#include "tests/support/results.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::prior {
namespace {

Eigen::Map<const Points> mode(const Eigen::MatrixXd& modes, Eigen::Index column) {
  return {modes.col(column).data(), 3, modes.rows() / 3};
}

CaseConfig only(double gravity, double tumour, double brain, double weight, double stress,
                double opening) {
  CaseConfig config = test_support::toy_config();
  config.prior.gravity_mode_sd = gravity;
  config.prior.gravity_levels_mm = {0.0, 20.0};
  config.prior.tumour_volume_strain_sd = tumour;
  config.prior.tumour_volume_radii_mm = {12.0};
  config.prior.brain_volume_strain_sd = brain;
  config.prior.resection_weight_sd = weight;
  config.prior.resection_stress_sd_pa = stress;
  config.prior.opening_pressure_sd_pa = opening;
  return config;
}

LoadModes modes_of(const BrainModel& patient, const CaseConfig& config) {
  return value_or_fail(load_modes(patient, config));
}

TEST(LoadModes, StandInTheOrderOfTheirParts) {
  const BrainModel patient = test_support::toy_patient(8);
  const LoadModes modes = modes_of(patient, only(1.0, 0.05, 0.01, 1.0, 300.0, 600.0));
  const PerPart<int> expected = {2, 4, 0, 0, 27, 4, 9, 21, 0, 0, 0, 0, 0};
  EXPECT_EQ(modes.of_part, expected);
  EXPECT_EQ(modes.size(), 67);
  EXPECT_EQ(part_of_column(1, modes.of_part), PriorPart::kAlongGravity);
  EXPECT_EQ(part_of_column(2, modes.of_part), PriorPart::kAcrossGravity);
  EXPECT_EQ(part_of_column(6, modes.of_part), PriorPart::kTumourVolume);
  EXPECT_EQ(part_of_column(66, modes.of_part), PriorPart::kOpening);
  EXPECT_EQ(modes_of(patient, only(0, 0, 0, 0, 0, 0)).size(), 0);
}

// The halves of a brain that loses buoyancy on one side only: full and sides together or against
// one another leave one half without a load.
TEST(LoadModes, BuoyancyDiffersBetweenSidesAndBetweenEnds) {
  const BrainModel patient = test_support::toy_patient(8);
  CaseConfig config = only(1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
  config.prior.gravity_direction_sd_deg = 0.0;
  config.prior.gravity_sides_sd = 0.5;
  config.prior.gravity_ends_sd = 0.25;
  const LoadModes modes = modes_of(patient, config);
  const PerPart<int> expected = {2, 0, 2, 2};
  ASSERT_EQ(modes.of_part, expected);
  const Points& nodes = patient.mesh.nodes;
  for (int axis : {0, 1}) {
    const double middle = 0.5 * (nodes.row(axis).minCoeff() + nodes.row(axis).maxCoeff());
    for (int level : {0, 1}) {
      const auto along = mode(modes.columns, level);
      const auto uneven = mode(modes.columns, 2 + 2 * axis + level);
      const double sd = axis == 0 ? 0.5 : 0.25;
      for (Eigen::Index i = 0; i < nodes.cols(); ++i) {
        const double side = std::tanh((nodes(axis, i) - middle) / kMidlineWidth_mm);
        ASSERT_LE((uneven.col(i) - sd * side * along.col(i)).norm(), 1e-12 * along.norm());
      }
    }
  }
}

// Half of what one side loses is the mean of the other: a prior that knows nothing of it.
TEST(LoadModes, WhereSeptaPartTheHalvesUnevennessIsAPartOfDrainage) {
  BrainModel patient = test_support::toy_patient(8);
  patient.septa.slaves = {0};
  CaseConfig config = only(0.7, 0.0, 0.0, 0.0, 0.0, 0.0);
  config.prior.gravity_direction_sd_deg = 0.0;
  config.prior.gravity_sides_sd = 0.25;
  const LoadModes modes = modes_of(patient, config);
  const PerPart<int> expected = {4, 0, 0, 0};
  ASSERT_EQ(modes.of_part, expected);
  const Points& nodes = patient.mesh.nodes;
  const double middle = 0.5 * (nodes.row(0).minCoeff() + nodes.row(0).maxCoeff());
  for (int level : {0, 1}) {
    const auto both = mode(modes.columns, level), apart = mode(modes.columns, 2 + level);
    for (Eigen::Index i = 0; i < nodes.cols(); ++i) {
      const double side = std::tanh((nodes(0, i) - middle) / kMidlineWidth_mm);
      ASSERT_LE((apart.col(i) - kHalvesApart * side * both.col(i)).norm(), 1e-12 * both.norm());
    }
  }
  config.prior.gravity_sides_sd = 0.0;
  EXPECT_EQ(modes_of(patient, config).of_part[0], 2);
}

// No net force and no net moment.
TEST(LoadModes, SwellingAndStressBalanceThemselves) {
  const BrainModel patient = test_support::toy_patient();
  const LoadModes modes = modes_of(patient, only(0.0, 0.05, 0.01, 0.0, 300.0, 0.0));
  ASSERT_EQ(modes.size(), 27 + 4 + 6);
  for (int j = 0; j < modes.size(); ++j) {
    const auto force = mode(modes.columns, j);
    const double size = force.colwise().norm().sum();
    ASSERT_GT(size, 0.0);
    EXPECT_LT(force.rowwise().sum().norm(), 1e-12 * size) << j;
    Vec3 moment = Vec3::Zero();
    for (Eigen::Index i = 0; i < force.cols(); ++i) {
      moment += Vec3(patient.mesh.nodes.col(i)).cross(Vec3(force.col(i)));
    }
    EXPECT_LT(moment.norm(), 1e-10 * size) << j;
  }
}

double bulk_modulus(const Material& material) {
  const fem::Elasticity elasticity = fem::elasticity_from(material);
  return elasticity.lambda + 2.0 / 3.0 * elasticity.shear;
}

// Work in a uniform dilation u = x e: sum f . x = sum V kappa theta tr(grad x) = 3 int kappa theta,
// of a bump of height 1 at `away` of the tumour's centre. kappa: by the distance from that centre.
template <typename Kappa>
double expected_work(const BrainModel& patient, const Vec3& away, double radius,
                     const Kappa& kappa) {
  const Vec3 centre = patient.tumour.vertices.rowwise().mean();
  double integral = 0.0;
  for (int t = 0; t < patient.mesh.num_tets(); ++t) {
    Vec3 centroid = Vec3::Zero();
    for (int k = 0; k < 4; ++k) centroid += 0.25 * patient.mesh.nodes.col(patient.mesh.tets(k, t));
    const Vec3 arm = (centroid - centre - away) / radius;
    integral += fem::tet_geometry(patient.mesh, t).volume * kappa((centroid - centre).norm()) *
                std::exp(-0.5 * arm.squaredNorm());
  }
  return 3.0 * integral;
}

// Places in the order of the columns: the last index first.
std::vector<Vec3> lattice(double radius) {
  std::vector<Vec3> places;
  for (int n = 0; n < 27; ++n) {
    places.push_back(std::sqrt(2.0) * radius * Vec3(n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1));
  }
  return places;
}

// exp(-r^2 / s^2) at the tumour of all 27 bumps: 1, 6, 12 and 8 of them at r^2 / s^2 = 0, 2, 4, 6.
double height() {
  return 1.0 / std::sqrt(1.0 + 6.0 * std::exp(-2.0) + 12.0 * std::exp(-4.0) + 8.0 * std::exp(-6.0));
}

TEST(LoadModes, SwellingDoesTheWorkOfItsVolumeStrain) {
  const BrainModel patient = test_support::toy_patient(8);
  const CaseConfig config = only(0.0, 0.3, 0.0, 0.0, 0.0, 0.0);
  const LoadModes modes = modes_of(patient, config);
  const double kappa = bulk_modulus(config.material);
  const std::vector<Vec3> places = lattice(12.0);
  ASSERT_EQ(modes.size(), static_cast<int>(places.size()));
  const double largest = expected_work(patient, Vec3::Zero(), 12.0, [&](double) { return kappa; });
  for (int j = 0; j < modes.size(); ++j) {
    const double work = mode(modes.columns, j).cwiseProduct(patient.mesh.nodes).sum();
    const double expected = expected_work(patient, places[static_cast<std::size_t>(j)], 12.0,
                                          [&](double) { return kappa; });
    EXPECT_NEAR(work, 0.3 * height() * expected, 1e-9 * std::abs(largest)) << j;
  }
}

// Beyond kTumourVolumeReach_mm swelling is no longer the tumour's: sqrt(2) 50 mm is within, its
// diagonals are not. The radii share the variance.
TEST(LoadModes, SwellingReachesNoFurtherThanItsHemisphere) {
  const BrainModel patient = test_support::toy_patient(8);
  CaseConfig config = only(0.0, 0.3, 0.0, 0.0, 0.0, 0.0);
  config.prior.tumour_volume_radii_mm = {50.0, 60.0};
  const LoadModes modes = modes_of(patient, config);
  ASSERT_EQ(modes.size(), 7 + 1);
  const double kappa = bulk_modulus(config.material);
  const double work = mode(modes.columns, 7).cwiseProduct(patient.mesh.nodes).sum();
  const double expected = expected_work(patient, Vec3::Zero(), 60.0, [&](double) { return kappa; });
  EXPECT_NEAR(work, 0.3 / std::sqrt(2.0) * expected, 1e-9 * std::abs(work));
}

// A stiff tumour swells with its own bulk modulus.
TEST(LoadModes, SwellingHonoursTheStiffnessOfTheTumour) {
  const BrainModel patient = test_support::toy_patient(8);
  CaseConfig config = only(0.0, 0.3, 0.0, 0.0, 0.0, 0.0);
  config.material.tumour = TissueStiffness{6300.0, 0.46};
  Material stiff = config.material;
  stiff.shear_modulus_pa = 6300.0;
  constexpr int kMiddle = 13;
  const double work =
      mode(modes_of(patient, config).columns, kMiddle).cwiseProduct(patient.mesh.nodes).sum();
  const double inside = bulk_modulus(stiff), outside = bulk_modulus(config.material);
  // The toy's tumour is a ball of radius 10 mm, as a polyhedron a little smaller.
  const auto kappa = [&](double r) { return r < 10.0 ? inside : outside; };
  const double strain = 0.3 * height();
  EXPECT_NEAR(work, strain * expected_work(patient, Vec3::Zero(), 12.0, kappa),
              0.05 * std::abs(work));
  EXPECT_GT(std::abs(work / (strain * expected_work(patient, Vec3::Zero(), 12.0,
                                                    [&](double) { return outside; })) -
                     1),
            0.1)
      << "the test shows nothing";
}

// Work in a dilation of one part of the brain, u = max(0, x - m) along an axis: the integral of
// kappa theta over what lies above m, in closed form, as kappa is one number and the plane at m one
// of the mesh. The box is 60 mm wide about x = 37 mm and 90 mm long about y = 45 mm.
TEST(LoadModes, TheBrainSwellsAsAWholeInOppositeHalvesAndTowardsFrontAndTop) {
  BrainModel patient = test_support::toy_patient(12);
  patient.mesh.nodes.row(0).array() += 7.0;
  patient.mesh.nodes.row(1) *= 1.5;
  const CaseConfig config = only(0.0, 0.0, 0.02, 0.0, 0.0, 0.0);
  const LoadModes modes = modes_of(patient, config);
  ASSERT_EQ(modes.size(), 4);
  const double kappa = 0.02 * bulk_modulus(config.material);
  const auto work = [&](int column, int axis, double from, double to) {
    const auto force = mode(modes.columns, column);
    double sum = 0.0;
    for (Eigen::Index i = 0; i < force.cols(); ++i) {
      sum += force(axis, i) * (std::clamp(patient.mesh.nodes(axis, i), from, to) - from);
    }
    return sum;
  };
  // Areas across x, y and z; middles and half widths along them.
  const Vec3 area(90.0 * 60.0, 60.0 * 60.0, 60.0 * 90.0), middle(37, 45, 30), half(30, 45, 30);
  for (int axis = 0; axis < 3; ++axis) {
    const double low = middle[axis] - half[axis], high = middle[axis] + half[axis];
    const double upper = kappa * area[axis] * half[axis];
    EXPECT_NEAR(work(0, axis, middle[axis], high), upper, 1e-9 * upper) << axis;
    EXPECT_NEAR(work(0, axis, low, middle[axis]), upper, 1e-9 * upper) << axis;
  }
  // int tanh(t / 10) dt = 10 ln cosh(t / 10), to the right and with opposite sign to the left; the
  // elements are 5 mm wide.
  const double right = kappa * area.x() * 10.0 * std::log(std::cosh(3.0));
  EXPECT_NEAR(work(1, 0, 37, 67), right, 0.01 * right);
  EXPECT_NEAR(work(1, 0, 7, 37), -right, 0.01 * right);
  // Linear from -1 to 1: half of the uniform strain in each half.
  const double front = kappa * area.y() * 45.0 / 2.0, top = kappa * area.z() * 30.0 / 2.0;
  EXPECT_NEAR(work(2, 1, 45, 90), front, 1e-9 * front);
  EXPECT_NEAR(work(2, 1, 0, 45), -front, 1e-9 * front);
  EXPECT_NEAR(work(3, 2, 30, 60), top, 1e-9 * top);
  EXPECT_NEAR(work(3, 2, 0, 30), -top, 1e-9 * top);
}

// A net force of the tumour's weight along each axis. The Gaussian reaches beyond the toy's tumour,
// but not beyond its brain.
TEST(LoadModes, TheMissingWeightIsThatOfTheTumour) {
  const BrainModel patient = test_support::toy_patient(12);
  const LoadModes modes = modes_of(patient, only(0.0, 0.0, 0.0, 2.0, 0.0, 0.0));
  ASSERT_EQ(modes.size(), 3);
  const double weight = 1e-9 * 1000.0 * 9.80665 * geometry::enclosed_volume(patient.tumour);  // N
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 total = mode(modes.columns, axis).rowwise().sum();
    EXPECT_LT((total - 2.0 * weight * Vec3::Unit(axis)).norm(), 0.02 * 2.0 * weight) << axis;
  }
}

// Of the toy patient's opening, a disc of radius 16 mm in the plane z = 60; edges of 2.5 mm.
class OpeningModes : public testing::Test {
 protected:
  BrainModel patient = test_support::toy_patient(24);
  LoadModes modes = modes_of(patient, only(0.0, 0.0, 0.0, 0.0, 0.0, 600.0));

  // mm^2, of every node of the mesh; `elsewhere` off the opening.
  VecX areas(double elsewhere) const {
    std::vector<NodeIndex> nodes = patient.craniotomy;
    std::sort(nodes.begin(), nodes.end());
    VecX values = VecX::Constant(patient.mesh.num_nodes(), elsewhere);
    values(nodes) = geometry::vertex_areas(
        geometry::surface_between(patient.mesh.nodes, patient.boundary_triangles, nodes));
    return values;
  }
};

TEST_F(OpeningModes, PullOnItsNodesAlongOneAxisEach) {
  ASSERT_EQ(modes.size(), 21);
  const std::set<NodeIndex> inside(patient.craniotomy.begin(), patient.craniotomy.end());
  for (int j = 0; j < modes.size(); ++j) {
    const auto force = mode(modes.columns, j);
    for (Eigen::Index i = 0; i < force.cols(); ++i) {
      if (inside.count(static_cast<NodeIndex>(i)) == 0) {
        EXPECT_TRUE(force.col(i).isZero(0.0));
      }
    }
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_EQ(force.row(axis).isZero(0.0), axis != j % 3) << j;
    }
  }
}

// int p exp(-r^2 / 2 s^2) dA over the disc, s = kBumpWidth of its radius R:
// p 2 pi s^2 (1 - exp(-R^2 / 2 s^2)). R by the triangles' area, whose rim is ragged.
TEST_F(OpeningModes, HaveTheForceOfTheirPressure) {
  const double area_mm2 = areas(0.0).sum();
  const double s2 = kBumpWidth * kBumpWidth * area_mm2 / std::numbers::pi;
  const double force_N =
      600e-6 * 2.0 * std::numbers::pi * s2 * (1.0 - std::exp(-0.5 / (kBumpWidth * kBumpWidth)));
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(mode(modes.columns, axis).row(axis).sum(), force_N, 0.03 * force_N);
  }
  // Pressure times area at the middle of a bump, and nowhere more.
  for (int j = 0; j < modes.size(); ++j) {
    const VecX part =
        mode(modes.columns, j).row(j % 3).transpose().cwiseQuotient(600e-6 * areas(1.0));
    EXPECT_LE(part.maxCoeff(), 1.0 + 1e-9) << j;
    EXPECT_GT(part.maxCoeff(), 0.9) << j;
  }
}

// The traction of a bump is a Gaussian: its logarithm over the nodes gives centre and widths. On an
// opening that is an ellipse of half axes 27 and 16 mm, turned by 20 degrees, both are known but
// for the ragged rim of the triangles: widths of 0.45 of the half axes, a middle, a ring at 0.65.
TEST_F(OpeningModes, HaveCentresAndWidthsOfTheirEllipse) {
  const Vec3 middle(30, 30, 60);
  const double turned = std::numbers::pi / 9.0;
  const Vec3 along(std::cos(turned), std::sin(turned), 0.0);
  const Vec3 across(-std::sin(turned), std::cos(turned), 0.0);
  patient.craniotomy.clear();
  for (int i = 0; i < patient.mesh.num_nodes(); ++i) {
    const Vec3 away = patient.mesh.nodes.col(i) - middle;
    const double a = away.dot(along) / 27.0, b = away.dot(across) / 16.0;
    if (away.z() == 0.0 && a * a + b * b <= 1.0) patient.craniotomy.push_back(i);
  }
  modes = modes_of(patient, only(0.0, 0.0, 0.0, 0.0, 0.0, 600.0));
  ASSERT_EQ(modes.size(), 21);
  const VecX area = areas(0.0);
  struct Bump {
    Vec3 centre;
    double along_mm, across_mm;  // standard deviations
  };
  const auto bump = [&](int k) {
    std::vector<Eigen::Matrix<double, 7, 1>> rows;  // 1, x, y, x^2, xy, y^2; log traction
    for (const NodeIndex node : patient.craniotomy) {
      if (!(area[node] > 0.0)) continue;
      const Vec3 away = patient.mesh.nodes.col(node) - middle;
      const double x = away.dot(along), y = away.dot(across);
      const double traction = mode(modes.columns, 3 * k + 2)(2, node) / (600e-6 * area[node]);
      rows.push_back({1.0, x, y, x * x, x * y, y * y, std::log(traction)});
    }
    Eigen::MatrixXd all(static_cast<Eigen::Index>(rows.size()), 7);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      all.row(static_cast<Eigen::Index>(i)) = rows[i].transpose();
    }
    const VecX c = test_support::least_squares(all.leftCols(6), all.col(6));
    EXPECT_LT((all.leftCols(6) * c - all.col(6)).norm(), 1e-9) << k;
    Eigen::Matrix2d curvature;
    curvature << -2.0 * c[3], -c[4], -c[4], -2.0 * c[5];
    const Eigen::Vector2d at = curvature.inverse() * Eigen::Vector2d(c[1], c[2]);
    return Bump{middle + at.x() * along + at.y() * across, 1.0 / std::sqrt(curvature(0, 0)),
                1.0 / std::sqrt(curvature(1, 1))};
  };
  constexpr double kHalfEdge_mm = 1.25;  // so much of the rim the triangles leave out
  EXPECT_LT((bump(0).centre - middle).norm(), 0.5);
  for (int k = 0; k < 7; ++k) {
    EXPECT_NEAR(bump(k).along_mm, 0.45 * 27.0, 0.45 * kHalfEdge_mm) << k;
    EXPECT_NEAR(bump(k).across_mm, 0.45 * 16.0, 0.45 * kHalfEdge_mm) << k;
  }
  // The ring begins on the long axis, on either side of the middle, and goes round in sixths.
  const double side = (bump(1).centre - middle).dot(along) > 0.0 ? 1.0 : -1.0;
  const double turn = (bump(2).centre - middle).dot(across) > 0.0 ? 1.0 : -1.0;
  for (int k = 0; k < 6; ++k) {
    const double angle = k * std::numbers::pi / 3.0;
    const Vec3 expected = middle + 0.65 * (side * 27.0 * std::cos(angle) * along +
                                           turn * 16.0 * std::sin(angle) * across);
    EXPECT_LT((bump(k + 1).centre - expected).norm(), kHalfEdge_mm) << k;
  }
}

// A spatula on a part of the opening: what a pull on all of it cannot be.
TEST_F(OpeningModes, CanStandForAPushOnAPartOfIt) {
  const Vec3 middle(36, 33, 60);
  constexpr double kRadius_mm = 10.0;
  const VecX area = areas(0.0);
  VecX push = VecX::Zero(modes.columns.rows());
  Eigen::MatrixXd uniform = Eigen::MatrixXd::Zero(push.size(), 1);
  for (const NodeIndex node : patient.craniotomy) {
    const double ratio = (patient.mesh.nodes.col(node) - middle).norm() / kRadius_mm;
    push[3 * node + 2] = ratio < 1.0 ? area[node] * std::pow(1.0 - ratio * ratio, 2) : 0.0;
    uniform(3 * node + 2, 0) = area[node];
  }
  const auto left = [&](const Eigen::MatrixXd& columns) {
    const VecX fit = test_support::least_squares(columns, push);
    return (push - columns * fit).norm() / push.norm();
  };
  EXPECT_LT(left(modes.columns), 0.5);
  EXPECT_GT(left(uniform), 0.7);
}

// Along the way from the toy's opening to its tumour: three hats, of each three stresses that carry
// no net force, and two forces across the way.
TEST_F(OpeningModes, InstrumentsPressAlongTheWayToTheTumour) {
  CaseConfig config = only(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
  config.prior.tract_pressure_sd_pa = 2000.0;
  const LoadModes tract = modes_of(patient, config);
  ASSERT_EQ(tract.of_part[static_cast<std::size_t>(PriorPart::kTract)], 15);
  ASSERT_EQ(tract.size(), 15);
  const VecX area = areas(0.0);
  const Vec3 from = patient.mesh.nodes * area / area.sum();
  const Vec3 to = patient.tumour.vertices.rowwise().mean();
  const Vec3 axis = (to - from).normalized();
  const VecX volumes = fem::nodal_volumes(patient.mesh);
  const auto weight = [&](const Vec3& x, int k) {
    const double depth = axis.dot(x - from), aside = axis.cross(x - from).norm() / kTractWidth_mm;
    return std::max(0.0, 1.0 - std::abs(2.0 * depth / (to - from).norm() - k)) *
           std::exp(-0.5 * aside * aside);
  };
  for (int j = 0; j < 15; ++j) {
    const auto force = mode(tract.columns, j);
    const double size = force.colwise().norm().sum();
    const Vec3 net = force.rowwise().sum();
    ASSERT_GT(size, 0.0) << j;
    double expected = 0.0;  // 2 kPa = 0.002 N/mm^2
    for (int i = 0; i < patient.mesh.num_nodes(); ++i) {
      expected += volumes[i] * 0.002 / kTractWidth_mm * weight(patient.mesh.nodes.col(i), j / 5);
    }
    if (j % 5 < 3) {
      EXPECT_LT(net.norm(), 1e-12 * size) << j;
    } else {
      EXPECT_NEAR(net.norm(), expected, 1e-9 * expected) << j;
      EXPECT_LT(std::abs(net.dot(axis)), 1e-9 * net.norm()) << j;
    }
  }
}

// Three bumps of strain on each side of the middle, which do the work of their strain.
TEST(LoadModes, VentriclesLieOnBothSides) {
  const BrainModel patient = test_support::toy_patient(8);
  CaseConfig config = only(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
  config.prior.ventricle_volume_strain_sd = 0.05;
  const LoadModes modes = modes_of(patient, config);
  ASSERT_EQ(modes.of_part[static_cast<std::size_t>(PriorPart::kBrainVolume)], 6);
  const Points& nodes = patient.mesh.nodes;
  const Vec3 low = nodes.rowwise().minCoeff(), extent = nodes.rowwise().maxCoeff() - low;
  const Vec3 tumour = patient.tumour.vertices.rowwise().mean();
  const double kappa = bulk_modulus(config.material);
  for (int j = 0; j < 6; ++j) {
    const Vec3 place(j < 3 ? 0.4 : 0.6, 0.35 + 0.15 * (j % 3), 0.55);
    const double expected = 0.05 * expected_work(patient, low + place.cwiseProduct(extent) - tumour,
                                                 0.1 * extent.y(), [&](double) { return kappa; });
    EXPECT_NEAR(mode(modes.columns, j).cwiseProduct(nodes).sum(), expected,
                1e-9 * std::abs(expected));
  }
}

TEST(LoadModes, ATumourWithoutATetrahedronIsNamed) {
  BrainModel patient = test_support::toy_patient();
  CaseConfig config = test_support::toy_config();
  config.material.tumour = TissueStiffness{6300.0, 0.45};
  patient.tumour.vertices.colwise() += Vec3(500.0, 0.0, 0.0);
  refusal_of(load_modes(patient, config), ErrorCode::kEmptySet);
}

// A cavity of one cell of the box: pressure on its wall balances itself, and does the work p dV
// when the cavity grows.
TEST(LoadModes, VentriclesPressOnTheirWall) {
  BrainModel patient = test_support::toy_patient(6);
  std::vector<char> taken;
  for (int t = 0; t < patient.mesh.num_tets(); ++t) {
    Vec3 centre = Vec3::Zero();
    for (int k = 0; k < 4; ++k) centre += 0.25 * patient.mesh.nodes.col(patient.mesh.tets(k, t));
    taken.push_back((centre - Vec3(35, 25, 25)).cwiseAbs().maxCoeff() < 5.0);
  }
  auto cut = geometry::cut_mesh(patient.mesh, taken, {}, {});
  patient.mesh = std::move(cut.mesh);
  patient.ventricle_wall = std::move(cut.wall);
  CaseConfig config = only(0, 0, 0, 0, 0, 0);
  config.prior.ventricle_pressure_sd_pa = 500.0;
  const LoadModes modes = modes_of(patient, config);
  ASSERT_EQ(modes.of_part[static_cast<std::size_t>(PriorPart::kVentricles)], 2);
  const Points load =
      Eigen::Map<const Points>(modes.columns.col(0).data(), 3, patient.mesh.num_nodes());
  EXPECT_LT(load.rowwise().sum().norm(), 1e-15);
  const Points growing = patient.mesh.nodes.colwise() - Vec3(35, 25, 25);
  EXPECT_NEAR(load.cwiseProduct(growing).sum(), 500e-6 * 3.0 * 1000.0, 1e-12);
  const TriangleSurface wall{patient.mesh.nodes, patient.ventricle_wall};
  EXPECT_NEAR(-geometry::enclosed_volume(wall), 1000.0, 1e-9);
  config.prior.ventricle_pressure_sd_pa = 0.0;
  EXPECT_EQ(modes_of(patient, config).size(), 0);
}

}  // namespace
}  // namespace brainshift::prior
