// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/prior_study/prior_draws.hpp"
#include "tests/support/results.hpp"

#include <gmock/gmock.h>

namespace brainshift::prior_study {
namespace {

using ::testing::HasSubstr;

TEST(PriorStrengths, AreAsInTheCaseButForThoseNamed) {
  const auto strengths = value_or_fail(parse_strengths({"opening=1.5", "fine=0"}));
  PriorScaleValues expected = kAsInTheCase;
  expected[static_cast<std::size_t>(PriorPart::kOpening)] = 1.5;
  expected[static_cast<std::size_t>(PriorPart::kFine)] = 0.0;
  EXPECT_EQ(strengths, expected);
  EXPECT_EQ(*parse_strengths({}), kAsInTheCase);
}

TEST(PriorStrengths, RefuseWhatNamesNoStrength) {
  for (const char* const text : {"", "opening", "opening=", "=1", "wind=1", "opening=-1",
                                 "opening=nan", "opening=inf", "opening=1.5x", "Opening=1"}) {
    EXPECT_THAT(refusal_of(parse_strengths({text}), ErrorCode::kInvalidArgument),
                HasSubstr("strength " + std::string(text) + ":"))
        << text;
  }
  EXPECT_FALSE(parse_strengths({"opening=1", "opening=1"})) << "twice";
}

TEST(PriorStrengths, ScaleTheColumnsOfTheirPart) {
  CondensedOperators operators;
  operators.part_columns = {2, 1};
  operators.part_columns[static_cast<std::size_t>(PriorPart::kOpening)] = 1;
  operators.part_columns[static_cast<std::size_t>(PriorPart::kCoarse)] = 2;
  PriorScaleValues strengths = {};
  strengths[static_cast<std::size_t>(PriorPart::kAlongGravity)] = 2.0;
  strengths[static_cast<std::size_t>(PriorPart::kOpening)] = 3.0;
  VecX z(6), expected(6);
  z << 1, 2, 3, 4, 5, 6;
  expected << 2, 4, 0, 12, 0, 0;
  EXPECT_EQ(scaled_modes(operators, strengths, z), expected);
}

// A unit cube whose opening is the face x = 1; its boundary triangles are those of the mesh.
class OpenCube : public ::testing::Test {
 protected:
  OpenCube() {
    model_.mesh.nodes.resize(3, 8);
    model_.mesh.nodes << 0, 1, 0, 1, 0, 1, 0, 1,  //
        0, 0, 1, 1, 0, 0, 1, 1,                   //
        0, 0, 0, 0, 1, 1, 1, 1;
    model_.mesh.tets.resize(4, 6);
    model_.mesh.tets << 0, 0, 0, 0, 0, 0,  //
        1, 3, 2, 6, 4, 5,                  //
        3, 2, 6, 4, 5, 1,                  //
        7, 7, 7, 7, 7, 7;
    model_.boundary_triangles.resize(3, 4);
    model_.boundary_triangles << 1, 1, 0, 0,  // two of x = 1, two of x = 0; outwards
        3, 7, 4, 6,                           //
        7, 5, 6, 2;
    model_.craniotomy = {1, 3, 5, 7};
    model_.tumour.vertices.resize(3, 2);
    model_.tumour.vertices << 0.2, 0.4, 0.3, 0.3, 0.5, 0.5;
  }
  BrainModel model_;
};

TEST_F(OpenCube, OutwardPointsOutOfTheOpening) {
  EXPECT_NEAR((outward_of(model_) - Vec3::UnitX()).norm(), 0.0, 1e-12);
}

TEST_F(OpenCube, PlacesAreOnTheOpeningInTheTumourAndOpposite) {
  const auto places = places_of(model_, geometry::TetLocator(model_.mesh));
  EXPECT_EQ(places[0].at(model_.mesh.nodes).x(), 1.0);
  EXPECT_NEAR((places[1].at(model_.mesh.nodes) - Vec3(0.3, 0.3, 0.5)).norm(), 0.0, 1e-12);
  EXPECT_EQ(places[2].at(model_.mesh.nodes).x(), 0.0);
}

TEST(MeshPoint, InterpolatesNodalValues) {
  Points nodal(3, 4);
  nodal << 1, 2, 3, 4, 0, 0, 0, 8, 0, 4, 0, 0;
  const MeshPoint point{{0, 1, 2, 3}, {0.25, 0.25, 0.25, 0.25}};
  EXPECT_NEAR((point.at(nodal) - Vec3(2.5, 2, 1)).norm(), 0.0, 1e-12);
}

TEST(LeftOutSd, AddsTheRemaindersVariances) {
  CondensedOperators operators;
  operators.truncated_variance_mm2.resize(2, kRemainders);
  operators.truncated_variance_mm2 << 1, 2, 1, 0, 9, 0, 0, 0;
  operators.control_neighbours.setZero(4, 2);
  operators.control_neighbours(0, 1) = 1;
  operators.control_weights.setZero(4, 2);
  operators.control_weights.row(0).setOnes();
  std::array<MeshPoint, kPlaces> places;
  places[1].nodes.setConstant(1);
  const auto sd = left_out_sd_mm(operators, places);
  EXPECT_DOUBLE_EQ(sd[0], 2.0);
  EXPECT_DOUBLE_EQ(sd[1], 3.0);
}

}  // namespace
}  // namespace brainshift::prior_study
