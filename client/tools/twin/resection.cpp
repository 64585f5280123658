// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/resection.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "client/tools/twin/load.hpp"
#include "common/fem/elasticity.hpp"
#include "common/geometry/closest_point.hpp"

namespace brainshift::client {
namespace {

struct TumourTet {
  int tet = 0;
  double depth_mm = 0.0;  // from the craniotomy
  double volume = 0.0;
};

// The tetrahedra of the tumour, nearest to the craniotomy first.
Result<std::vector<TumourTet>> tumour_tets(const BrainModel& model) {
  const auto inside = geometry::ClosestPointIndex::build(model.tumour);
  if (!inside) return tl::unexpected(inside.error());
  const Vec3 from = craniotomy_centre(model);
  const Vec3 axis = (Vec3(model.tumour.vertices.rowwise().mean()) - from).normalized();
  std::vector<TumourTet> tets;
  for (int t = 0; t < model.mesh.num_tets(); ++t) {
    const Vec3 centre = model.mesh.nodes(Eigen::all, model.mesh.tets.col(t)).rowwise().mean();
    if (!inside->contains(centre)) continue;
    tets.push_back({t, axis.dot(centre - from), fem::tet_geometry(model.mesh, t).volume});
  }
  std::stable_sort(tets.begin(), tets.end(),
                   [](const TumourTet& a, const TumourTet& b) { return a.depth_mm < b.depth_mm; });
  return tets;
}

// How many of the first ones hold the fraction of the volume: at least one.
std::size_t removed_count(const std::vector<TumourTet>& tets, double fraction) {
  double all = 0.0, removed = 0.0;
  for (const TumourTet& one : tets) all += one.volume;
  std::size_t count = 0;
  while (count < tets.size() && removed < fraction * all) removed += tets[count++].volume;
  return count;
}

TetMesh without(const TetMesh& mesh, const std::vector<char>& removed) {
  TetMesh left;
  left.nodes = mesh.nodes;
  std::vector<int> kept;
  for (int t = 0; t < mesh.num_tets(); ++t) {
    if (removed[static_cast<std::size_t>(t)] == 0) kept.push_back(t);
  }
  left.tets = mesh.tets(Eigen::all, kept);
  return left;
}

}  // namespace

Result<ResectedBrain> resect(const BrainModel& model, const CaseConfig& config,
                             const Resection& resection) {
  if (!(resection.volume_fraction > 0.0 && resection.volume_fraction <= 1.0)) {
    return invalid(fmt::format("resection.volume_fraction = {:g}: must be above 0 and at most 1",
                               resection.volume_fraction));
  }
  const auto tets = tumour_tets(model);
  if (!tets) return tl::unexpected(tets.error());
  if (tets->empty()) {
    return fail(ErrorCode::kEmptySet, "resection: no tetrahedron has its centre in the tumour");
  }
  const std::size_t count = removed_count(*tets, resection.volume_fraction);

  ResectedBrain brain{model, config, {}, {}};
  TetMesh& mesh = brain.model.mesh;
  Material& material = brain.config.material;
  if (mesh.labels.empty()) mesh.labels.assign(static_cast<std::size_t>(mesh.num_tets()), 0);
  const int cavity = 1 + *std::max_element(mesh.labels.begin(), mesh.labels.end());
  std::vector<char> removed(static_cast<std::size_t>(mesh.num_tets()), 0);
  for (std::size_t i = 0; i < tets->size(); ++i) {
    const auto tet = static_cast<std::size_t>((*tets)[i].tet);
    if (i < count) {
      mesh.labels[tet] = cavity;
      removed[tet] = 1;
    } else if (material.tumour) {
      mesh.labels[tet] = cavity + 1;
    }
  }
  material.regions[cavity] = {kCavityStiffness * config.material.shear_modulus_pa, 0.0};
  if (material.tumour) {
    if (count < tets->size()) material.regions[cavity + 1] = *material.tumour;
    material.tumour.reset();
  }
  brain.tissue = without(mesh, removed);
  brain.attached.assign(static_cast<std::size_t>(mesh.num_nodes()), 0);
  for (const int node : brain.tissue.tets.reshaped()) {
    brain.attached[static_cast<std::size_t>(node)] = 1;
  }
  return brain;
}

}  // namespace brainshift::client
