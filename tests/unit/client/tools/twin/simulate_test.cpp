// SPDX-License-Identifier: GPL-3.0-or-later
// A truth that a user brings.

#include "client/tools/twin/simulate.hpp"

#include <gmock/gmock.h>

#include <limits>

#include "client/tools/twin/surgery.hpp"
#include "common/io/geometry/mesh_writer.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::client {
namespace {

using testing::HasSubstr;

class GivenField : public testing::Test {
 protected:
  std::string refusal(const TetMesh& mesh, const std::vector<io::NodeField>& fields) {
    EXPECT_TRUE(io::write_vtu(path, mesh, fields));
    const auto field = read_truth_field(path, model);
    EXPECT_THAT(sentence_of(field), HasSubstr(path.string()));
    return sentence_of(field);
  }
  test_support::TemporaryFolder folder;
  std::filesystem::path path = folder.path() / "mine.vtu";
  BrainModel model = test_support::toy_patient(6);
  Eigen::MatrixXd u = 0.01 * model.mesh.nodes;
};

TEST_F(GivenField, IsReadFromTheCaseSMesh) {
  ASSERT_TRUE(io::write_vtu(path, model.mesh, {{"other", 2.0 * u}, {"displacement", u}}));
  const Points read = value_or_fail(read_truth_field(path, model));
  EXPECT_LT((read - u).cwiseAbs().maxCoeff(), 1e-12);
}

TEST_F(GivenField, OfAnotherMeshIsRefused) {
  const BrainModel other = test_support::toy_patient(5);
  EXPECT_THAT(refusal(other.mesh, {{"displacement", other.mesh.nodes}}),
              HasSubstr("has 216 points, the case's mesh has 343 nodes"));
  TetMesh moved = model.mesh;
  moved.nodes(1, 17) += 0.5;
  EXPECT_THAT(refusal(moved, {{"displacement", u}}), HasSubstr("point 17 lies 0.5 mm beside"));
}

TEST_F(GivenField, WithoutAFiniteVectorPerNodeIsRefused) {
  EXPECT_THAT(refusal(model.mesh, {{"u", u}}), HasSubstr("no point array displacement"));
  EXPECT_THAT(refusal(model.mesh, {{"displacement", u.row(0)}}), HasSubstr("1 components"));
  u(2, 9) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refusal(model.mesh, {{"displacement", u}}), HasSubstr("point 9 is not finite"));
}

// Tumour, cortex and tracks see what was given, and nothing of the scenario's own sag.
TEST_F(GivenField, IsTheTruthOfEveryObservation) {
  const Points given = Points(u);
  const auto surgery = value_or_fail(
      play_given(model, test_support::toy_config(), *find_scenario(kInstrumentsOfTruth), given, 3));
  ASSERT_EQ(surgery.observations.size(), 3u);
  for (const io::SurgeryTruth& truth : surgery.truths) {
    EXPECT_EQ(truth.displacement, given);
    EXPECT_EQ(truth.scalars.count("fluid_level_mm"), 0u);
  }
  const auto& tracks = std::get<LandmarkPairs>(surgery.observations[2].body);
  const Points off = tracks.deformed - 1.01 * tracks.undeformed;
  EXPECT_LT(off.colwise().norm().mean(), 1.0);  // noise of 0.5 mm
}

}  // namespace
}  // namespace brainshift::client
