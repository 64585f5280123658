// SPDX-License-Identifier: Apache-2.0
#include "common/core/units.hpp"

#include <gtest/gtest.h>

namespace brainshift::units {
namespace {

// Each expected value by the definition of the units alone: 1 N = 1 kg m/s^2, 1 m = 1000 mm.
TEST(Units, ConvertByTheirDefinitions) {
  EXPECT_DOUBLE_EQ(stress_from_pa(2100.0), 0.0021);
  EXPECT_DOUBLE_EQ(force_density_from_n_m3(1000.0), 1e-6);
  // A litre of water weighs 9.80665 N: 10^6 mm^3.
  EXPECT_DOUBLE_EQ(weight_density_from_kg_m3(1000.0) * 1e6, 9.80665);
  // m^4 / (N s) is 10^12 mm^4 / (N s).
  EXPECT_DOUBLE_EQ(permeability_from_m3_s_kg(1e-7), 1e5);
  EXPECT_DOUBLE_EQ(storage_from_per_pa(1e-9) * stress_from_pa(1e9), 1.0);
}

}  // namespace
}  // namespace brainshift::units
