// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/prior/load_modes.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <vector>

#include "common/contact/forward_model.hpp"
#include "common/core/units.hpp"
#include "common/fem/body_loads.hpp"
#include "common/geometry/surface.hpp"

namespace brainshift::prior {
namespace {

// Collects columns part by part.
class Columns {
 public:
  explicit Columns(Eigen::Index rows) : rows_(rows) {}
  void add(PriorPart part, double sd, const Points& load) {
    values_.insert(values_.end(), load.data(), load.data() + load.size());
    Eigen::Map<VecX>(values_.data() + values_.size() - load.size(), load.size()) *= sd;
    ++of_part_[static_cast<std::size_t>(part)];
  }
  LoadModes modes() const {
    const auto columns = static_cast<Eigen::Index>(values_.size()) / rows_;
    return {Eigen::Map<const Eigen::MatrixXd>(values_.data(), rows_, columns), of_part_};
  }

 private:
  Eigen::Index rows_;
  std::vector<double> values_;
  PerPart<int> of_part_{};
};

// Two unit vectors across `along` and across one another.
std::pair<Vec3, Vec3> across(const Vec3& along) {
  int least = 0;
  along.cwiseAbs().minCoeff(&least);
  const Vec3 first = along.cross(Vec3::Unit(least)).normalized();
  return {first, along.cross(first)};
}

void add_gravity(const BrainModel& model, const CaseConfig& config, Columns& out) {
  const PriorConfig& prior = config.prior;
  if (prior.gravity_mode_sd == 0.0) return;
  const Vec3 g = model.gravity_direction;
  const auto load = [&](double level_mm, const Vec3& direction) -> Points {
    return fem::buoyancy_load(model.mesh, config.material, g, model.fluid_plane_depth_mm + level_mm,
                              direction);
  };
  const Vec3 middle =
      0.5 * (model.mesh.nodes.rowwise().minCoeff() + model.mesh.nodes.rowwise().maxCoeff());
  const auto add_uneven = [&](PriorPart part, double sd, int axis) {
    if (sd == 0.0) return;
    const Eigen::RowVectorXd side =
        ((model.mesh.nodes.row(axis).array() - middle[axis]) / kMidlineWidth_mm).tanh();
    for (const double level : prior.gravity_levels_mm) {
      out.add(part, sd, load(level, g).array().rowwise() * side.array());
    }
  };
  const bool parted = !model.septa.slaves.empty() && prior.gravity_sides_sd > 0.0;
  for (const double level : prior.gravity_levels_mm) {
    out.add(PriorPart::kAlongGravity, prior.gravity_mode_sd, load(level, g));
  }
  if (parted) add_uneven(PriorPart::kAlongGravity, kHalvesApart * prior.gravity_mode_sd, 0);
  const double across_sd =
      prior.gravity_mode_sd * std::tan(prior.gravity_direction_sd_deg * std::numbers::pi / 180.0);
  if (across_sd > 0.0) {
    const auto [first, second] = across(g);
    for (const double level : prior.gravity_levels_mm) {
      out.add(PriorPart::kAcrossGravity, across_sd, load(level, first));
      out.add(PriorPart::kAcrossGravity, across_sd, load(level, second));
    }
  }
  if (!parted) add_uneven(PriorPart::kGravitySides, prior.gravity_sides_sd, 0);
  add_uneven(PriorPart::kGravityEnds, prior.gravity_ends_sd, 1);
}

// Bumps of one radius, at the places i, j, k of a lattice about the tumour.
struct Bumps {
  std::vector<Vec3> centres;
  double height = 1.0;  // of each, so that the strain of all together has variance 1 at the tumour
};

Bumps bumps_around(const Vec3& tumour, double radius) {
  Bumps bumps;
  double variance = 0.0;
  for (int i = -1; i <= 1; ++i) {
    for (int j = -1; j <= 1; ++j) {
      for (int k = -1; k <= 1; ++k) {
        const Vec3 away = std::sqrt(2.0) * radius * Vec3(i, j, k);
        if (away != Vec3::Zero() && away.norm() > kTumourVolumeReach_mm) continue;
        bumps.centres.emplace_back(tumour + away);
        variance += std::exp(-away.squaredNorm() / (radius * radius));
      }
    }
  }
  bumps.height = 1.0 / std::sqrt(variance);
  return bumps;
}

void add_tumour_volume(const BrainModel& model, const PriorConfig& prior,
                       const std::vector<fem::Elasticity>& of_tet, Columns& out) {
  const auto& radii = prior.tumour_volume_radii_mm;
  if (prior.tumour_volume_strain_sd == 0.0 || radii.empty()) return;
  const Vec3 tumour = model.tumour.vertices.rowwise().mean();
  const double sd = prior.tumour_volume_strain_sd / std::sqrt(static_cast<double>(radii.size()));
  for (const double radius : radii) {
    const Bumps bumps = bumps_around(tumour, radius);
    for (const Vec3& centre : bumps.centres) {
      const auto strain = [&](const Vec3& x) {
        return bumps.height * std::exp(-0.5 * ((x - centre) / radius).squaredNorm());
      };
      out.add(PriorPart::kTumourVolume, sd, fem::swelling_load(model.mesh, of_tet, strain));
    }
  }
}

void add_brain_volume(const BrainModel& model, const PriorConfig& prior,
                      const std::vector<fem::Elasticity>& of_tet, Columns& out) {
  if (prior.brain_volume_strain_sd == 0.0) return;
  const Vec3 low = model.mesh.nodes.rowwise().minCoeff();
  const Vec3 high = model.mesh.nodes.rowwise().maxCoeff();
  const Vec3 middle = 0.5 * (low + high), half = 0.5 * (high - low);
  const auto add = [&](const auto& strain) {
    out.add(PriorPart::kBrainVolume, prior.brain_volume_strain_sd,
            fem::swelling_load(model.mesh, of_tet, strain));
  };
  add([](const Vec3&) { return 1.0; });
  add([&](const Vec3& x) { return std::tanh((x.x() - middle.x()) / kMidlineWidth_mm); });
  add([&](const Vec3& x) { return (x.y() - middle.y()) / half.y(); });
  add([&](const Vec3& x) { return (x.z() - middle.z()) / half.z(); });
}

void add_ventricles(const BrainModel& model, const PriorConfig& prior,
                    const std::vector<fem::Elasticity>& of_tet, Columns& out) {
  if (prior.ventricle_volume_strain_sd == 0.0 || model.ventricle_wall.cols() > 0) return;
  const Vec3 low = model.mesh.nodes.rowwise().minCoeff();
  const Vec3 extent = model.mesh.nodes.rowwise().maxCoeff() - low;
  for (const double side : {-1.0, 1.0}) {
    for (const double ahead : {-1.0, 0.0, 1.0}) {
      const Vec3 from_middle(side * kVentriclesApart, ahead * kVentricleLength, kVentriclesAbove);
      const Vec3 centre = low + (from_middle.array() + 0.5).matrix().cwiseProduct(extent);
      const auto strain = [&](const Vec3& x) {
        return std::exp(-0.5 * ((x - centre) / (kVentricleWidth * extent.y())).squaredNorm());
      };
      out.add(PriorPart::kBrainVolume, prior.ventricle_volume_strain_sd,
              fem::swelling_load(model.mesh, of_tet, strain));
    }
  }
}

void add_resection(const BrainModel& model, const CaseConfig& config, Columns& out) {
  const Vec3 centre = model.tumour.vertices.rowwise().mean();
  const double radius = std::cbrt(std::abs(geometry::enclosed_volume(model.tumour))) /
                        std::sqrt(2.0 * std::numbers::pi);
  const auto weight = [&](const Vec3& x) {
    return std::exp(-0.5 * (x - centre).squaredNorm() / (radius * radius));
  };
  if (config.prior.resection_weight_sd > 0.0) {
    const double density =
        units::weight_density_from_kg_m3(config.material.tissue_density_kg_m3);  // N/mm^3
    const VecX volumes = fem::nodal_volumes(model.mesh);
    for (int axis = 0; axis < 3; ++axis) {
      Points load = Points::Zero(3, model.mesh.num_nodes());
      for (int i = 0; i < model.mesh.num_nodes(); ++i) {
        load(axis, i) = density * volumes[i] * weight(model.mesh.nodes.col(i));
      }
      out.add(PriorPart::kResection, config.prior.resection_weight_sd, load);
    }
  }
  if (config.prior.resection_stress_sd_pa > 0.0) {
    const double sd = units::stress_from_pa(config.prior.resection_stress_sd_pa);
    for (int i = 0; i < 3; ++i) {
      for (int j = i; j < 3; ++j) {
        Mat3 component = Mat3::Zero();
        component(i, j) = component(j, i) = 1.0;
        out.add(PriorPart::kResection, sd,
                fem::initial_stress_load(
                    model.mesh, [&](const Vec3& x) -> Mat3 { return weight(x) * component; }));
      }
    }
  }
}

// The triangles between three craniotomy nodes, like an ellipse in a plane.
struct Opening {
  std::vector<NodeIndex> nodes;
  VecX areas_mm2;  // per node
  Vec3 centre = Vec3::Zero();
  Vec3 long_half_axis = Vec3::Zero(), short_half_axis = Vec3::Zero();  // mm

  bool empty() const { return !(areas_mm2.sum() > 0.0); }
  std::vector<Vec3> bump_centres() const {
    std::vector<Vec3> centres = {centre};
    for (int k = 0; k < kBumpsOfRing; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / kBumpsOfRing;
      centres.emplace_back(
          centre + kRing * (std::cos(angle) * long_half_axis + std::sin(angle) * short_half_axis));
    }
    return centres;
  }
  double bump(const Vec3& at, const Vec3& x) const {
    const double a = long_half_axis.dot(x - at) / long_half_axis.squaredNorm();
    const double b = short_half_axis.dot(x - at) / short_half_axis.squaredNorm();
    return std::exp(-0.5 * (a * a + b * b) / (kBumpWidth * kBumpWidth));
  }
};

// An ellipse whose area has the second moments of the nodes' areas: a quarter of the squares of its
// half axes. surface: a vertex for each of the nodes.
void fit_ellipse(const TriangleSurface& surface, Opening& opening) {
  const double area = opening.areas_mm2.sum();
  opening.centre = surface.vertices * opening.areas_mm2 / area;
  const auto plane = across(geometry::vector_area(surface).normalized());
  Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
  for (Eigen::Index i = 0; i < surface.vertices.cols(); ++i) {
    const Vec3 away = surface.vertices.col(i) - opening.centre;
    const Eigen::Vector2d place(away.dot(plane.first), away.dot(plane.second));
    moments += opening.areas_mm2[i] / area * place * place.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(moments);
  const auto half_axis = [&](int k) -> Vec3 {
    const double length = 2.0 * std::sqrt(std::max(0.0, axes.eigenvalues()[k]));
    return length *
           (axes.eigenvectors()(0, k) * plane.first + axes.eigenvectors()(1, k) * plane.second);
  };
  opening.short_half_axis = half_axis(0);
  opening.long_half_axis = half_axis(1);
}

Opening opening_of(const BrainModel& model) {
  Opening opening;
  opening.nodes = model.craniotomy;
  std::sort(opening.nodes.begin(), opening.nodes.end());
  const TriangleSurface surface =
      geometry::surface_between(model.mesh.nodes, model.boundary_triangles, opening.nodes);
  opening.areas_mm2 = geometry::vertex_areas(surface);
  if (!opening.empty()) fit_ellipse(surface, opening);
  return opening;
}

void add_opening(const BrainModel& model, const PriorConfig& prior, const Opening& opening,
                 Columns& out) {
  if (prior.opening_pressure_sd_pa == 0.0 || opening.empty()) return;
  const auto add = [&](const auto& traction) {
    Points load = Points::Zero(3, model.mesh.num_nodes());
    for (std::size_t i = 0; i < opening.nodes.size(); ++i) {
      load.col(opening.nodes[i]) = opening.areas_mm2[static_cast<Eigen::Index>(i)] *
                                   traction(Vec3(model.mesh.nodes.col(opening.nodes[i])));
    }
    out.add(PriorPart::kOpening, units::stress_from_pa(prior.opening_pressure_sd_pa), load);
  };
  for (const Vec3& centre : opening.bump_centres()) {
    for (int axis = 0; axis < 3; ++axis) {
      add([&opening, centre, axis](const Vec3& x) -> Vec3 {
        return opening.bump(centre, x) * Vec3::Unit(axis);
      });
    }
  }
}

void add_ventricle_pressure(const BrainModel& model, const PriorConfig& prior, Columns& out) {
  if (prior.ventricle_pressure_sd_pa == 0.0 || model.ventricle_wall.cols() == 0) return;
  const double middle =
      0.5 * (model.mesh.nodes.row(0).minCoeff() + model.mesh.nodes.row(0).maxCoeff());
  const auto add = [&](const auto& pressure) {
    out.add(PriorPart::kVentricles, units::stress_from_pa(prior.ventricle_pressure_sd_pa),
            fem::wall_pressure_load(model.mesh.nodes, model.ventricle_wall, pressure));
  };
  add([](const Vec3&) { return 1.0; });
  add([&](const Vec3& x) { return std::tanh((x.x() - middle) / kMidlineWidth_mm); });
}

void add_tract(const BrainModel& model, const PriorConfig& prior, const Opening& opening,
               Columns& out) {
  if (prior.tract_pressure_sd_pa == 0.0 || opening.empty()) return;
  const Vec3 way = Vec3(model.tumour.vertices.rowwise().mean()) - opening.centre;
  if (!(way.norm() > kTractWidth_mm)) return;  // the tumour lies in the opening
  const Vec3 axis = way.normalized();
  const auto [first, second] = across(axis);
  const double pressure = units::stress_from_pa(prior.tract_pressure_sd_pa);
  const VecX volumes = fem::nodal_volumes(model.mesh);
  for (int k = 0; k < 3; ++k) {
    const auto weight = [&](const Vec3& x) {
      const double depth = axis.dot(x - opening.centre);
      const double aside = (x - opening.centre - depth * axis).norm() / kTractWidth_mm;
      return std::max(0.0, 1.0 - std::abs(2.0 * depth / way.norm() - k)) *
             std::exp(-0.5 * aside * aside);
    };
    for (const Mat3& component :
         {Mat3(first * first.transpose()), Mat3(second * second.transpose()),
          Mat3(first * second.transpose() + second * first.transpose())}) {
      out.add(PriorPart::kTract, pressure,
              fem::initial_stress_load(
                  model.mesh, [&](const Vec3& x) -> Mat3 { return weight(x) * component; }));
    }
    for (const Vec3& direction : {first, second}) {
      Points load = Points::Zero(3, model.mesh.num_nodes());
      for (int i = 0; i < model.mesh.num_nodes(); ++i) {
        load.col(i) = volumes[i] * weight(model.mesh.nodes.col(i)) / kTractWidth_mm * direction;
      }
      out.add(PriorPart::kTract, pressure, load);
    }
  }
}

}  // namespace

Result<LoadModes> load_modes(const BrainModel& model, const CaseConfig& config) {
  const auto tissues = contact::tissue_map(model, config.material);
  if (!tissues) return tl::unexpected(tissues.error());
  const std::vector<fem::Elasticity> of_tet = tissues->elastic();
  Columns columns(model.mesh.nodes.size());
  add_gravity(model, config, columns);
  add_tumour_volume(model, config.prior, of_tet, columns);
  add_brain_volume(model, config.prior, of_tet, columns);
  add_ventricles(model, config.prior, of_tet, columns);
  add_resection(model, config, columns);
  const Opening opening = opening_of(model);
  add_opening(model, config.prior, opening, columns);
  add_ventricle_pressure(model, config.prior, columns);
  add_tract(model, config.prior, opening, columns);
  return columns.modes();
}

PriorPart part_of_column(int column, const PerPart<int>& of_part) {
  int last = 0;
  for (std::size_t part = 0; part < of_part.size(); ++part) {
    last += of_part[part];
    if (column < last) return static_cast<PriorPart>(part);
  }
  assert(false);
  return PriorPart::kCoarse;
}

}  // namespace brainshift::prior
