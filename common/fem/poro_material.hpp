// SPDX-License-Identifier: GPL-3.0-or-later
// Materials of a body of several tissues: one PoroMaterial per region, one region per
// tetrahedron.
//
//   -div(sigma(u) - alpha p I) = f,   d/dt(alpha div u + S p) - div(k grad p) = 0  (paper eq. 1-2)
//
// Drained elasticity uses `elastic` alone.
#pragma once

#include <vector>

#include "common/fem/elasticity.hpp"

namespace brainshift::fem {

struct PoroMaterial {
  Elasticity elastic;             // drained, N/mm^2
  double biot_coefficient = 1.0;  // alpha, 0 to 1
  double storage = 0.0;           // S: the paper's 1/S, mm^2/N; 0: incompressible constituents
  double permeability = 0.0;      // k: hydraulic conductivity over unit weight, mm^4/(N s)
};

// The material of a case, in internal units.
PoroMaterial poro_material_from(const Material& material);

// of_tet: one index into `materials` per tetrahedron.
struct MaterialMap {
  std::vector<PoroMaterial> materials;
  std::vector<int> of_tet;

  static MaterialMap uniform(const PoroMaterial& material, int num_tets) {
    return {{material}, std::vector<int>(static_cast<std::size_t>(num_tets), 0)};
  }
  const PoroMaterial& at(int tet) const {
    return materials[static_cast<std::size_t>(of_tet[static_cast<std::size_t>(tet)])];
  }
  // The elastic part alone, one per tetrahedron.
  std::vector<Elasticity> elastic() const {
    std::vector<Elasticity> all;
    all.reserve(of_tet.size());
    for (const int index : of_tet)
      all.push_back(materials[static_cast<std::size_t>(index)].elastic);
    return all;
  }
};

}  // namespace brainshift::fem
