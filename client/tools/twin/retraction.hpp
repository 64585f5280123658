// SPDX-License-Identifier: GPL-3.0-or-later
// A brain spatula on the exposed cortex of a simulated surgery: it presses on tissue and draws it
// aside. Retractors press with 20 to 40 mmHg, 2.7 to 5.3 kPa (Zhong et al. 2003, Neurol Res
// 25:831).
#pragma once

#include "common/values/brain_model.hpp"

namespace brainshift::client {

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
