// SPDX-License-Identifier: GPL-3.0-or-later
// Swelling and shrinkage of tissue, as a load.
//
// Tissue that takes up water (oedema) or loses it (mannitol, a debulked tumour) changes its
// volume by the strain theta if nothing holds it. The stress-free strain is e0 = theta / 3 I, and
// sigma = C (e - e0) = C e - kappa theta I with the drained bulk modulus kappa = lambda + 2 G /
// 3. The initial stress moves to the right-hand side:
//
//   f = int B^T kappa theta I dV,     per tetrahedron and node i:  f_i = V kappa theta g_i
//
// with g_i the gradient of the shape function. The forces balance: no net force, no net moment. A
// free body with constant theta follows with u = theta / 3 x.
#pragma once

#include <functional>

#include "common/core/mesh.hpp"
#include "common/values/case_config.hpp"

namespace brainshift::fem {

// strain: theta at a tetrahedron's centroid (mm). Nodal forces f, 3 x n, N.
Points swelling_load(const TetMesh& mesh, const Material& material,
                     const std::function<double(const Vec3&)>& strain);

}  // namespace brainshift::fem
