// SPDX-License-Identifier: GPL-3.0-or-later
// What happens to the brain in a simulated surgery, as nodal forces: tissue that changes its volume
// (fem/body_loads.hpp), and a spatula.
#pragma once

#include <functional>

#include "common/configuration/case_config.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::client {

// theta(r) = volume_strain (1 - (r / radius)^2)^2 for r < radius, else 0; r: distance to the
// centre. Largest in the middle, fading out without an edge.
struct Swelling {
  double volume_strain = 0.0;  // > 0 swells, < 0 shrinks, 0: none
  double radius_mm = 0.0;
  // Of the centre, beyond the tumour's centroid as seen from the craniotomy.
  double depth_mm = 0.0;
  Vec3 offset_mm = Vec3::Zero();  // of the centre, RAS, beside that place
};

// One volume strain of the whole brain, or of the half that the tumour lies in, as when mannitol
// draws water from it. The halves meet in the sagittal plane through the middle of the brain's
// extent; there the strain fades like (1 + tanh(d / kFalx_mm)) / 2, d: distance into the half.
struct VolumeChange {
  double strain = 0.0;  // < 0 shrinks, 0: none
  bool one_hemisphere = false;
};
inline constexpr double kFalx_mm = 5.0;

// Mean of the craniotomy's nodes, mm.
Vec3 craniotomy_centre(const BrainModel& model);
// Centre of the swelling in this patient, mm.
Vec3 swelling_centre(const BrainModel& model, const Swelling& swelling);

// theta(r), no unit.
double volume_strain_at(const Swelling& swelling, double distance_mm);

// Nodal forces, 3 x n, N.
Points swelling_load(const TetMesh& mesh, const Material& material, const Vec3& centre,
                     const Swelling& swelling);

// Strain of a volume change at any place, no unit. mesh: gives the middle of the brain. tumour: a
// place in the half that changes.
std::function<double(const Vec3&)> volume_change_field(const TetMesh& mesh, const Vec3& tumour,
                                                       const VolumeChange& change);
// The same for a volume change. tumour: a place in the half that changes.
Points volume_change_load(const TetMesh& mesh, const Material& material, const Vec3& tumour,
                          const VolumeChange& change);

// A brain spatula on the exposed cortex of a simulated surgery: it presses on tissue and draws it
// aside. Retractors press with 20 to 40 mmHg, 2.7 to 5.3 kPa (Zhong et al. 2003, Neurol Res
// 25:831).
//
// Traction t on the exposed cortex at the distance r from the spatula's middle:
//   t(r) = pressure (1 - (r / radius)^2)^2 d for r < radius, else 0
//   d    = -cos(angle) n + sin(angle) e, n: the opening's outward normal, e: `aside` in its plane
struct Retraction {
  double pressure_pa = 0.0;  // the largest
  double radius_mm = 0.0;
  double angle_deg = 0.0;         // between the traction and straight into the brain; 0 to 90
  Vec3 aside = Vec3::UnitX();     // RAS, any length; its part along the normal does not count
  Vec3 offset_mm = Vec3::Zero();  // of the middle from the opening's, RAS, the same
};

// Nodal forces on the nodes of the model's mesh, 3 x n, N. The triangles between three craniotomy
// nodes give a third of their area to each corner.
Points retraction_load(const BrainModel& model, const Retraction& retraction);

}  // namespace brainshift::client
