// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "client/tools/twin/scenario.hpp"
#include "common/contact/forward_model.hpp"
#include "common/core/random.hpp"
#include "tests/evidence/calculix.hpp"
#include "tests/evidence/patient_twin.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::evidence {
namespace {

// Lines of an include by the keyword line above them, as numbers and words.
using Cells = std::vector<std::string>;
std::map<std::string, std::vector<Cells>> blocks_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::map<std::string, std::vector<Cells>> blocks;
  std::string key;
  for (std::string line; std::getline(in, line);) {
    if (line.rfind('*', 0) == 0) {
      key = line;
      continue;
    }
    Cells cells;
    std::istringstream stream(line);
    for (std::string cell; std::getline(stream, cell, ',');) {
      const auto first = cell.find_first_not_of(' ');
      cells.push_back(first == std::string::npos ? "" : cell.substr(first));
    }
    blocks[key].push_back(cells);
  }
  return blocks;
}

class Deck : public testing::Test {
 protected:
  Deck() {
    load_ = Points::Zero(3, model_.mesh.num_nodes());
    load_(2, 7) = -0.25;
    load_(0, 0) = 1e-3;
    brain_ = std::make_unique<client::TruthBrain>(value_or_fail(
        client::truth_brain(model_, config_, *client::find_scenario("paper-icp"), 1)));
    auto forward = value_or_fail(client::truth_forward(*brain_));
    forward_ = std::make_unique<contact::ForwardModel>(std::move(forward));
    write(Tissue::kNeoHookean);
  }
  void write(Tissue tissue) {
    VecX strain = VecX::Zero(load_.cols());
    strain[4] = 0.331;
    const Status ok =
        write_deck(*brain_, forward_->contact(), {load_, strain}, folder_.path(), tissue);
    EXPECT_TRUE(ok) << ok.error().message;
  }
  auto blocks(const char* file) const { return blocks_of(folder_.path() / file); }

  BrainModel model_ = test_support::toy_patient(4);
  CaseConfig config_ = test_support::toy_config();
  Points load_;
  std::unique_ptr<client::TruthBrain> brain_;
  std::unique_ptr<contact::ForwardModel> forward_;
  test_support::TemporaryFolder folder_;
};

TEST_F(Deck, HasTheMeshOfTheCase) {
  const auto mesh = blocks("mesh.inp");
  const auto& nodes = mesh.at("*NODE, NSET=NBRAIN");
  ASSERT_EQ(nodes.size(), static_cast<std::size_t>(model_.mesh.num_nodes()));
  EXPECT_EQ(nodes[3][0], "4");
  EXPECT_NEAR(std::stod(nodes[3][2]), model_.mesh.nodes(1, 3), 1e-6);
  std::size_t tets = 0;
  for (const auto& [key, lines] : mesh) {
    if (key.rfind("*ELEMENT, TYPE=C3D4", 0) == 0) tets += lines.size();
  }
  EXPECT_EQ(tets, static_cast<std::size_t>(model_.mesh.num_tets()));
}

// Clearance, direction to the skull and penalty of every pair; its node of the skull does not move.
TEST_F(Deck, HasAGapElementForEverySlave) {
  const auto gaps = blocks("contact.inp");
  const auto& pairs = forward_->contact().pairs();
  ASSERT_GT(pairs.size(), 0u);
  ASSERT_EQ(gaps.at("*NODE, NSET=NSKULL").size(), pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Cells& element = gaps.at("*ELEMENT, TYPE=GAPUNI, ELSET=GAP" + std::to_string(i))[0];
    EXPECT_EQ(std::stoi(element[1]), pairs[i].slave + 1);
    EXPECT_EQ(element[2], gaps.at("*NODE, NSET=NSKULL")[i][0]);
    const Cells& gap = gaps.at("*GAP, ELSET=GAP" + std::to_string(i))[0];
    ASSERT_EQ(gap.size(), 6u);
    EXPECT_NEAR(std::stod(gap[0]), -pairs[i].initial_penetration_mm, 1e-8);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(std::stod(gap[static_cast<std::size_t>(1 + axis)]), -pairs[i].normal[axis],
                  1e-11);
    }
    EXPECT_EQ(gap[4], "");
    EXPECT_DOUBLE_EQ(std::stod(gap[5]), config_.contact.penalty_n_per_mm);
  }
}

TEST_F(Deck, HasTheForcesAndTheModuliOfTheCase) {
  const auto load = blocks_of(folder_.path() / "load.inp");
  ASSERT_EQ(load.at("").size(), 2u);  // zeros are left out
  EXPECT_EQ(load.at("")[0], (Cells{"1", "1", "0.001"}));
  EXPECT_EQ(load.at("")[1], (Cells{"8", "3", "-0.25"}));
  const auto tissue = value_or_fail(contact::tissue_map(model_, config_.material));
  const auto written = blocks("tissue.inp").at("*HYPERELASTIC, NEO HOOKE");
  ASSERT_EQ(written.size(), tissue.materials.size());
  const fem::Elasticity& elastic = tissue.materials[0].elastic;
  EXPECT_NEAR(2.0 * std::stod(written[0][0]), elastic.shear, 1e-9 * elastic.shear);
  const double bulk = elastic.lambda + 2.0 * elastic.shear / 3.0;
  EXPECT_NEAR(2.0 / std::stod(written[0][1]), bulk, 1e-9 * bulk);
}

TEST_F(Deck, HasYoungsModulusAndPoissonsRatioOfLinearTissue) {
  write(Tissue::kLinear);
  const auto tissue = blocks("tissue.inp");
  EXPECT_EQ(tissue.count("*HYPERELASTIC, NEO HOOKE"), 0u);
  const Cells& written = tissue.at("*ELASTIC")[0];
  const Material& material = config_.material;
  EXPECT_NEAR(std::stod(written[0]),
              2e-6 * material.shear_modulus_pa * (1.0 + material.poisson_ratio), 1e-12);
  EXPECT_NEAR(std::stod(written[1]), material.poisson_ratio, 1e-9);
}

// 1.1^3 = 1.331. A temperature of 1 stretches tissue by its own length.
TEST_F(Deck, StretchesSwellingTissueByTheCubeRootOfItsVolume) {
  EXPECT_EQ(blocks("tissue.inp").at("*EXPANSION")[0][0], "1.0");
  const auto swelling = blocks("swelling.inp");
  ASSERT_EQ(swelling.at("").size(), static_cast<std::size_t>(model_.mesh.num_nodes()));
  EXPECT_EQ(swelling.at("")[4][0], "5");
  EXPECT_NEAR(std::stod(swelling.at("")[4][1]), 0.1, 1e-9);
  EXPECT_EQ(std::stod(swelling.at("")[5][1]), 0.0);
}

TEST_F(Deck, HoldsFixedNodesAlongTheirNormals) {
  const auto held = blocks("held.inp");
  if (model_.fixed.empty()) {
    EXPECT_TRUE(held.empty());
    return;
  }
  const auto& lines = held.at("*EQUATION");
  ASSERT_EQ(lines.size(), 2 * model_.fixed.size());
  for (std::size_t i = 1; i < lines.size(); i += 2) {
    double squares = 0.0;
    for (const std::size_t k : {2u, 5u, 8u}) squares += std::pow(std::stod(lines[i][k]), 2);
    EXPECT_NEAR(squares, 1.0, 1e-12);
    EXPECT_GE(std::abs(std::stod(lines[i][2])), std::abs(std::stod(lines[i][5])));
  }
}

class Printed : public testing::Test {
 protected:
  Result<Points> read(const std::string& text) {
    const auto file = folder_.path() / "patient.dat";
    std::ofstream(file) << text;
    return read_printed_displacements(file, 2);
  }
  test_support::TemporaryFolder folder_;
};

TEST_F(Printed, TheLastDisplacementsCount) {
  const auto u = value_or_fail(
      read("\n displacements (vx,vy,vz) for set NBRAIN and time  0.5000000E+00\n\n"
           "         1  1.0E+00  1.0E+00  1.0E+00\n         2  1.0E+00  1.0E+00  1.0E+00\n"
           "\n displacements (vx,vy,vz) for set NBRAIN and time  0.1000000E+01\n\n"
           "         1  1.5E-01 -2.0E+00  0.0E+00\n         2  3.0E+00  4.0E+00  5.0E+00\n"));
  EXPECT_EQ(Vec3(u.col(0)), Vec3(0.15, -2.0, 0.0));
  EXPECT_EQ(Vec3(u.col(1)), Vec3(3.0, 4.0, 5.0));
}

TEST_F(Printed, WhatIsMissingOrBrokenIsAnError) {
  EXPECT_EQ(read("nothing\n").error().code, ErrorCode::kNotFound);
  EXPECT_THAT(sentence_of(read(" displacements\n 1 1 2 3\n")),
              testing::HasSubstr("1 of 2 nodes are missing"));
  for (const char* line : {" 1 1 2\n", " 3 1 2 3\n", " 0 1 2 3\n"}) {
    EXPECT_THAT(sentence_of(read(std::string(" displacements\n") + line)),
                testing::HasSubstr("patient.dat:2"))
        << line;
  }
  EXPECT_EQ(read_printed_displacements(folder_.path() / "none.dat", 2).error().code,
            ErrorCode::kNotFound);
}

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
  const auto u = value_or_fail(read_calculix_truth(folder_.path(), 3, nodes_));
  EXPECT_LE((u - u_).cwiseAbs().maxCoeff(), 0.5001e-5);
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
    EXPECT_THAT(sentence_of(read_calculix_truth(folder_.path(), 3, nodes_)),
                testing::HasSubstr("patient-3.csv:2"))
        << line;
  }
}

TEST(ShippedFields, AreOfEveryPatientAndMoveItsTumourAsTheTwinDoes) {
  const auto folder = std::filesystem::path(BRAINSHIFT_SOURCE_DIR) / "tests/evidence/calculix";
  const auto nodes = value_or_fail(read_points(folder / "nodes.csv"));
  for (int patient = 1; patient <= kPatients; ++patient) {
    const auto u = value_or_fail(read_calculix_truth(folder, patient, nodes));
    const double most = u.colwise().norm().maxCoeff();
    const client::Scenario* twin = client::find_scenario("patient-" + std::to_string(patient));
    ASSERT_NE(twin, nullptr);
    const double misfit = twin->tumour_displacement_mm.value();  // Table 3's
    EXPECT_GT(most, 0.8 * misfit) << patient;
    EXPECT_LT(most, 3.0 * misfit) << patient;
  }
}

}  // namespace

}  // namespace brainshift::evidence
