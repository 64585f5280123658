// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/preview/case_view.hpp"

#include <gmock/gmock.h>

#include "tests/support/results.hpp"
#include "tests/unit/client/tools/preview/box_case.hpp"

namespace brainshift::client {
namespace {

using test_support::TemporaryFolder;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class CaseViewOf : public testing::Test {
 protected:
  CaseView view(const BoxCase& box = {}) { return view_case(write_box_case(folder, box)).value(); }
  TemporaryFolder folder;
};

TEST_F(CaseViewOf, ASoundCaseHasRolesAndNeitherProblemsNorDoubtsButItsSize) {
  const CaseView seen = view();
  EXPECT_THAT(seen.problems, IsEmpty());
  EXPECT_THAT(doubts(seen), ElementsAre(HasSubstr("the brain has 3375 cc; an adult's has 900 to")));
  ASSERT_EQ(seen.roles.size(), static_cast<std::size_t>(seen.brain.num_vertices()));
  for (const NodeRole role :
       {NodeRole::kFixed, NodeRole::kSlave, NodeRole::kCraniotomy, NodeRole::kBrainstem})
    EXPECT_THAT(seen.roles, Contains(role));
  const auto opening = opening_of(seen);
  ASSERT_TRUE(opening);
  EXPECT_NEAR(opening->centre.x(), 75.0, 1e-9);
  EXPECT_GT(opening->normal.x(), 0.9);
}

TEST_F(CaseViewOf, FactsGiveSizesSidesAndAngles) {
  const auto lines = facts(view());
  EXPECT_THAT(lines, Contains("case box"));
  EXPECT_THAT(lines, Contains(AllOf(HasSubstr("150 x 150 x 150 mm"), HasSubstr("3375 cc"))));
  EXPECT_THAT(lines, Contains(AllOf(HasSubstr("tumour: 7."),
                                    HasSubstr("right 40, posterior 10, superior 20 mm"))));
  EXPECT_THAT(lines, Contains(AllOf(HasSubstr("gravity: left 1.00; 180 degrees"))));
}

TEST_F(CaseViewOf, DoubtsNameATumourOnTheOtherSide) {
  EXPECT_THAT(doubts(view({.tumour = "[-40, -10, 20]"})),
              Contains(AllOf(HasSubstr("the tumour lies on the left, the craniotomy on the right"),
                             HasSubstr("tumour.ellipsoid"))));
}

TEST_F(CaseViewOf, DoubtsNameGravityThatPullsOutOfTheOpening) {
  EXPECT_THAT(doubts(view({.gravity = "[1, 0, 0]", .brainstem = "[0, 0, -75]"})),
              Contains(AllOf(HasSubstr("faces down"), HasSubstr("gravity.direction"))));
}

TEST_F(CaseViewOf, DoubtsNameABrainOfAnotherUnit) {
  const BoxCase box{.craniotomy = "[150, -10, 20]", .brainstem = "[0, 0, -150]", .side_mm = 300.0};
  EXPECT_THAT(doubts(view(box)), Contains(HasSubstr("300 mm long")));
}

TEST_F(CaseViewOf, DoubtsNameABrainstemOnTop) {
  EXPECT_THAT(doubts(view({.brainstem = "[0, 0, 75]"})),
              Contains(HasSubstr("brainstem.centre_mm")));
}

TEST_F(CaseViewOf, DoubtsNameATumourThatIsCutAtTheSurface) {
  const CaseView seen = view({.tumour = "[65, -10, 20]"});  // sticks out by 2 mm
  EXPECT_THAT(seen.problems, IsEmpty());
  EXPECT_THAT(doubts(seen), Contains(HasSubstr("outside the brain, by up to 2.0 mm")));
}

TEST_F(CaseViewOf, ATumourOutsideTheBrainIsAProblemThatIsStillSeen) {
  const CaseView seen = view({.tumour = "[90, -10, 20]"});
  EXPECT_THAT(seen.problems,
              ElementsAre(AllOf(HasSubstr("tumour.ellipsoid"), HasSubstr("outside the brain"))));
  EXPECT_GT(seen.tumour.num_vertices(), 0);
  EXPECT_GT(seen.brain.num_vertices(), 0);
  EXPECT_THAT(seen.roles, Not(IsEmpty()));
}

TEST_F(CaseViewOf, AnOpeningInTheAirIsAProblemWithoutRoles) {
  const CaseView seen = view({.craniotomy = "[175, -10, 20]"});
  EXPECT_THAT(seen.problems, ElementsAre(HasSubstr("craniotomy.centre_mm")));
  EXPECT_THAT(seen.roles, IsEmpty());
  EXPECT_FALSE(opening_of(seen));
  EXPECT_THAT(doubts(seen), Contains(AllOf(HasSubstr("craniotomy.centre_mm = [175, -10, 20]"),
                                           HasSubstr("100 mm from the brain's surface"))));
}

TEST_F(CaseViewOf, DoubtsSayHowFarACentreIsProjectedAndKnowCentimetres) {
  const auto lines = doubts(view({.craniotomy = "[7.5, -1, 2]"}));
  EXPECT_THAT(lines, Contains(AllOf(HasSubstr("[7.5, -1, 2]"), HasSubstr("centimetres?"))));
  EXPECT_THAT(
      doubts(view({.craniotomy = "[60, -10, 20]"})),
      Contains(AllOf(HasSubstr("mm from the brain's surface"), Not(HasSubstr("centimetres?")))));
}

TEST_F(CaseViewOf, NotesThatAskNothingAreFactsAndOthersDoubts) {
  CaseView seen = view();
  seen.notes = {"falx of 70 cm2; nothing to do", "falx of 7 cm2; look at the falx"};
  EXPECT_THAT(facts(seen), AllOf(Contains(seen.notes[0]), Not(Contains(seen.notes[1]))));
  EXPECT_THAT(doubts(seen), AllOf(Contains(seen.notes[1]), Not(Contains(seen.notes[0]))));
}

TEST_F(CaseViewOf, DoubtsNameAMaskThatHasLeaked) {
  CaseView seen = view();
  seen.leak_mm3 = 4900.0, seen.leak_centre = Vec3(20, 84, -10);
  EXPECT_THAT(doubts(seen), Not(Contains(HasSubstr("did the mask leak"))));
  seen.leak_mm3 = 13100.0;
  EXPECT_THAT(doubts(seen), Contains(AllOf(HasSubstr("13 cc of images.brain hang on the rest"),
                                           HasSubstr("right 20, anterior 84, inferior 10 mm"))));
}

// An MRI that is bright in the box, grey around it and black far away.
VoxelImage head_with_a_brain(const Vec3& centre) {
  VoxelImage mri;
  mri.dims = {101, 101, 101};
  mri.T_ras_voxel.linear() *= 2.0;
  mri.T_ras_voxel.translation() = Vec3(-100, -100, -100);
  for (int k = 0; k < 101; ++k) {
    for (int j = 0; j < 101; ++j) {
      for (int i = 0; i < 101; ++i) {
        const double away = (mri.T_ras_voxel * Vec3(i, j, k) - centre).cwiseAbs().maxCoeff();
        mri.values.push_back(away < 75.0 ? 100.0F : away < 90.0 ? 40.0F : 0.0F);
      }
    }
  }
  return mri;
}

TEST_F(CaseViewOf, DoubtsNameABrainBesideTheOneInTheMri) {
  CaseView seen = view();
  EXPECT_FALSE(fit_of_mri(seen));
  seen.config.mri = "t1.nii";
  seen.background = head_with_a_brain(Vec3::Zero());
  EXPECT_GT(fit_of_mri(seen)->contrast, 0.5);
  EXPECT_THAT(doubts(seen), Not(Contains(HasSubstr("images.mri"))));
  seen.background = head_with_a_brain(Vec3(0, 30, 0));
  EXPECT_THAT(doubts(seen), Contains(HasSubstr("does not lie on the brain in images.mri")));
}

TEST_F(CaseViewOf, AMissingFileIsAnError) {
  EXPECT_THAT(sentence_of(view_case(folder / "nowhere.yaml")), HasSubstr("nowhere.yaml"));
}

TEST(PlaceText, NamesTheThreeSides) {
  EXPECT_EQ(place_text(Vec3(46.2, -47.0, 9.4)), "right 46, posterior 47, superior 9 mm");
  EXPECT_EQ(place_text(Vec3(-1.0, 2.0, -3.0)), "left 1, anterior 2, inferior 3 mm");
}

TEST(DirectionText, BeginsWithTheLargestPartAndLeavesOutTheSmallest) {
  EXPECT_EQ(direction_text(Vec3(-0.2, 0.35, -0.92)), "inferior 0.92, anterior 0.35, left 0.20");
  EXPECT_EQ(direction_text(Vec3(0.0, -2.0, 0.02)), "posterior 1.00");
}

}  // namespace
}  // namespace brainshift::client
