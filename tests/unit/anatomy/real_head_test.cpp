// SPDX-License-Identifier: GPL-3.0-or-later
// The coarse default case on a real head (Colin27, from Debian's mricron-data).
#include <gtest/gtest.h>

#include <filesystem>

#include "common/anatomy/brain_model_builder.hpp"
#include "common/geometry/mesh_quality.hpp"
#include "common/geometry/surface.hpp"
#include "common/io/config/config_file.hpp"

namespace brainshift::anatomy {
namespace {

TEST(RealHead, CoarseDefaultCaseGivesAWholeModel) {
  const auto config = io::read_case_config(
      std::filesystem::path(BRAINSHIFT_SOURCE_DIR "/config/cases") / "colin27-coarse.yaml");
  ASSERT_TRUE(config) << config.error().message;
  const auto inputs = io::load_case_inputs(*config);
  ASSERT_TRUE(inputs) << inputs.error().message;
  const auto model = build_brain_model(*inputs);
  ASSERT_TRUE(model) << model.error().message;

  const geometry::MeshQuality quality = geometry::mesh_quality(model->mesh);
  // 1,736,387 voxels of 1 mm^3; smoothing and 12 mm facets may change 3 %.
  EXPECT_NEAR(quality.volume_mm3, 1736387.0, 0.03 * 1736387.0);
  EXPECT_NEAR(quality.mean_edge_mm, 12.0, 1.2);
  EXPECT_GT(quality.min_dihedral_deg, 10.0);
  const TriangleSurface brain = geometry::boundary_surface(model->mesh);
  EXPECT_TRUE(geometry::is_closed(brain));
  EXPECT_EQ(model->craniotomy.size() + model->brainstem.size() + model->slaves.size() +
                model->fixed.size(),
            static_cast<std::size_t>(brain.num_vertices()));
  EXPECT_GE(model->craniotomy.size(), 5u);  // 45 x 24 mm over 12 mm edges
  EXPECT_NEAR(geometry::enclosed_volume(model->tumour), 10990.0, 60.0);

  // The craniotomy is on the right; slaves lie above the second plane, fixed nodes below it.
  for (const NodeIndex node : model->craniotomy) EXPECT_GT(model->mesh.nodes(0, node), 50.0);
  const auto depth = [&](NodeIndex node) {
    return model->mesh.nodes.col(node).dot(model->gravity_direction);
  };
  for (const NodeIndex node : model->slaves) EXPECT_LT(depth(node), model->slave_plane_depth_mm);
  for (const NodeIndex node : model->fixed) EXPECT_GE(depth(node), model->slave_plane_depth_mm);
}

}  // namespace
}  // namespace brainshift::anatomy
