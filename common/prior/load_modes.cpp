// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/prior/load_modes.hpp"

#include <cmath>
#include <numbers>

#include "common/fem/gravity.hpp"
#include "common/fem/swelling.hpp"

namespace brainshift::prior {
namespace {

void fill_gravity(const BrainModel& model, const CaseConfig& config,
                  Eigen::Ref<Eigen::MatrixXd> modes) {
  const Vec3 g = model.gravity_direction;
  int least = 0;
  g.cwiseAbs().minCoeff(&least);
  const Vec3 across = g.cross(Vec3::Unit(least)).normalized();
  const Vec3 directions[] = {g, across, g.cross(across)};
  const double across_sd = config.prior.gravity_mode_sd *
                           std::tan(config.prior.gravity_direction_sd_deg * std::numbers::pi / 180);
  for (Eigen::Index column = 0; column < modes.cols(); ++column) {
    const double level = config.prior.gravity_levels_mm[static_cast<std::size_t>(column / 3)];
    const double sd = column % 3 == 0 ? config.prior.gravity_mode_sd : across_sd;
    const Points load = fem::buoyancy_load(
        model.mesh, config.material, g, model.fluid_plane_depth_mm + level, directions[column % 3]);
    modes.col(column) = sd * Eigen::Map<const VecX>(load.data(), load.size());
  }
}

void fill_swelling(const BrainModel& model, const CaseConfig& config,
                   Eigen::Ref<Eigen::MatrixXd> modes) {
  const Vec3 centre = model.tumour.vertices.rowwise().mean();
  const auto& radii = config.prior.swelling_radii_mm;
  const double sd = config.prior.swelling_strain_sd / std::sqrt(static_cast<double>(radii.size()));
  for (Eigen::Index column = 0; column < modes.cols(); ++column) {
    const double radius = radii[static_cast<std::size_t>(column / 4)];
    const Eigen::Index kind = column % 4;
    const Points load = fem::swelling_load(model.mesh, config.material, [&](const Vec3& x) {
      const Vec3 arm = (x - centre) / radius;
      const double gaussian = std::exp(-0.5 * arm.squaredNorm());
      return kind == 0 ? gaussian : std::exp(0.5) * arm[kind - 1] * gaussian;
    });
    modes.col(column) = sd * Eigen::Map<const VecX>(load.data(), load.size());
  }
}

}  // namespace

LoadModeCounts load_mode_counts(const PriorConfig& config) {
  LoadModeCounts counts;
  if (config.gravity_mode_sd > 0.0) {
    counts.gravity = 3 * static_cast<int>(config.gravity_levels_mm.size());
  }
  if (config.swelling_strain_sd > 0.0) {
    counts.swelling = 4 * static_cast<int>(config.swelling_radii_mm.size());
  }
  return counts;
}

Eigen::MatrixXd load_modes(const BrainModel& model, const CaseConfig& config) {
  const LoadModeCounts counts = load_mode_counts(config.prior);
  Eigen::MatrixXd modes(model.mesh.nodes.size(), counts.all());
  fill_gravity(model, config, modes.leftCols(counts.gravity));
  fill_swelling(model, config, modes.rightCols(counts.swelling));
  return modes;
}

PriorPart prior_part(int column, const LoadModeCounts& counts) {
  if (column >= counts.all()) return PriorPart::kOther;
  if (column >= counts.gravity) return PriorPart::kSwelling;
  return column % 3 == 0 ? PriorPart::kAlongGravity : PriorPart::kAcrossGravity;
}

}  // namespace brainshift::prior
