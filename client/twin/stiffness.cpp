// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/twin/stiffness.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/core/random.hpp"

namespace brainshift::client {
namespace {

constexpr int kFeatures = 200;
constexpr double kWidestClass = 2.0;  // standard deviations

class GaussianField {
 public:
  GaussianField(double length_mm, std::uint64_t seed) : waves_(3, kFeatures), phases_(kFeatures) {
    Random random(seed);
    for (int m = 0; m < kFeatures; ++m) {
      for (int axis = 0; axis < 3; ++axis) waves_(axis, m) = random.normal() / length_mm;
      phases_[m] = 2.0 * std::numbers::pi * random.uniform();
    }
  }
  double at(const Vec3& x) const {
    const VecX angles = waves_.transpose() * x + phases_;
    return std::sqrt(2.0 / kFeatures) * angles.array().cos().sum();
  }

 private:
  Points waves_;
  VecX phases_;
};

}  // namespace

VariedBrain vary_stiffness(const BrainModel& model, const CaseConfig& config, double sd,
                           double length_mm, std::uint64_t seed) {
  VariedBrain varied{model, config};
  const GaussianField field(length_mm, seed);
  const double step = 2.0 * kWidestClass / (kStiffnessClasses - 1);
  TetMesh& mesh = varied.model.mesh;
  mesh.labels.resize(static_cast<std::size_t>(mesh.num_tets()));
  varied.config.material.regions.clear();
  for (int t = 0; t < mesh.num_tets(); ++t) {
    Vec3 centroid = Vec3::Zero();
    for (int k = 0; k < 4; ++k) centroid += 0.25 * mesh.nodes.col(mesh.tets(k, t));
    const double z = std::clamp(field.at(centroid), -kWidestClass, kWidestClass);
    const int label = 1 + static_cast<int>(std::lround((z + kWidestClass) / step));
    mesh.labels[static_cast<std::size_t>(t)] = label;
    TissueStiffness tissue{config.material.shear_modulus_pa, config.material.poisson_ratio};
    tissue.shear_modulus_pa *= std::exp(sd * (step * (label - 1) - kWidestClass));
    varied.config.material.regions[label] = tissue;
  }
  return varied;
}

}  // namespace brainshift::client
