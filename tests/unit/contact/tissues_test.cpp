// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/contact/forward_model.hpp"

#include <gmock/gmock.h>

#include "common/fem/body_loads.hpp"
#include "tests/support/results.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::contact {
namespace {

using testing::HasSubstr;

// The toy patient with the tetrahedra of its lower half labelled 5, the others 0.
BrainModel labelled_patient() {
  BrainModel model = test_support::toy_patient();
  const double middle =
      0.5 * (model.mesh.nodes.row(2).minCoeff() + model.mesh.nodes.row(2).maxCoeff());
  for (int t = 0; t < model.mesh.num_tets(); ++t) {
    double height = 0.0;
    for (int k = 0; k < 4; ++k) height += 0.25 * model.mesh.nodes(2, model.mesh.tets(k, t));
    model.mesh.labels.push_back(height < middle ? 5 : 0);
  }
  return model;
}

double shear_pa(const fem::MaterialMap& map, int tet) { return 1e6 * map.at(tet).elastic.shear; }

TEST(Tissues, WithoutEntriesTheBrainIsUniform) {
  const auto map = value_or_fail(tissue_map(labelled_patient(), Material{}));
  EXPECT_EQ(map.materials.size(), 1u);
}

TEST(Tissues, LabelsAndTumourHaveTheirOwnStiffness) {
  const BrainModel model = labelled_patient();
  Material material;
  material.regions[5] = {9000.0, 0.4};
  material.tumour = TissueStiffness{20000.0, 0.3};
  const auto map = value_or_fail(tissue_map(model, material));
  int tumour = 0, lower = 0, rest = 0;
  for (int t = 0; t < model.mesh.num_tets(); ++t) {
    const double shear = shear_pa(map, t);
    if (shear == 20000.0) {
      ++tumour;
    } else if (model.mesh.labels[static_cast<std::size_t>(t)] == 5) {
      EXPECT_DOUBLE_EQ(shear, 9000.0);
      ++lower;
    } else {
      EXPECT_DOUBLE_EQ(shear, 2100.0);
      ++rest;
    }
  }
  EXPECT_GT(tumour, 0);
  EXPECT_GT(lower, 0);
  EXPECT_GT(rest, 0);
  // Volume of the tumour's tetrahedra, against its surface's: elements are coarse.
  EXPECT_LT(tumour, model.mesh.num_tets() / 2);
}

TEST(Tissues, TissuesOfTheLabelMapAreInUnitsOfTheBrains) {
  BrainModel model = labelled_patient();
  for (int& label : model.mesh.labels) label = label == 5 ? kWhiteMatter : kBrainstemLabel;
  model.mesh.labels[0] = 0;
  Material material;
  material.shear_modulus_pa = 1000.0;
  material.regions[kBrainstemLabel] = {9000.0, 0.4};
  const auto map = value_or_fail(tissue_map(model, material));
  EXPECT_DOUBLE_EQ(shear_pa(map, 0), 1000.0);
  for (int t = 1; t < model.mesh.num_tets(); ++t) {
    const bool white = model.mesh.labels[static_cast<std::size_t>(t)] == kWhiteMatter;
    EXPECT_DOUBLE_EQ(shear_pa(map, t), white ? 1160.0 : 9000.0);
  }
}

TEST(Tissues, ALabelThatTheMeshDoesNotHaveIsNamed) {
  Material material;
  material.regions[7] = {};
  EXPECT_EQ(refusal_of(tissue_map(labelled_patient(), material), ErrorCode::kInvalidArgument),
            "material.regions.7: the mesh has no such label (there: 0, 5)");
}

// A stiffer tumour deforms less under the same load, and the same stiffness written down changes
// nothing.
TEST(Tissues, AStiffTumourDeformsLess) {
  const BrainModel model = test_support::toy_patient();
  CaseConfig config = test_support::toy_config();
  const Points load =
      fem::buoyancy_load(model.mesh, config.material, model.gravity_direction,
                         model.fluid_plane_depth_mm + 25.0, model.gravity_direction);
  const auto strain = [&](const CaseConfig& with) {
    const auto forward = value_or_fail(ForwardModel::build(model, with, Boundary::kFixed));
    const Points u = forward.solve(load);
    const auto map = tissue_map(model, with.material);
    double sum = 0.0;
    for (int t = 0; t < model.mesh.num_tets(); ++t) {
      if (map->of_tet[static_cast<std::size_t>(t)] == 0) continue;
      const fem::TetGeometry geometry = fem::tet_geometry(model.mesh, t);
      Mat3 gradient = Mat3::Zero();
      for (int k = 0; k < 4; ++k) {
        gradient += u.col(model.mesh.tets(k, t)) * geometry.gradients.col(k).transpose();
      }
      sum += geometry.volume * (gradient + gradient.transpose()).norm();
    }
    return sum;
  };
  config.material.tumour =
      TissueStiffness{config.material.shear_modulus_pa, config.material.poisson_ratio};
  const double same = strain(config);
  config.material.tumour->shear_modulus_pa *= 1000.0;
  const double stiff = strain(config);
  ASSERT_GT(same, 0.0);
  EXPECT_LT(stiff, 0.05 * same);
}

}  // namespace
}  // namespace brainshift::contact
