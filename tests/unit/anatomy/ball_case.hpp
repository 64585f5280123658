// SPDX-License-Identifier: GPL-3.0-or-later
// A case made in memory: a ball for a brain, opened at its right side, standing on its left.
#pragma once

#include "common/configuration/case_inputs.hpp"
#include "tests/unit/geometry/ball_mask.hpp"

namespace brainshift::anatomy::testing {

inline const Vec3 kBallCentre(4.0, -7.0, 11.0);
constexpr double kBallRadius_mm = 50.0;

inline CaseInputs ball_case() {
  CaseInputs inputs;
  CaseConfig& config = inputs.config;
  config.case_id = "ball";
  config.brain = "ball.nii";
  MeshGeneration mesh;
  mesh.edge_mm = mesh.tumour_edge_mm = mesh.craniotomy_edge_mm = 8.0;
  config.mesh = mesh;
  config.tumour = TumourEllipsoid{kBallCentre + Vec3(25, 0, 0), Vec3(10, 8, 6)};
  config.craniotomy.centre_mm = kBallCentre + Vec3(55, 0, 0);
  config.craniotomy.long_axis_mm = 50.0;
  config.craniotomy.short_axis_mm = 30.0;
  config.craniotomy.long_axis_direction = Vec3(0, 0, 3);
  config.brainstem = {kBallCentre + Vec3(0, 0, -50), 16.0};
  config.gravity_direction = Vec3(-1, 0, 0);
  inputs.brain = geometry::balls::binary_balls(
      geometry::balls::empty_image(56, kBallCentre + Vec3(0.4, 0.3, -0.2),
                                   geometry::balls::oblique_left_handed(2.0)),
      {{kBallCentre, kBallRadius_mm}});
  return inputs;
}

// A closed surface the long way round: every triangle's normal points inwards.
inline TriangleSurface inside_out(TriangleSurface surface) {
  surface.triangles.row(0).swap(surface.triangles.row(1));
  return surface;
}

}  // namespace brainshift::anatomy::testing
