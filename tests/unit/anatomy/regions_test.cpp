// SPDX-License-Identifier: GPL-3.0-or-later
// Heads with labels: septa and ventricles through build_brain_model.
#include "common/anatomy/regions.hpp"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <set>

#include "common/anatomy/brain_model_builder.hpp"
#include "common/anatomy/septa.hpp"
#include "common/geometry/mesh_quality.hpp"
#include "common/geometry/surface.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/anatomy/ball_case.hpp"

namespace brainshift::anatomy {
namespace {

using ::testing::HasSubstr;
using testing::kBallCentre;
using testing::kBallRadius_mm;

constexpr double kVentricle_mm = 12.0;   // radius, about the ball's centre
constexpr double kCallosum_mm = 20.0;    // the same of the white matter that joins the halves
constexpr double kTentorium_mm = -26.0;  // height above the centre

// The ball's parts. x: from its centre.
int label_at(const Vec3& x) {
  if (x.norm() > kBallRadius_mm) return 0;
  const double off_axis = std::hypot(x[0], x[1]);
  if (off_axis < 9.0 && x[2] < -10.0) return 16;
  if (x.norm() < kVentricle_mm) return x[0] < 0.0 ? 4 : 43;
  if (x[2] < kTentorium_mm) return x[0] < 0.0 ? 8 : 47;
  if (x.norm() < kCallosum_mm) return x[0] < 0.0 ? 2 : 41;
  if (std::abs(x[0]) < 1.0) return 24;
  const bool cortex = std::abs(x[0]) < 5.0 || x.norm() > 44.0 || x[2] < kTentorium_mm + 5.0;
  return cortex ? (x[0] < 0.0 ? 3 : 42) : (x[0] < 0.0 ? 2 : 41);
}

CaseInputs labelled_case(const std::map<int, int>& instead = {}) {
  CaseInputs inputs = testing::ball_case();
  // Away from the middle, so that nothing of the anatomy lies in the tumour.
  inputs.config.tumour = TumourEllipsoid{kBallCentre + Vec3(32, 0, 0), Vec3(8, 8, 6)};
  std::get<MeshGeneration>(inputs.config.mesh).edge_mm = 6.0;
  inputs.config.anatomy.labels = "labels.nii";
  VoxelImage map = geometry::balls::empty_image(112, kBallCentre, Mat3::Identity());
  std::size_t v = 0;
  for (int k = 0; k < map.dims[2]; ++k)
    for (int j = 0; j < map.dims[1]; ++j)
      for (int i = 0; i < map.dims[0]; ++i, ++v) {
        int label = label_at(map.T_ras_voxel * Vec3(i, j, k) - kBallCentre);
        if (const auto other = instead.find(label); other != instead.end()) label = other->second;
        map.values[v] = static_cast<float>(label);
      }
  inputs.labels = std::move(map);
  return inputs;
}

struct LabelledHead {
  BrainModel model;
  std::vector<std::string> notes;
};
LabelledHead head_of(const CaseInputs& inputs) {
  LabelledHead made;
  made.model = value_or_fail(build_brain_model(inputs, {}, &made.notes));
  return made;
}
const LabelledHead& shared_head() {
  static const LabelledHead head = head_of(labelled_case());
  return head;
}

Vec3 centre_of(const TetMesh& mesh, int t) {
  Vec3 centre = Vec3::Zero();
  for (int k = 0; k < 4; ++k) centre += 0.25 * mesh.nodes.col(mesh.tets(k, t));
  return centre - kBallCentre;
}

TEST(Regions, TissuesOfTheMeshAreThoseOfTheMap) {
  const TetMesh& mesh = shared_head().model.mesh;
  const std::map<int, int> expected = {
      {2, kWhiteMatter},     {41, kWhiteMatter},     {3, kGreyMatter},     {42, kGreyMatter},
      {8, kCerebellumLabel}, {47, kCerebellumLabel}, {16, kBrainstemLabel}};
  std::map<int, std::pair<int, int>> right_of_all;
  for (int t = 0; t < mesh.num_tets(); ++t) {
    const auto found = expected.find(label_at(centre_of(mesh, t)));
    if (found == expected.end()) continue;
    auto& [right, all] = right_of_all[found->second];
    right += mesh.labels[static_cast<std::size_t>(t)] == found->second ? 1 : 0;
    ++all;
  }
  ASSERT_EQ(right_of_all.size(), 4u);
  for (const auto& [label, counts] : right_of_all)
    EXPECT_GT(counts.first, 0.7 * counts.second) << label;  // thin layers are smoothed
}

TEST(Regions, VentriclesAreACavityWithAClosedWall) {
  const BrainModel& model = shared_head().model;
  const TriangleSurface wall{model.mesh.nodes, model.ventricle_wall};
  EXPECT_TRUE(geometry::is_closed(wall));
  EXPECT_NEAR(-geometry::enclosed_volume(wall), geometry::balls::ball_volume(kVentricle_mm),
              0.25 * geometry::balls::ball_volume(kVentricle_mm));
  for (int t = 0; t < model.mesh.num_tets(); ++t)
    EXPECT_GT(centre_of(model.mesh, t).norm(), kVentricle_mm - 3.0);
  EXPECT_TRUE(geometry::check_mesh(model.mesh).has_value());
}

TEST(Regions, TheSlitLeavesCallosumAndNotchOpen) {
  const BrainModel& model = shared_head().model;
  double falx = 0.0, tentorium = 0.0;
  for (const auto& triangle : model.septa.triangles.colwise()) {
    const Vec3 a = model.mesh.nodes.col(triangle[0]), b = model.mesh.nodes.col(triangle[1]),
               c = model.mesh.nodes.col(triangle[2]);
    const Vec3 centre = (a + b + c) / 3.0 - kBallCentre;
    const Vec3 area = 0.5 * (b - a).cross(c - a);
    EXPECT_GT(centre.norm(), kCallosum_mm - 3.0);
    EXPECT_GT(std::hypot(centre[0], centre[1]), centre[2] < -10.0 ? 9.0 : 0.0);
    if (std::abs(centre[0]) < 2.0 && centre[2] > kTentorium_mm + 2.0) {
      falx += 0.5 * std::abs(area[0]);
    } else {
      EXPECT_NEAR(centre[2], kTentorium_mm, 3.0);
      tentorium += 0.5 * std::abs(area[2]);
    }
  }
  // The half plane between callosum and surface, above the tentorium: about 5,300 mm^2; the
  // tentorium without the notch: about 5,300 mm^2.
  EXPECT_GT(falx, 3500.0);
  EXPECT_LT(falx, 5600.0);
  EXPECT_GT(tentorium, 3500.0);
  EXPECT_LT(tentorium, 5600.0);
}

TEST(Regions, SlavesOfTheSheetsComeInPairsThatLookAwayFromOneAnother) {
  const BrainModel& model = shared_head().model;
  std::map<std::array<double, 3>, Vec3> sum;
  std::map<std::array<double, 3>, int> count;
  for (std::size_t i = 0; i < model.septa.slaves.size(); ++i) {
    const Vec3 x = model.mesh.nodes.col(model.septa.slaves[i]);
    const std::array<double, 3> key = {x[0], x[1], x[2]};
    sum.try_emplace(key, Vec3::Zero()).first->second +=
        model.septa.normals.col(static_cast<Eigen::Index>(i));
    ++count[key];
  }
  int pairs = 0;
  for (const auto& [key, number] : count) {
    if (number != 2) continue;
    ++pairs;
    EXPECT_LT(sum[key].norm(), 0.3);
  }
  EXPECT_GT(pairs, 50);
  EXPECT_DOUBLE_EQ(model.septa.gap_mm, 0.5);
}

TEST(Regions, TheNodeSetsAreTheOuterSurface) {
  const BrainModel& model = shared_head().model;
  std::vector<NodeIndex> all;
  for (const auto* set : {&model.craniotomy, &model.brainstem, &model.slaves, &model.fixed})
    all.insert(all.end(), set->begin(), set->end());
  const std::set<NodeIndex> once(all.begin(), all.end());
  EXPECT_EQ(once.size(), all.size());
  const auto outer = model.boundary_triangles.reshaped();
  EXPECT_EQ(once, std::set<NodeIndex>(outer.begin(), outer.end()));
  const TriangleSurface surface{model.mesh.nodes, model.boundary_triangles};
  EXPECT_NEAR(geometry::enclosed_volume(surface), geometry::balls::ball_volume(kBallRadius_mm),
              0.03 * geometry::balls::ball_volume(kBallRadius_mm));
  EXPECT_TRUE(geometry::is_closed(model.skull));
  for (const NodeIndex node : model.septa.slaves)
    EXPECT_FALSE(std::binary_search(model.fixed.begin(), model.fixed.end(), node));
}

TEST(Regions, WhatIsNotAskedForIsNotThere) {
  CaseInputs inputs = labelled_case();
  inputs.config.anatomy.septa = inputs.config.anatomy.tissues = false;
  const BrainModel model = head_of(inputs).model;
  EXPECT_TRUE(model.septa.slaves.empty());
  EXPECT_TRUE(model.mesh.labels.empty());
  EXPECT_GT(model.ventricle_wall.cols(), 0);
  inputs.config.anatomy.ventricles = false;
  const BrainModel without = head_of(inputs).model;
  inputs.config.anatomy.labels.reset();
  EXPECT_EQ(without.model_id, head_of(inputs).model.model_id);
}

std::string refusal(const CaseInputs& inputs) {
  return refusal_of(build_brain_model(inputs), ErrorCode::kInvalidArgument);
}

TEST(Regions, MapsThatCannotGiveWhatIsAskedForAreNamed) {
  EXPECT_THAT(refusal(labelled_case({{3, 42}, {2, 41}})),
              HasSubstr("anatomy.labels = 'labels.nii': does not tell the cortex of the left "
                        "hemisphere from that of the right"));
  EXPECT_THAT(refusal(labelled_case({{2, 41}, {3, 42}, {41, 2}, {42, 3}})),
              HasSubstr("labels of the left hemisphere lie right of those of the right one"));
  CaseInputs unknown = labelled_case();
  for (float& v : unknown.labels->values) v = v > 0.0F ? 507.0F : 0.0F;
  EXPECT_THAT(refusal(unknown), HasSubstr("no label is of the cerebrum by anatomy.numbers = "
                                          "freesurfer (there: 507 ("));
  CaseInputs image = labelled_case();
  image.labels->values[1000] = 0.25F;
  EXPECT_THAT(refusal(image), HasSubstr("is no label map: it has the value 0.25"));
  image.label_names = {{2, "Left-Cerebral-White-Matter"}};  // whose numbers round the values
  EXPECT_THAT(refusal(image), HasSubstr("is no label map: it has the value 0.25"));
  CaseInputs mri = labelled_case();
  int n = 0;
  for (float& v : mri.labels->values) v = static_cast<float>(n++ % 997);
  EXPECT_THAT(refusal(mri), HasSubstr("anatomy.labels = 'labels.nii': is an image, not a label"));
  CaseInputs ready = labelled_case();
  ready.config.mesh = MeshFile{"head.msh"};
  EXPECT_THAT(refusal(ready), HasSubstr("anatomy.labels: needs a mesh that is generated"));
}

VoxelImage moved(VoxelImage map, const Vec3& by) {
  map.T_ras_voxel.pretranslate(by);
  return map;
}

TEST(Regions, MapsOfAnotherHeadOrPlaceAreRefused) {
  CaseInputs elsewhere = labelled_case();
  elsewhere.labels = moved(*elsewhere.labels, Vec3(0, 0, 12));
  EXPECT_THAT(refusal(elsewhere),
              ::testing::AllOf(HasSubstr("anatomy.labels = 'labels.nii': "),
                               HasSubstr("% of its brain lie more than 3 mm outside the mask of "
                                         "images.brain = 'ball.nii': must be at most 4 %")));
  CaseInputs half = labelled_case();
  std::size_t v = 0;
  for (int k = 0; k < half.labels->dims[2]; ++k)
    for (int j = 0; j < half.labels->dims[1]; ++j)
      for (int i = 0; i < half.labels->dims[0]; ++i, ++v) {
        const Vec3 x = half.labels->T_ras_voxel * Vec3(i, j, k) - kBallCentre;
        if (x[1] > 0.0) half.labels->values[v] = 0.0F;
      }
  EXPECT_THAT(refusal(half), HasSubstr("lie more than 20 mm from any label of the brain"));
}

double tissue_within(const BrainModel& model, const Vec3& centre, double radius_mm) {
  double volume_mm3 = 0.0;
  for (int t = 0; t < model.mesh.num_tets(); ++t) {
    const bool within = (centre_of(model.mesh, t) - centre).norm() < radius_mm;
    volume_mm3 += within ? geometry::tet_volume(model.mesh, t) : 0.0;
  }
  return volume_mm3;
}

TEST(Regions, ATumourThatReachesIntoAVentricleKeepsItsTissue) {
  CaseInputs inputs = labelled_case();
  const Vec3 middle(10, 0, 0);
  inputs.config.tumour = TumourEllipsoid{kBallCentre + middle, Vec3::Constant(9.0)};
  const LabelledHead head = head_of(inputs);
  EXPECT_GT(tissue_within(head.model, middle, 9.0), 0.8 * geometry::balls::ball_volume(9.0));
  EXPECT_THAT(head.notes, ::testing::Contains(HasSubstr("of the tumour lie in ventricles")));
  inputs.config.tumour = TumourEllipsoid{kBallCentre, Vec3::Constant(4.0)};
  EXPECT_THAT(refusal(inputs), HasSubstr("% of the tumour stand in ventricles without touching"));
}

// Both hemispheres of white matter alone: tissue joins them everywhere.
TEST(Regions, WhereTissueJoinsTheSidesEverywhereThereIsNoSeptum) {
  CaseInputs inputs = labelled_case({{24, 2}, {8, 16}, {47, 16}});
  for (std::size_t v = 0; v < inputs.labels->values.size(); ++v) {
    float& label = inputs.labels->values[v];
    const int i = static_cast<int>(v % 112);
    if ((label == 3.0F || label == 42.0F) && std::abs(i - 55.5) < 12.0) label -= 1.0F;
  }
  EXPECT_THAT(refusal_of(build_brain_model(inputs), ErrorCode::kEmptySet),
              HasSubstr("no falx or tentorium"));
}

TEST(Regions, AMapWithoutVentriclesIsTold) {
  const auto notes = head_of(labelled_case({{4, 2}, {43, 41}})).notes;
  EXPECT_THAT(notes, ::testing::Contains(HasSubstr("has no label of the ventricles")));
}

TEST(Regions, LabelsThatNobodyKnowsAreToldWithTheirSizesAndTheFile) {
  CaseInputs inputs = labelled_case();
  std::size_t v = 0;
  for (int k = 0; k < inputs.labels->dims[2]; ++k)
    for (int j = 0; j < inputs.labels->dims[1]; ++j)
      for (int i = 0; i < inputs.labels->dims[0]; ++i, ++v) {
        const Vec3 x = inputs.labels->T_ras_voxel * Vec3(i, j, k) - kBallCentre;
        if ((x - Vec3(0, 30, 10)).norm() < 6.0) inputs.labels->values[v] = 507.0F;
      }
  EXPECT_THAT(head_of(inputs).notes,
              ::testing::Contains(::testing::AllOf(
                  HasSubstr("anatomy.labels = 'labels.nii': not of the brain by anatomy.numbers = "
                            "freesurfer: 507 ("),
                  HasSubstr(" cc); where the brain is"))));
  for (const std::string& note : shared_head().notes) {
    EXPECT_THAT(note, ::testing::Not(HasSubstr("not of the brain")));
    EXPECT_TRUE(asks_nothing(note)) << note;
  }
}

// A horn as wide as the ventricle, to the surface: a cavity must not open it.
TEST(Regions, VentriclesThatTouchTheSurfaceStayBrainThereAndAreTold) {
  CaseInputs inputs = labelled_case();
  std::size_t v = 0;
  for (int k = 0; k < inputs.labels->dims[2]; ++k)
    for (int j = 0; j < inputs.labels->dims[1]; ++j)
      for (int i = 0; i < inputs.labels->dims[0]; ++i, ++v) {
        const Vec3 x = inputs.labels->T_ras_voxel * Vec3(i, j, k) - kBallCentre;
        float& label = inputs.labels->values[v];
        if (label > 0.0F && x[1] > 0.0 && std::hypot(x[0], x[2]) < kVentricle_mm) label = 4.0F;
      }
  const LabelledHead head = head_of(inputs);
  EXPECT_THAT(head.notes,
              ::testing::Contains(::testing::AllOf(HasSubstr("anatomy.labels: of "),
                                                   HasSubstr(" cc touch the brain's surface and "),
                                                   HasSubstr("they are brain; nothing to do"))));
  EXPECT_TRUE(geometry::is_closed({head.model.mesh.nodes, head.model.ventricle_wall}));
  EXPECT_NEAR(geometry::enclosed_volume({head.model.mesh.nodes, head.model.boundary_triangles}),
              geometry::balls::ball_volume(kBallRadius_mm),
              0.03 * geometry::balls::ball_volume(kBallRadius_mm));
}

TEST(Regions, AalNumbersAreThoseOfTheSameStructures) {
  VoxelImage map;
  map.dims = {8, 1, 1};
  map.values = {1, 2, 77, 78, 91, 92, 116, 117};
  EXPECT_EQ(with_freesurfer_numbers_of_aal(map).values,
            (std::vector<float>{3, 42, 10, 49, 8, 47, 8, 0}));
}

TEST(Regions, SidesAndMatterFollowTheNames) {
  EXPECT_EQ(side_of(2), Side::kLeft);
  EXPECT_EQ(side_of(42), Side::kRight);
  EXPECT_EQ(side_of(253), Side::kNone);
  EXPECT_EQ(side_of(1012), Side::kLeft);
  EXPECT_EQ(side_of(12112), Side::kRight);
  EXPECT_EQ(side_of(4001), Side::kRight);
  EXPECT_EQ(matter_of(3), Matter::kCortex);
  EXPECT_EQ(matter_of(2012), Matter::kCortex);
  EXPECT_EQ(matter_of(3012), Matter::kWhite);
  EXPECT_EQ(matter_of(13112), Matter::kWhite);
  EXPECT_EQ(matter_of(251), Matter::kWhite);
  EXPECT_EQ(matter_of(49), Matter::kNucleus);
  EXPECT_EQ(matter_of(28), Matter::kWhite);
}

}  // namespace
}  // namespace brainshift::anatomy
