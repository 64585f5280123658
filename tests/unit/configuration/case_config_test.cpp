// SPDX-License-Identifier: Apache-2.0
#include "common/configuration/case_config.hpp"
#include "tests/support/results.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <limits>
#include <sstream>
#include <vector>

namespace brainshift {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

CaseConfig valid_case() {
  CaseConfig config;
  config.case_id = "case";
  config.brain = "brain.nii";
  config.tumour = TumourEllipsoid{Vec3(1, 2, 3), Vec3(10, 11, 12)};
  return config;
}

// A key of type double, with the ends of its range; `below` and `above` lie outside.
struct Range {
  std::string key;
  std::function<double&(CaseConfig&)> value;
  double below, low, high, above;
};

constexpr double kInf = std::numeric_limits<double>::infinity();

double& generate(CaseConfig& c, double MeshGeneration::*member) {
  return std::get<MeshGeneration>(c.mesh).*member;
}

std::vector<Range> ranges() {
  using C = CaseConfig;
  using M = MeshGeneration;
  std::vector<Range> list = {
      {"mesh.generate.edge_mm", [](C& c) -> double& { return generate(c, &M::edge_mm); }, 0.99, 1,
       40, 40.1},
      {"mesh.generate.tumour_edge_mm",
       [](C& c) -> double& { return generate(c, &M::tumour_edge_mm); }, 0.49, 0.5, 40, 40.1},
      {"mesh.generate.craniotomy_edge_mm",
       [](C& c) -> double& { return generate(c, &M::craniotomy_edge_mm); }, 0.49, 0.5, 40, 40.1},
      {"mesh.generate.smoothing_mm", [](C& c) -> double& { return generate(c, &M::smoothing_mm); },
       -0.1, 0, 10, 10.1},
      {"mesh.generate.tumour_margin_mm",
       [](C& c) -> double& { return generate(c, &M::tumour_margin_mm); }, -0.1, 0, 1e6, kInf},
      {"mesh.generate.craniotomy_margin_mm",
       [](C& c) -> double& { return generate(c, &M::craniotomy_margin_mm); }, -0.1, 0, 1e6, kInf},
      {"craniotomy.long_axis_mm", [](C& c) -> double& { return c.craniotomy.long_axis_mm; }, 0.99,
       24, 200, 200.1},
      {"craniotomy.short_axis_mm", [](C& c) -> double& { return c.craniotomy.short_axis_mm; }, 0.99,
       1, 45, 45.1},
      {"brainstem.radius_mm", [](C& c) -> double& { return c.brainstem.radius_mm; }, -0.1, 0, 60,
       60.1},
      {"material.shear_modulus_pa", [](C& c) -> double& { return c.material.shear_modulus_pa; },
       2.1, 100, 1e6, 2.1e9},
      {"material.poisson_ratio", [](C& c) -> double& { return c.material.poisson_ratio; }, -0.1, 0,
       0.4999, 0.5},
      {"material.tissue_density_kg_m3",
       [](C& c) -> double& { return c.material.tissue_density_kg_m3; }, 1, 500, 2000, 2001},
      {"material.fluid_density_saturated_kg_m3",
       [](C& c) -> double& { return c.material.fluid_density_saturated_kg_m3; }, -1, 0, 2000, 2001},
      {"material.fluid_density_unsaturated_kg_m3",
       [](C& c) -> double& { return c.material.fluid_density_unsaturated_kg_m3; }, -1, 0, 2000,
       2001},
      {"material.permeability_m3_s_kg",
       [](C& c) -> double& { return c.material.permeability_m3_s_kg; }, 0, 1e-16, 1e-2, 0.1},
      {"material.biot_coefficient", [](C& c) -> double& { return c.material.biot_coefficient; },
       -0.1, 0, 1, 1.1},
      {"material.storage_per_pa", [](C& c) -> double& { return c.material.storage_per_pa; }, -1e-9,
       0, 1, 1.1},
      {"scene.pressure_step_s", [](C& c) -> double& { return c.scene.pressure_step_s; }, 0, 1e-6,
       1e9, kInf},
      {"contact.gap_mm", [](C& c) -> double& { return c.contact.gap_mm; }, -0.1, 0, 20, 20.1},
      {"contact.slave_depth_mm", [](C& c) -> double& { return c.contact.slave_depth_mm; }, -0.1, 0,
       300, 301},
      {"contact.penalty_n_per_mm", [](C& c) -> double& { return c.contact.penalty_n_per_mm; }, 0,
       1e-6, 1e9, 1e10},
      {"prior.correlation_length_mm", [](C& c) -> double& { return c.prior.correlation_length_mm; },
       0.09, 0.1, 200, 201},
      {"prior.force_density_sd_n_m3", [](C& c) -> double& { return c.prior.force_density_sd_n_m3; },
       -1, 0, 1e300, kInf},
      {"prior.gravity_mode_sd", [](C& c) -> double& { return c.prior.gravity_mode_sd; }, -0.1, 0,
       1e300, kInf},
      {"inversion.sigma_mm", [](C& c) -> double& { return c.inversion.sigma_mm; }, 0, 1e-6, 1e3,
       1001},
      {"inversion.relative_misfit_change",
       [](C& c) -> double& { return c.inversion.relative_misfit_change; }, 0, 1e-12, 1, 1.01},
  };
  for (int i = 0; i < 3; ++i) {
    list.push_back(
        {"tumour.ellipsoid.semi_axes_mm[" + std::to_string(i) + "]",
         [i](C& c) -> double& { return std::get<TumourEllipsoid>(c.tumour).semi_axes_mm[i]; }, 0.49,
         0.5, 80, 80.1});
  }
  for (std::size_t i = 0; i < 3; ++i) {
    list.push_back({"prior.gravity_levels_mm[" + std::to_string(i) + "]",
                    [i](C& c) -> double& { return c.prior.gravity_levels_mm[i]; }, -301, -300, 300,
                    301});
  }
  return list;
}

void expect_refused(const CaseConfig& config, const std::string& begin) {
  EXPECT_THAT(
      refusal_of(validate(config), ErrorCode::kInvalidArgument),
      testing::AllOf(StartsWith(begin), HasSubstr("must"), testing::Not(testing::HasSubstr("\n"))));
}

TEST(ValidateCase, DefaultsWithATumourAreValid) {
  const Status status = validate(valid_case());
  EXPECT_TRUE(status) << status.error().message;
}

TEST(ValidateCase, BothEndsOfEveryRangeAreValid) {
  for (const Range& range : ranges()) {
    for (const double value : {range.low, range.high}) {
      CaseConfig config = valid_case();
      range.value(config) = value;
      const Status status = validate(config);
      EXPECT_TRUE(status) << range.key << " = " << value << ": " << status.error().message;
    }
  }
}

TEST(ValidateCase, ValuesOutsideTheirRangeAreNamedWithKeyAndValue) {
  for (const Range& range : ranges()) {
    for (const double value : {range.below, range.above}) {
      CaseConfig config = valid_case();
      range.value(config) = value;
      std::ostringstream text;
      text << range.key << " = " << value << ": must be ";
      expect_refused(config, text.str());
    }
  }
}

TEST(ValidateCase, NotANumberIsRefusedForEveryKey) {
  for (const Range& range : ranges()) {
    CaseConfig config = valid_case();
    range.value(config) = std::numeric_limits<double>::quiet_NaN();
    expect_refused(config, range.key + " = ");
  }
}

TEST(ValidateCase, CountsOutsideTheirRangeAreNamed) {
  CaseConfig config = valid_case();
  config.inversion.sparse_points = 2;
  expect_refused(config, "inversion.sparse_points = 2: must be");
  config.inversion.sparse_points = 1000001;
  expect_refused(config, "inversion.sparse_points = ");
  config = valid_case();
  config.inversion.max_iterations = 0;
  expect_refused(config, "inversion.max_iterations = 0: must be");
  config.inversion.max_iterations = 100001;
  expect_refused(config, "inversion.max_iterations = ");
}

TEST(ValidateCase, NonFinitePlacesAreNamedWithTheirComponent) {
  CaseConfig config = valid_case();
  config.craniotomy.centre_mm.y() = kInf;
  expect_refused(config, "craniotomy.centre_mm[1] = inf: must be finite");
  config = valid_case();
  config.brainstem.centre_mm.z() = std::nan("");
  expect_refused(config, "brainstem.centre_mm[2] = ");
  config = valid_case();
  std::get<TumourEllipsoid>(config.tumour).centre_mm.x() = -kInf;
  expect_refused(config, "tumour.ellipsoid.centre_mm[0] = -inf: must be finite");
}

TEST(ValidateCase, DirectionsWithoutLengthAreRefused) {
  CaseConfig config = valid_case();
  config.gravity_direction = Vec3::Zero();
  expect_refused(config, "gravity.direction length = 0: must be > 0");
  config = valid_case();
  config.craniotomy.long_axis_direction = Vec3::Zero();
  expect_refused(config, "craniotomy.long_axis_direction length = 0: must be > 0");
}

TEST(ValidateCase, NameIsNeeded) {
  CaseConfig config = valid_case();
  config.case_id.clear();
  expect_refused(config, "case_id: must not be empty");
}

TEST(ValidateCase, BrainMaskIsNeededOnlyWhenTheMeshIsGenerated) {
  CaseConfig config = valid_case();
  config.brain.clear();
  expect_refused(config, "images.brain: must name");
  config.mesh = MeshFile{"head.msh"};
  EXPECT_TRUE(validate(config));
}

TEST(ValidateCase, NoGravityLevelIsValid) {
  CaseConfig config = valid_case();
  config.prior.gravity_levels_mm.clear();
  EXPECT_TRUE(validate(config));
}

}  // namespace
}  // namespace brainshift
