// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/contract/estimate_check.hpp"

#include <cmath>
#include <cstdio>

#include "common/fem/elasticity.hpp"

namespace brainshift::inversion {

Status check_equilibrium(const CondensedOperators& operators, const std::vector<int>& slaves,
                         const VecX& penetration, const Points& displacement) {
  double worst = 0.0, largest = 0.0, there = 0.0;
  int worst_slave = -1;
  for (const int slave : slaves) {
    const NodeIndex node = operators.slaves[static_cast<std::size_t>(slave)];
    const double along = operators.slave_normals.col(slave).dot(displacement.col(node));
    const double field = operators.initial_penetration_mm[slave] - along;
    const double apart = std::abs(field - penetration[slave]);
    largest = std::max(largest, std::abs(along));
    if (apart <= worst) continue;
    worst = apart;
    worst_slave = slave;
    there = field;
  }
  if (worst <= kEquilibriumTolerance_mm + kEquilibriumRelative * largest) return {};
  char text[200];
  std::snprintf(
      text, sizeof text,
      "inversion: contact is not in equilibrium: node %d penetrates %g mm in the field, %g mm "
      "by its contact force",
      operators.slaves[static_cast<std::size_t>(worst_slave)], there, penetration[worst_slave]);
  return fail(ErrorCode::kNotConverged, text);
}

Status check_deformation(const fem::Deformation& deformation, Estimate& estimate) {
  if (std::isnan(deformation.min_volume_ratio)) {
    return fail(ErrorCode::kNotFinite, "inversion: the displacement is not finite");
  }
  estimate.min_volume_ratio = deformation.min_volume_ratio;
  estimate.min_nodal_volume_ratio = deformation.min_nodal_volume_ratio;
  estimate.inverted_elements = deformation.inverted;
  return {};
}

void append_warnings(const Estimate& estimate, double poisson_ratio, std::string& reason) {
  char text[160];
  if (estimate.inverted_elements > 0) {
    std::snprintf(text, sizeof text,
                  "; %d elements inverted (smallest volume ratio %.3g): no deformation of tissue",
                  estimate.inverted_elements, estimate.min_volume_ratio);
    reason.append(text);
  }
  if (poisson_ratio > fem::kLockingPoissonRatio) {
    std::snprintf(text, sizeof text,
                  "; linear elements lock at Poisson\'s ratio %g, above %g: displacement too small",
                  poisson_ratio, fem::kLockingPoissonRatio);
    reason.append(text);
  }
}

Status check_estimate(const TetMesh& mesh, const Material& material, Estimate& estimate) {
  const auto deformation = fem::measure_deformation(mesh, estimate.displacement);
  if (auto status = check_deformation(deformation, estimate); !status) return status;
  append_warnings(estimate, largest_poisson_ratio(material), estimate.reason);
  return {};
}

}  // namespace brainshift::inversion
