// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/bridge/field_stream.hpp"

#include <gmock/gmock.h>

#include "common/geometry/node_choice.hpp"
#include "common/geometry/surface.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::client {
namespace {

using testing::HasSubstr;

constexpr double kFloat = 1e-5;

Vec3 linear_field(const Vec3& x) { return Vec3(0.02 * x[2], 1.0, -0.03 * x[0]); }

UpdateMessage streamed_update(const BrainModel& model) {
  UpdateMessage message;
  message.session_id = 4;
  message.update.sequence = 9;
  message.update.model_id = model.model_id;
  message.update.case_id = model.case_id;
  Estimate& estimate = message.update.estimate;
  estimate.quality.quality = Quality::kCaution;
  estimate.quality.flags.set(QualityFlag::kDeadline);
  estimate.displacement.resize(3, model.mesh.nodes.cols());
  for (Eigen::Index i = 0; i < model.mesh.nodes.cols(); ++i) {
    estimate.displacement.col(i) = linear_field(model.mesh.nodes.col(i));
  }
  estimate.sd_mm = VecX::Constant(model.mesh.nodes.cols(), 0.5);
  estimate.known = VecX::Constant(model.mesh.nodes.cols(), 0.8);
  return message;
}

// As the daemon would cut it.
UpdateMessage part_of(const BrainModel& model, const std::vector<NodeIndex>& nodes) {
  const UpdateMessage whole = streamed_update(model);
  UpdateMessage part = whole;
  part.update.part = FieldPart{model.mesh.num_nodes(), nodes, 0};
  Estimate& estimate = part.update.estimate;
  estimate.displacement.resize(3, static_cast<Eigen::Index>(nodes.size()));
  estimate.sd_mm.resize(static_cast<Eigen::Index>(nodes.size()));
  estimate.known.resize(static_cast<Eigen::Index>(nodes.size()));
  for (Eigen::Index i = 0; i < estimate.sd_mm.size(); ++i) {
    const NodeIndex node = nodes[static_cast<std::size_t>(i)];
    estimate.displacement.col(i) = whole.update.estimate.displacement.col(node);
    estimate.sd_mm[i] = whole.update.estimate.sd_mm[node];
    estimate.known[i] = whole.update.estimate.known[node];
  }
  return part;
}

TEST(FieldStream, AWallMovesWithTheBrainAndASheetStays) {
  BrainModel model = test_support::toy_patient(6);
  model.ventricle_wall = model.septa.triangles = model.mesh.tets.topRows<3>().leftCols<2>();
  FieldStream stream = FieldStream::build(model, {.region = TumourRegion{5.0}}).value();
  const auto picture = stream.picture(streamed_update(model)).value();
  const auto& rest = picture->rest->surfaces;
  const auto& wall = picture->surfaces[Shape::kVentricles];
  ASSERT_TRUE(wall && rest[Shape::kVentricles] && rest[Shape::kSepta]);
  for (Eigen::Index i = 0; i < wall->points.cols(); ++i) {
    const Vec3 at = rest[Shape::kVentricles]->points.col(i).cast<double>();
    EXPECT_LT((wall->points.col(i).cast<double>() - at - linear_field(at)).norm(), kFloat);
  }
  EXPECT_EQ(wall->attributes.size(), 3u);
  EXPECT_FALSE(picture->surfaces[Shape::kSepta].has_value());
  // Nothing is said of how sure a fixed sheet is.
  EXPECT_EQ(rest[Shape::kSepta]->attributes.size(), 1u);
}

TEST(FieldStream, APictureHasFieldSurfacesAndState) {
  const BrainModel model = test_support::toy_patient(6);
  FieldStream stream = FieldStream::build(model, {.region = TumourRegion{5.0}}).value();
  const auto picture = stream.picture(streamed_update(model)).value();
  const FieldGrid& grid = stream.grid();
  ASSERT_EQ(picture->u.size(), 3 * grid.num_voxels());
  const std::size_t centre = grid.index(grid.dims[0] / 2, grid.dims[1] / 2, grid.dims[2] / 2);
  const Vec3 x = grid.voxel_mm(grid.dims[0] / 2, grid.dims[1] / 2, grid.dims[2] / 2);
  EXPECT_LT((Vec3(picture->u[3 * centre], picture->u[3 * centre + 1], picture->u[3 * centre + 2]) -
             linear_field(x))
                .norm(),
            kFloat);
  EXPECT_NEAR(picture->sd[centre], 0.5, kFloat);
  EXPECT_NEAR(picture->known[centre], 0.8, kFloat);
  for (Eigen::Index i = 0; i < model.tumour.vertices.cols(); ++i) {
    const Vec3 at = model.tumour.vertices.col(i);
    EXPECT_LT(
        (picture->surfaces[Shape::kTumour]->points.col(i).cast<double>() - at - linear_field(at))
            .norm(),
        kFloat);
    EXPECT_LT((picture->surfaces[Shape::kTumour]->attributes[0].values.col(i).cast<double>() -
               linear_field(at))
                  .norm(),
              kFloat);
  }
  EXPECT_EQ(picture->surfaces[Shape::kTumour]->attributes[0].name, "displacement_mm");
  EXPECT_EQ(picture->surfaces[Shape::kTumour]->attributes[1].name, "sd_mm");
  EXPECT_EQ(picture->surfaces[Shape::kTumour]->attributes[2].name, "known");
  EXPECT_TRUE((picture->surfaces[Shape::kCortex]->attributes[1].values.array() == 0.5F).all());
  EXPECT_TRUE((picture->surfaces[Shape::kCortex]->attributes[2].values.array() == 0.8F).all());
  EXPECT_EQ(picture->surfaces[Shape::kCortex]->points.cols(),
            geometry::boundary_surface(model.mesh).vertices.cols());

  EXPECT_FALSE(picture->rest->surfaces[Shape::kSepta].has_value());
  const ShownState& state = picture->state;
  EXPECT_EQ(state.sequence, 9u);
  EXPECT_EQ(state.session_id, 4u);
  EXPECT_EQ(state.model_id, model.model_id);
  EXPECT_EQ(state.quality, "caution");
  EXPECT_EQ(state.flags, to_string(QualityFlag::kDeadline));
  EXPECT_FALSE(state.blank);
  EXPECT_TRUE(state.has_sd && state.has_known);
  EXPECT_DOUBLE_EQ(state.spacing_mm, 2.0);
  EXPECT_DOUBLE_EQ(state.fade_mm, 8.0);
  EXPECT_LT(state.grid_error_mm, kFloat) << "a linear field is the same on both";
}

// Every node of the region lies inside of the fade, so that its displacement is shown as it is.
TEST(FieldStream, TheRegionLiesInsideOfTheFade) {
  const BrainModel model = test_support::toy_patient(6);
  for (const double spacing_mm : {1.0, 2.0, 3.0}) {
    const StreamOptions options{.region = TumourRegion{6.0}, .spacing_mm = spacing_mm};
    const auto nodes =
        geometry::nodes_in_region(model, options.region, geometry::distances_from_tumour(model))
            .value();
    FieldStream stream = FieldStream::build(model, options).value();
    auto far = streamed_update(model);
    // Only the region's nodes move: another weight than 1 on them would show.
    for (Eigen::Index i = 0; i < model.mesh.nodes.cols(); ++i) {
      far.update.estimate.displacement.col(i) = Vec3::Constant(3.0);
    }
    const auto picture = stream.picture(far).value();
    EXPECT_LT(picture->state.grid_error_mm, kFloat);
    const FieldGrid& grid = stream.grid();
    for (const NodeIndex node : nodes) {
      const Vec3 place = (model.mesh.nodes.col(node) - grid.origin_mm) / grid.spacing_mm;
      for (int corner = 0; corner < 8; ++corner) {
        const Eigen::Array3i at = place.array().floor().cast<int>() +
                                  Eigen::Array3i(corner & 1, (corner >> 1) & 1, (corner >> 2) & 1);
        EXPECT_NEAR(picture->u[3 * grid.index(at[0], at[1], at[2])], 3.0, kFloat)
            << spacing_mm << " mm, node " << node;
      }
    }
  }
}

TEST(FieldStream, AsksForTheBallThatHoldsWhatItNeedsAndForAllWithSurfaces) {
  const BrainModel model = test_support::toy_patient(10);
  const FieldStream with = FieldStream::build(model, {.region = TumourRegion{2.0}}).value();
  EXPECT_EQ(with.choice(), FieldChoice{}) << "the cortex is needed as a whole";
  StreamOptions options{.region = TumourRegion{2.0}, .margin_mm = 2.0, .with_surfaces = false};
  FieldStream without = FieldStream::build(model, options).value();
  const auto* ball = std::get_if<BallRegion>(&without.choice().region);
  ASSERT_NE(ball, nullptr);
  const auto nodes = geometry::nodes_in_region(model, *ball, {}).value();
  EXPECT_LT(nodes.size(), static_cast<std::size_t>(model.mesh.num_nodes()));
  const auto part = without.picture(part_of(model, nodes));
  ASSERT_TRUE(part) << part.error().message;
  const auto whole = without.picture(streamed_update(model)).value();
  EXPECT_EQ((*part)->u, whole->u);
  EXPECT_EQ((*part)->sd, whole->sd);
  EXPECT_EQ((*part)->known, whole->known);
  EXPECT_EQ((*part)->state.grid_error_mm, whole->state.grid_error_mm);
}

TEST(FieldStream, RefusesUpdatesThatAreNotOfItsModel) {
  const BrainModel model = test_support::toy_patient(5);
  FieldStream stream = FieldStream::build(model, {}).value();
  auto other = streamed_update(model);
  other.update.model_id = "other";
  EXPECT_THAT(stream.picture(other).error().message, HasSubstr("of model other"));
  auto fewer = streamed_update(model);
  fewer.update.estimate.displacement = Points::Zero(3, 7);
  EXPECT_THAT(stream.picture(fewer).error().message, HasSubstr("7 nodes"));
  EXPECT_THAT(stream.picture(part_of(model, {0, 1, 2})).error().message, HasSubstr("leaves out"));
}

TEST(FieldStream, AFieldWithoutUncertaintySaysSo) {
  const BrainModel model = test_support::toy_patient(5);
  FieldStream stream = FieldStream::build(model, {}).value();
  auto message = streamed_update(model);
  message.update.estimate.known.resize(0);  // of an older daemon
  const auto older = stream.picture(message).value();
  EXPECT_TRUE(older->state.has_sd);
  EXPECT_FALSE(older->state.has_known);
  EXPECT_TRUE(older->known.empty());
  EXPECT_TRUE(older->surfaces[Shape::kCortex]->attributes[2].values.isZero(0.0F));
  message.update.estimate.sd_mm.resize(0);
  const auto picture = stream.picture(message).value();
  EXPECT_FALSE(picture->state.has_sd);
  EXPECT_TRUE(picture->sd.empty());
}

TEST(FieldStream, RefusesRegionsWithoutANodeAndGridsWithoutEnd) {
  BrainModel model = test_support::toy_patient(5);
  const auto nowhere = FieldStream::build(model, {.region = BallRegion{Vec3::Constant(900), 1.0}});
  EXPECT_EQ(nowhere.error().code, ErrorCode::kEmptySet);
  const auto fine = FieldStream::build(model, {.region = WholeBrain{}, .spacing_mm = 0.01});
  EXPECT_EQ(fine.error().code, ErrorCode::kInvalidArgument);
  model.tumour = {};
  EXPECT_THAT(FieldStream::build(model, {}).error().message, HasSubstr("has no tumour"));
}

}  // namespace
}  // namespace brainshift::client
