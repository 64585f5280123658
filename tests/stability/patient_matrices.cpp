// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/stability/patient_matrices.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <utility>

namespace brainshift::stability {
namespace {

// Distances and weights that differ by less are equal, mm: far above rounding of the coordinates,
// far below what moves an answer.
constexpr Real kTie = 1e-9L;

Vec3R at(const Points& points, Eigen::Index i) { return points.col(i).cast<Real>(); }

Real tet_volume(const TetMesh& mesh, int t) {
  const Vec3R origin = at(mesh.nodes, mesh.tets(0, t));
  Mat3R arms;
  for (int k = 0; k < 3; ++k) arms.col(k) = at(mesh.nodes, mesh.tets(k + 1, t)) - origin;
  return std::abs(arms.determinant()) / 6;
}

VectorR node_volumes(const TetMesh& mesh) {
  VectorR volumes = VectorR::Zero(mesh.num_nodes());
  for (int t = 0; t < mesh.num_tets(); ++t) {
    for (int k = 0; k < 4; ++k) volumes[mesh.tets(k, t)] += tet_volume(mesh, t) / 4;
  }
  return volumes;
}

// Sum of the outward area vectors of the faces of one tetrahedron only, per node.
PointsR boundary_normals(const TetMesh& mesh) {
  std::map<std::array<int, 3>, std::pair<int, Vec3R>> faces;  // sorted nodes: count, area vector
  for (int t = 0; t < mesh.num_tets(); ++t) {
    for (int apex = 0; apex < 4; ++apex) {
      std::array<int, 3> nodes{};
      for (int k = 0, i = 0; k < 4; ++k) {
        if (k != apex) nodes[static_cast<std::size_t>(i++)] = mesh.tets(k, t);
      }
      std::sort(nodes.begin(), nodes.end());
      const Vec3R a = at(mesh.nodes, nodes[0]);
      Vec3R area = (at(mesh.nodes, nodes[1]) - a).cross(at(mesh.nodes, nodes[2]) - a) / 2;
      if (area.dot(at(mesh.nodes, mesh.tets(apex, t)) - a) > 0) area = -area;
      auto& face = faces[nodes];
      ++face.first;
      face.second = area;
    }
  }
  PointsR normals = PointsR::Zero(3, mesh.num_nodes());
  for (const auto& [nodes, face] : faces) {
    if (face.first != 1) continue;
    for (const int node : nodes) normals.col(node) += face.second;
  }
  return normals;
}

Unknowns supports(const BrainModel& brain) {
  const PointsR normals = boundary_normals(brain.mesh);
  const int n = brain.mesh.num_nodes();
  Unknowns unknowns;
  unknowns.frames.assign(static_cast<std::size_t>(n), Mat3R::Identity());
  unknowns.index.assign(static_cast<std::size_t>(n), {0, 0, 0});
  for (const NodeIndex node : brain.fixed) {
    const Vec3R normal = normals.col(node).normalized();
    Mat3R& frame = unknowns.frames[static_cast<std::size_t>(node)];
    frame.col(0) = normal;
    frame.col(1) = normal.unitOrthogonal();
    frame.col(2) = normal.cross(frame.col(1));
    unknowns.index[static_cast<std::size_t>(node)][0] = -1;
  }
  for (auto& axes : unknowns.index) {
    for (int& k : axes) {
      if (k >= 0) k = unknowns.count++;
    }
  }
  return unknowns;
}

// --- Contact
// -------------------------------------------------------------------------------------

struct Foot {
  Vec3R point, outward;
};

class Skull {
 public:
  explicit Skull(const TriangleSurface& surface) : surface_(surface) {
    vertex_normals_.setZero(3, surface.num_vertices());
    for (int t = 0; t < surface.num_triangles(); ++t) {
      const Vec3R area = area_vector(t);
      for (int k = 0; k < 3; ++k) {
        vertex_normals_.col(surface.triangles(k, t)) += area;
        Vec3R& sum = edge_normals_.try_emplace(edge(t, k), Vec3R::Zero()).first->second;
        sum += area.normalized();
      }
    }
  }

  // Closest node; its triangles that hold a projection; failing that their edges and the node.
  // All that are equally close.
  std::vector<Foot> feet(const Vec3R& slave) const {
    VectorR distances(surface_.num_vertices());
    for (int v = 0; v < surface_.num_vertices(); ++v) distances[v] = (vertex(v) - slave).norm();
    const Real nearest = distances.minCoeff();
    std::vector<Foot> faces, others;
    for (int v = 0; v < surface_.num_vertices(); ++v) {
      if (distances[v] > nearest + kTie) continue;
      others.push_back({vertex(v), vertex_normals_.col(v).normalized()});
      for (int t = 0; t < surface_.num_triangles(); ++t) {
        if ((surface_.triangles.col(t).array() == v).any()) add(t, slave, faces, others);
      }
    }
    return closest(faces.empty() ? others : faces, slave);
  }

 private:
  using Edge = std::pair<int, int>;

  Vec3R vertex(int v) const { return at(surface_.vertices, v); }
  Vec3R corner(int t, int k) const { return vertex(surface_.triangles(k % 3, t)); }
  Edge edge(int t, int k) const {
    return std::minmax({surface_.triangles(k, t), surface_.triangles((k + 1) % 3, t)});
  }
  Vec3R area_vector(int t) const {
    return (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0)) / 2;
  }

  void add(int t, const Vec3R& slave, std::vector<Foot>& faces, std::vector<Foot>& others) const {
    const Vec3R normal = area_vector(t).normalized();
    const Vec3R foot = slave - normal.dot(slave - corner(t, 0)) * normal;
    bool inside = true;
    for (int k = 0; k < 3; ++k) {
      const Vec3R a = corner(t, k), along = corner(t, k + 1) - a;
      inside = inside && normal.dot(along.cross(foot - a)) >= -kTie * along.norm();
      const Real s = along.dot(slave - a) / along.squaredNorm();
      if (s >= 0 && s <= 1) {
        others.push_back({a + s * along, edge_normals_.at(edge(t, k)).normalized()});
      }
    }
    if (inside) faces.push_back({foot, normal});
  }

  static std::vector<Foot> closest(const std::vector<Foot>& all, const Vec3R& slave) {
    Real least = std::numeric_limits<Real>::infinity();
    for (const Foot& foot : all) least = std::min(least, (foot.point - slave).norm());
    std::vector<Foot> result;
    for (const Foot& foot : all) {
      if ((foot.point - slave).norm() <= least + kTie) result.push_back(foot);
    }
    return result;
  }

  const TriangleSurface& surface_;
  PointsR vertex_normals_;
  std::map<Edge, Vec3R> edge_normals_;
};

std::vector<ReferencePair> contact_pairs(const BrainModel& brain,
                                         const std::vector<contact::ContactPair>& product_pairs) {
  const Skull skull(brain.skull);
  std::vector<ReferencePair> pairs;
  for (std::size_t i = 0; i < brain.slaves.size(); ++i) {
    const Vec3R slave = at(brain.mesh.nodes, brain.slaves[i]);
    const std::vector<Foot> feet = skull.feet(slave);
    const Vec3R wanted = -product_pairs[i].normal.cast<Real>();
    const Foot* chosen = &feet.front();
    for (const Foot& foot : feet) {
      if ((foot.outward - wanted).norm() < kTie) chosen = &foot;
    }
    const Vec3R normal = -chosen->outward;
    pairs.push_back({brain.slaves[i], normal, (chosen->point - slave).dot(normal)});
  }
  return pairs;
}

// --- Prior
// ---------------------------------------------------------------------------------------

MatrixR kernel_of(const TetMesh& mesh, const PriorConfig& prior) {
  const VectorR volumes = node_volumes(mesh);
  const Real support = Real(4.2L) * static_cast<Real>(prior.correlation_length_mm);
  const Real density = static_cast<Real>(prior.force_density_sd_n_m3) * Real(1e-9L);
  MatrixR kernel = MatrixR::Zero(mesh.num_nodes(), mesh.num_nodes());
  for (int j = 0; j < mesh.num_nodes(); ++j) {
    for (int i = 0; i < mesh.num_nodes(); ++i) {
      const Real t = (at(mesh.nodes, i) - at(mesh.nodes, j)).norm() / support;
      if (t >= 1) continue;
      kernel(i, j) =
          density * density * volumes[i] * volumes[j] * std::pow(1 - t, Real(4)) * (4 * t + 1);
    }
  }
  return kernel;
}

// Weight less buoyancy of the tissue above a fluid plane (and of that below it), along
// `direction`.
VectorR buoyancy(const BrainModel& brain, const Material& material, Real plane_depth_mm,
                 const Vec3R& direction) {
  const TetMesh& mesh = brain.mesh;
  const auto weight = [&](double fluid_kg_m3) {
    const Real difference = static_cast<Real>(material.tissue_density_kg_m3) - fluid_kg_m3;
    return difference * Real(9.80665L) * Real(1e-9L);
  };
  const Real above = weight(material.fluid_density_unsaturated_kg_m3);
  const Real below = weight(material.fluid_density_saturated_kg_m3);
  const Vec3R gravity = brain.gravity_direction.cast<Real>();
  VectorR load = VectorR::Zero(3 * mesh.num_nodes());
  for (int t = 0; t < mesh.num_tets(); ++t) {
    Eigen::Matrix<Real, 4, 1> height;
    for (int k = 0; k < 4; ++k) {
      height[k] = gravity.dot(at(mesh.nodes, mesh.tets(k, t))) - plane_depth_mm;
    }
    const Real part = negative_part(height);
    const Real force = tet_volume(mesh, t) * (part * above + (1 - part) * below);
    for (int k = 0; k < 4; ++k) load.segment<3>(3 * mesh.tets(k, t)) += force / 4 * direction;
  }
  return load;
}

void add_modes(const BrainModel& brain, const CaseConfig& config, PatientMatrices& out) {
  const PriorConfig& prior = config.prior;
  const std::size_t levels = prior.gravity_mode_sd > 0.0 ? prior.gravity_levels_mm.size() : 0;
  out.modes.resize(3 * brain.mesh.num_nodes(), 3 * static_cast<Eigen::Index>(levels));
  const Vec3R along = brain.gravity_direction.cast<Real>();
  const Vec3R first = along.unitOrthogonal();
  const Vec3R directions[] = {along, first, along.cross(first)};
  const Real sd = prior.gravity_mode_sd;
  const Real across_sd = sd * std::tan(static_cast<Real>(prior.gravity_direction_sd_deg) *
                                       std::numbers::pi_v<Real> / 180);
  for (std::size_t level = 0; level < levels; ++level) {
    const Real plane = static_cast<Real>(brain.fluid_plane_depth_mm) +
                       static_cast<Real>(prior.gravity_levels_mm[level]);
    for (int k = 0; k < 3; ++k) {
      out.modes.col(static_cast<Eigen::Index>(out.part_of_mode.size())) =
          (k == 0 ? sd : across_sd) * buoyancy(brain, config.material, plane, directions[k]);
      out.part_of_mode.push_back(k == 0 ? PriorPart::kAlongGravity : PriorPart::kAcrossGravity);
    }
  }
}

}  // namespace

// An edge that crosses zero divides the tetrahedron in two of proportional volumes.
Real negative_part(Eigen::Matrix<Real, 4, 1> values) {
  if (values.minCoeff() >= 0) return 0;
  if (values.maxCoeff() <= 0) return 1;
  Eigen::Index low = 0, high = 0;
  const Real least = values.minCoeff(&low), most = values.maxCoeff(&high);
  const Real share = least / (least - most);  // of the edge, at the negative corner
  Eigen::Matrix<Real, 4, 1> negative = values, positive = values;
  negative[high] = 0;
  positive[low] = 0;
  return share * negative_part(negative) + (1 - share) * negative_part(positive);
}

PatientMatrices patient_matrices(const BrainModel& brain, const CaseConfig& config,
                                 const std::vector<contact::ContactPair>& product_pairs) {
  PatientMatrices out;
  out.unknowns = supports(brain);
  const Material& material = config.material;
  out.stiffness = reference_stiffness(
      brain.mesh, {reference_elasticity(material.shear_modulus_pa, material.poisson_ratio)},
      out.unknowns);
  out.pairs = contact_pairs(brain, product_pairs);
  out.kernel = kernel_of(brain.mesh, config.prior);
  add_modes(brain, config, out);
  return out;
}

MatrixR sampling_weights(const TetMesh& mesh, const Points& positions) {
  MatrixR weights = MatrixR::Zero(positions.cols(), mesh.num_nodes());
  using Corners = Eigen::Matrix<Real, 4, 4>;
  std::vector<Corners> barycentric;
  for (int t = 0; t < mesh.num_tets(); ++t) {
    Corners corners = Corners::Ones();
    for (int k = 0; k < 4; ++k) corners.col(k).tail<3>() = at(mesh.nodes, mesh.tets(k, t));
    barycentric.push_back(corners.inverse());
  }
  for (Eigen::Index i = 0; i < positions.cols(); ++i) {
    Eigen::Matrix<Real, 4, 1> x;
    x << 1, at(positions, i);
    Eigen::Matrix<Real, 4, 1> best = Eigen::Matrix<Real, 4, 1>::Zero();
    int tet = 0;
    Real inside = -std::numeric_limits<Real>::infinity();
    for (int t = 0; t < mesh.num_tets(); ++t) {
      const Eigen::Matrix<Real, 4, 1> w = barycentric[static_cast<std::size_t>(t)] * x;
      if (w.minCoeff() <= inside) continue;
      inside = w.minCoeff();
      best = w;
      tet = t;
    }
    for (int k = 0; k < 4; ++k) weights(i, mesh.tets(k, tet)) += best[k];
  }
  return weights;
}

}  // namespace brainshift::stability
