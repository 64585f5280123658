// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/evidence/calculix_truth.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "client/tools/twin/scenario.hpp"
#include "common/core/random.hpp"
#include "tests/evidence/evidence_truths.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::evidence {
namespace {

class Fields : public testing::Test {
 protected:
  void SetUp() override {
    Random random(3);
    for (double& x : nodes_.reshaped()) x = 100.0 * (random.uniform() - 0.5);
    u_ = 0.01 * nodes_;
    ASSERT_TRUE(write_points(nodes_, folder_.path() / "nodes.csv"));
    ASSERT_TRUE(write_points(u_, folder_.path() / "patient-3.csv"));
  }
  Points nodes_ = Points(3, 20), u_;
  test_support::TemporaryFolder folder_;
};

TEST_F(Fields, ComeBackToAHundredthOfAMicrometre) {
  const auto u = read_calculix_truth(folder_.path(), 3, nodes_);
  ASSERT_TRUE(u) << u.error().message;
  EXPECT_LE((*u - u_).cwiseAbs().maxCoeff(), 0.5001e-5);
}

TEST_F(Fields, OfAnotherMeshAreRefused) {
  Points other = nodes_;
  other(0, 5) += 0.01;
  EXPECT_EQ(read_calculix_truth(folder_.path(), 3, other).error().code,
            ErrorCode::kInvalidArgument);
  EXPECT_EQ(read_calculix_truth(folder_.path(), 3, nodes_.leftCols(19)).error().code,
            ErrorCode::kInvalidArgument);
  EXPECT_EQ(read_calculix_truth(folder_.path(), 4, nodes_).error().code, ErrorCode::kNotFound);
  ASSERT_TRUE(write_points(u_.leftCols(19), folder_.path() / "patient-3.csv"));
  EXPECT_EQ(read_calculix_truth(folder_.path(), 3, nodes_).error().code,
            ErrorCode::kInvalidArgument);
}

TEST_F(Fields, ABrokenLineIsNamed) {
  for (const char* line : {"1,2\n", "1,2,x\n", "1,2,3,4\n", "1,2,nan\n"}) {
    std::ofstream(folder_.path() / "patient-3.csv") << "1,2,3\n" << line;
    const auto u = read_calculix_truth(folder_.path(), 3, nodes_);
    ASSERT_FALSE(u) << line;
    EXPECT_NE(u.error().message.find("patient-3.csv:2"), std::string::npos) << u.error().message;
  }
}

TEST(ShippedFields, AreOfEveryPatientAndMoveItsTumourAsTheTwinDoes) {
  const auto folder = std::filesystem::path(BRAINSHIFT_SOURCE_DIR) / "tests/evidence/calculix";
  const auto nodes = read_points(folder / "nodes.csv");
  ASSERT_TRUE(nodes) << nodes.error().message;
  for (int patient = 1; patient <= kPatients; ++patient) {
    const auto u = read_calculix_truth(folder, patient, *nodes);
    ASSERT_TRUE(u) << u.error().message;
    const double most = u->colwise().norm().maxCoeff();
    const client::Scenario* twin = client::find_scenario("patient-" + std::to_string(patient));
    ASSERT_NE(twin, nullptr);
    const double misfit = twin->tumour_displacement_mm.value();  // Table 3's
    EXPECT_GT(most, 0.8 * misfit) << patient;
    EXPECT_LT(most, 3.0 * misfit) << patient;
  }
}

TEST(GivenTruth, CountsTheSlavesInTheSkull) {
  std::vector<contact::ContactPair> pairs(2);
  pairs[0].slave = 0;
  pairs[1].slave = 1;
  for (contact::ContactPair& pair : pairs) {
    pair.normal = Vec3(0, 0, -1);  // out of the skull
    pair.initial_penetration_mm = -1.0;
  }
  Points u = Points::Zero(3, 2);
  u(2, 0) = 1.5;
  GivenTruth truth(u, contact::PenaltyContact(pairs, 5.0));
  const auto solved = truth.solve(Points::Zero(3, 2));
  ASSERT_TRUE(solved);
  EXPECT_EQ(solved->displacement, u);
  EXPECT_EQ(solved->active, 1);
  EXPECT_NEAR(solved->max_penetration_mm, 0.5, 1e-12);
}

}  // namespace
}  // namespace brainshift::evidence
