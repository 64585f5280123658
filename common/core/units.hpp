// SPDX-License-Identifier: Apache-2.0
// The one place where configuration and wire units become internal units (mm, N, s).
#pragma once

namespace brainshift::units {

// Pa -> N/mm^2
constexpr double stress_from_pa(double pa) { return pa * 1e-6; }
// N/m^3 -> N/mm^3
constexpr double force_density_from_n_m3(double n_m3) { return n_m3 * 1e-9; }
// kg/m^3 x 9.80665 m/s^2 -> N/mm^3
constexpr double kStandardGravity_m_s2 = 9.80665;
constexpr double weight_density_from_kg_m3(double kg_m3) {
  return force_density_from_n_m3(kg_m3 * kStandardGravity_m_s2);
}
// m^3 s/kg = m^4/(N s) -> mm^4/(N s)
constexpr double permeability_from_m3_s_kg(double m3_s_kg) { return m3_s_kg * 1e12; }
// 1/Pa = m^2/N -> mm^2/N
constexpr double storage_from_per_pa(double per_pa) { return per_pa * 1e6; }

}  // namespace brainshift::units
