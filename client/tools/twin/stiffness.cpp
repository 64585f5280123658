// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/stiffness.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/core/random.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/geometry/surface.hpp"

namespace brainshift::client {
namespace {

constexpr int kFeatures = 200;

constexpr double kWidestClass = 2.0;  // standard deviations
constexpr double kClassStep = 2.0 * kWidestClass / (kStiffnessClasses - 1);

// From 1; see kStiffnessClasses.
int class_of(double z) {
  const double inside = std::clamp(z, -kWidestClass, kWidestClass);
  return 1 + static_cast<int>(std::lround((inside + kWidestClass) / kClassStep));
}
double class_middle(int label) { return kClassStep * (label - 1) - kWidestClass; }

Vec3 centroid_of(const TetMesh& mesh, int tet) {
  Vec3 centroid = Vec3::Zero();
  for (int k = 0; k < 4; ++k) centroid += 0.25 * mesh.nodes.col(mesh.tets(k, tet));
  return centroid;
}

// Tells tissues apart by place.
class Tissues {
 public:
  static Result<Tissues> build(const BrainModel& model) {
    auto tumour = geometry::ClosestPointIndex::build(model.tumour);
    if (!tumour) return tl::unexpected(tumour.error());
    auto brain = geometry::ClosestPointIndex::build(
        geometry::surface_of(model.mesh.nodes, model.boundary_triangles));
    if (!brain) return tl::unexpected(brain.error());
    return Tissues(model.mesh.nodes, std::move(*tumour), std::move(*brain));
  }
  Tissue at(const Vec3& x) const {
    if (tumour_.contains(x)) return Tissue::kTumour;
    if (brain_.closest(x).distance_mm < kCortex_mm) return Tissue::kGrey;
    // The ventricle of the half that x lies in, in units of its half axes.
    const Vec3 place = (x - low_).cwiseQuotient(extent_) - Vec3(0.5, 0.5, 0.55);
    const Vec3 offset(std::abs(place[0]) - kVentricleAside, place[1], place[2]);
    const bool inside = offset.cwiseQuotient(Vec3(0.045, 0.16, 0.07)).norm() < 1.0;
    return inside ? Tissue::kVentricle : Tissue::kWhite;
  }

 private:
  Tissues(const Points& nodes, geometry::ClosestPointIndex tumour,
          geometry::ClosestPointIndex brain)
      : tumour_(std::move(tumour)),
        brain_(std::move(brain)),
        low_(nodes.rowwise().minCoeff()),
        extent_(Vec3(nodes.rowwise().maxCoeff()) - low_) {}
  static constexpr double kVentricleAside = 0.08;
  geometry::ClosestPointIndex tumour_, brain_;
  Vec3 low_, extent_;
};

}  // namespace

GaussianField::GaussianField(double length_mm, std::uint64_t seed)
    : waves_(3, kFeatures), phases_(kFeatures) {
  Random random(seed);
  for (int m = 0; m < kFeatures; ++m) {
    for (int axis = 0; axis < 3; ++axis) waves_(axis, m) = random.normal() / length_mm;
    phases_[m] = 2.0 * std::numbers::pi * random.uniform();
  }
}

double GaussianField::at(const Vec3& x) const {
  const VecX angles = waves_.transpose() * x + phases_;
  return std::sqrt(2.0 / kFeatures) * angles.array().cos().sum();
}

double normal_cdf(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

VariedBrain vary_stiffness(const BrainModel& model, const CaseConfig& config, double sd,
                           double length_mm, std::uint64_t seed) {
  VariedBrain varied{model, config};
  const GaussianField field(length_mm, seed);
  TetMesh& mesh = varied.model.mesh;
  mesh.labels.resize(static_cast<std::size_t>(mesh.num_tets()));
  varied.config.material.regions.clear();
  for (int t = 0; t < mesh.num_tets(); ++t) {
    const int label = class_of(field.at(centroid_of(mesh, t)));
    mesh.labels[static_cast<std::size_t>(t)] = label;
    TissueStiffness tissue{config.material.shear_modulus_pa, config.material.poisson_ratio};
    tissue.shear_modulus_pa *= std::exp(sd * class_middle(label));
    varied.config.material.regions[label] = tissue;
  }
  return varied;
}

Result<VariedBrain> vary_tissues(const BrainModel& model, const CaseConfig& config,
                                 std::uint64_t seed) {
  const auto tissues = Tissues::build(model);
  if (!tissues) return tl::unexpected(tissues.error());
  Random random(seed);
  double factor[kTissues];
  for (double& each : factor) each = random.uniform() < 0.5 ? 1.0 - kTissueSd : 1.0 + kTissueSd;
  std::vector<GaussianField> fields;
  for (const double length : kTissueLengths_mm) fields.emplace_back(length, seed + fields.size());

  VariedBrain varied{model, config};
  TetMesh& mesh = varied.model.mesh;
  mesh.labels.resize(static_cast<std::size_t>(mesh.num_tets()));
  varied.config.material.tumour.reset();
  varied.config.material.regions.clear();
  for (int t = 0; t < mesh.num_tets(); ++t) {
    const Vec3 centroid = centroid_of(mesh, t);
    double z = 0.0;
    for (const GaussianField& field : fields) z += field.at(centroid);
    const int level = class_of(z / std::sqrt(static_cast<double>(fields.size())));
    const auto tissue = static_cast<int>(tissues->at(centroid));
    const int label = tissue * kStiffnessClasses + level;
    mesh.labels[static_cast<std::size_t>(t)] = label;
    TissueStiffness stiffness{config.material.shear_modulus_pa, config.material.poisson_ratio};
    stiffness.shear_modulus_pa *= factor[tissue] * std::exp(kTissueSd * class_middle(level));
    varied.config.material.regions[label] = stiffness;
  }
  return varied;
}

}  // namespace brainshift::client
