// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/toy_patient.hpp"

#include <set>

#include "common/geometry/surface.hpp"
#include "common/values/model_id.hpp"
#include "tests/support/box_mesh.hpp"

namespace brainshift::test_support {

BrainModel toy_patient(int cells, double gap_mm) {
  constexpr double kSize = 60.0;
  BrainModel model;
  model.case_id = "toy";
  model.mesh = box_mesh(cells, cells, cells, Vec3::Constant(kSize));
  model.boundary_triangles = geometry::boundary_triangles(model.mesh);
  std::vector<NodeIndex> node_of_vertex;
  const TriangleSurface boundary = geometry::boundary_surface(model.mesh, &node_of_vertex);
  model.skull = geometry::offset_surface(boundary, gap_mm);
  model.tumour = geometry::ellipsoid_surface(Vec3(30, 30, 40), Vec3::Constant(10), 4.0);
  for (NodeIndex node : node_of_vertex) {
    const Vec3 x = model.mesh.nodes.col(node);
    const double radius = (x - Vec3(30, 30, x[2])).norm();
    if (x[2] == kSize && radius <= 16.0) {
      model.craniotomy.push_back(node);
    } else if (x[2] == 0.0 && radius <= 8.0) {
      model.brainstem.push_back(node);
    } else if (x[2] > 30.0) {
      model.slaves.push_back(node);
    } else {
      model.fixed.push_back(node);
    }
  }
  model.gravity_direction = Vec3(0, 0, -1);
  model.fluid_plane_depth_mm = -60.0;
  model.slave_plane_depth_mm = -30.0;
  model.model_id = content_hash(model);
  return model;
}

CaseConfig toy_config() {
  CaseConfig config;
  config.case_id = "toy";
  config.gravity_direction = Vec3(0, 0, -1);
  config.prior.correlation_length_mm = 10.0;
  config.prior.gravity_levels_mm = {10.0, 40.0};
  // Gravity with an unknown direction and the paper's residual field: dense references have no
  // other loads, and there are few enough modes to keep all.
  config.prior.force_density_sd_n_m3 = 1000.0;
  config.prior.gravity_direction_sd_deg = 10.0;
  config.prior.gravity_sides_sd = config.prior.gravity_ends_sd = 0.0;
  config.prior.broad_weight = 0.0;
  config.prior.medium_density_sd_n_m3 = config.prior.coarse_density_sd_n_m3 = 0.0;
  config.prior.tumour_volume_strain_sd = config.prior.brain_volume_strain_sd = 0.0;
  config.prior.resection_weight_sd = config.prior.resection_stress_sd_pa = 0.0;
  config.prior.opening_pressure_sd_pa = config.prior.tract_pressure_sd_pa = 0.0;
  config.prior.ventricle_volume_strain_sd = 0.0;
  return config;
}

}  // namespace brainshift::test_support
