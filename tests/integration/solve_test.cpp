// SPDX-License-Identifier: GPL-3.0-or-later
// `brainshift solve` as a user runs it: the worked examples of docs/solve.md against their closed
// forms, and every bad problem file refused with one line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/integration/process.hpp"
#include "tests/integration/workspace.hpp"

namespace brainshift::integration {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::SizeIs;
using testing::StartsWith;

std::string content_of(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::string example(const std::string& name) { return examples_folder() + "/" + name; }

// name -> x, y, z, ux, uy, uz, contact pressure; with time steps also
// time and pore pressure, step after step
std::map<std::string, std::vector<double>> probes_of(const std::string& csv) {
  std::map<std::string, std::vector<double>> probes;
  const auto rows = lines(content_of(csv));
  const std::string heading = "name,x_mm,y_mm,z_mm,ux_mm,uy_mm,uz_mm,contact_pressure_pa";
  EXPECT_THAT(rows.at(0), testing::AnyOf(heading, heading + ",time_s,pore_pressure_pa"));
  for (std::size_t i = 1; i < rows.size(); ++i) {
    std::istringstream row(rows[i]);
    std::string name, cell;
    std::getline(row, name, ',');
    while (std::getline(row, cell, ',')) probes[name].push_back(std::stod(cell));
  }
  return probes;
}

struct Solved {
  std::map<std::string, std::vector<double>> probes;
  nlohmann::json summary;
  std::string err, vtu;
};

Solved solve(const std::string& problem) {
  const Workspace files;
  const Finished finished = run({brainshift(), "solve", "--problem", problem, "--out",
                                 files.path("u.vtu"), "--probes", files.path("p.csv"), "--json"});
  EXPECT_EQ(finished.exit_status, 0) << finished.err;
  if (finished.exit_status != 0) return {};
  return {probes_of(files.path("p.csv")), nlohmann::json::parse(finished.out), finished.err,
          content_of(files.path("u.vtu"))};
}

// Displacement component `axis` of a probe.
double u(const Solved& solved, const std::string& probe, int axis) {
  return solved.probes.at(probe).at(3 + static_cast<std::size_t>(axis));
}

void expect_within(double value, double exact, double percent) {
  EXPECT_NEAR(value, exact, std::abs(exact) * percent / 100.0);
}

TEST(SolveExamples, ThickSphereExpandsAsLamesFormula) {
  const Solved solved = solve(example("thick_sphere.yaml"));
  expect_within(u(solved, "inner", 0), 0.285705, 3.0);
  expect_within(u(solved, "outer", 2), 0.0714429, 3.0);
  EXPECT_TRUE(solved.summary["warnings"].empty());
  EXPECT_GT(solved.summary["min_jacobian"], 0.9);
}

TEST(SolveExamples, SignoriniBlockIsCompressedUniformly) {
  const Solved solved = solve(example("signorini_block.yaml"));
  expect_within(u(solved, "bottom", 2), -0.5, 1.0);
  expect_within(solved.probes.at("bottom").at(6), 150.0, 1.0);
  expect_within(u(solved, "side", 0), 0.15, 1.0);
  expect_within(solved.summary["contact"][0]["force_n"][2], 0.015, 1.0);
  EXPECT_THAT(solved.vtu,
              AllOf(HasSubstr("\"displacement\""), HasSubstr("\"stress_pa\""),
                    HasSubstr("\"von_mises_pa\""), HasSubstr("\"contact_pressure_pa\"")));
}

TEST(SolveExamples, LayeredColumnSagsAsTheOneDimensionalSolution) {
  const Solved solved = solve(example("layered_column.yaml"));
  expect_within(u(solved, "interface", 2), -2.280046125, 1e-6);
  expect_within(u(solved, "top", 2), -4.486542375, 1e-6);
}

// p = q sum 4 / ((2m+1) pi) sin(...) exp(...) and its settlement at T = 0.5
// (tests/verification/consolidation_test.cpp); 8 elements over the height.
TEST(SolveExamples, ConsolidatingColumnFollowsTerzaghi) {
  const Solved solved = solve(example("consolidating_column.yaml"));
  constexpr std::size_t kRow = 9, kSteps = 40;
  const std::vector<double>& bottom = solved.probes.at("bottom");
  const std::vector<double>& top = solved.probes.at("top");
  ASSERT_EQ(bottom.size(), kRow * kSteps);
  expect_within(bottom[kRow - 1], 100.0, 3.0);  // at first the fluid carries the load
  EXPECT_NEAR(bottom[bottom.size() - 2], 6.0, 1e-9);
  expect_within(bottom.back(), 37.08, 3.0);
  EXPECT_EQ(top.back(), 0.0);
  expect_within(top[top.size() - kRow + 5], -1.528, 2.0);
  EXPECT_EQ(solved.summary["element"], "p1");
  EXPECT_NEAR(solved.summary["probes"][0]["pore_pressure_pa"], bottom.back(), 1e-6);
  EXPECT_THAT(solved.vtu, HasSubstr("\"pore_pressure_pa\""));
}

// ---------- bad problem files ----------

std::string good_problem() {
  return "mesh:\n  file: " + example("signorini_block.msh") +
         "\n  element: p2\n"
         "materials:\n  tissue:\n    youngs_modulus_pa: 3000.0\n    poisson_ratio: 0.3\n"
         "regions:\n  block: tissue\n"
         "conditions:\n  held:\n    on: bottom\n    displacement_mm: [0, 0, 0]\n"
         "  push:\n    on: top\n    pressure_pa: 10.0\n"
         "probes:\n  middle: [5, 5, 5]\n";
}

struct BadProblem {
  const char* name;
  std::string from, to;  // replaced in the good problem
  std::string says;      // the key
};

void PrintTo(const BadProblem& bad, std::ostream* stream) { *stream << bad.name; }

class BadProblemFile : public testing::TestWithParam<BadProblem> {};

TEST_P(BadProblemFile, ExitsTwoWithOneLineThatNamesTheKey) {
  const Workspace files;
  std::string text = good_problem();
  const std::size_t at = text.find(GetParam().from);
  ASSERT_NE(at, std::string::npos);
  text.replace(at, GetParam().from.size(), GetParam().to);
  files.write("no_mesh.msh", "not a mesh");
  files.write("floor.stl", "not a surface");
  const auto problem = files.write("bad.yaml", text);
  std::filesystem::create_directory(files.path("out"));
  const Finished finished =
      run({brainshift(), "solve", "--problem", problem, "--out", files.path("out/u.vtu")});
  EXPECT_EQ(finished.exit_status, 2);
  const auto told = lines(finished.err);
  ASSERT_THAT(told, SizeIs(1)) << finished.err;
  EXPECT_THAT(told[0], StartsWith("brainshift: "));
  EXPECT_THAT(told[0], HasSubstr("bad.yaml"));
  EXPECT_THAT(told[0], HasSubstr(GetParam().says));
  EXPECT_TRUE(std::filesystem::is_empty(files.path("out"))) << "something half-written was left";
}

INSTANTIATE_TEST_SUITE_P(
    Table, BadProblemFile,
    testing::Values(
        BadProblem{"UnknownGroup", "on: top", "on: lid", "conditions.push.on = lid"},
        BadProblem{"UnknownRegion", "block: tissue", "brain: tissue", "regions.brain"},
        BadProblem{"RegionWithoutMaterial", "  block: tissue\n", "  {}\n", "regions"},
        BadProblem{"MissingMaterial", "block: tissue", "block: bone", "regions.block = bone"},
        BadProblem{"NegativeModulus", "3000.0", "-3000.0", "materials.tissue.youngs_modulus_pa"},
        BadProblem{"TwoModuli", "poisson_ratio: 0.3",
                   "poisson_ratio: 0.3\n    shear_modulus_pa: 1.0",
                   "materials.tissue.youngs_modulus_pa"},
        BadProblem{"Incompressible", "0.3", "0.5", "materials.tissue.poisson_ratio = 0.5"},
        BadProblem{"NearlyIncompressible", "0.3", "0.49995", "materials.tissue.poisson_ratio"},
        BadProblem{"NoSupport", "displacement_mm: [0, 0, 0]", "displacement_z_mm: 0.0",
                   "conditions: the body is not held: 3 of its 6 rigid motions are free"},
        BadProblem{"NothingHeld", "  held:\n    on: bottom\n    displacement_mm: [0, 0, 0]\n", "",
                   "conditions: the body is not held: 6 of its 6"},
        BadProblem{"WrongElement", "element: p2", "element: hex8", "mesh.element = hex8"},
        BadProblem{"UnknownKey", "pressure_pa", "presure_pa", "conditions.push.presure_pa"},
        BadProblem{"UnknownSection", "probes:", "probe:", "probe"},
        BadProblem{"TwoKinds", "pressure_pa: 10.0", "pressure_pa: 10.0\n    displacement_x_mm: 1.0",
                   "conditions.push"},
        BadProblem{"MissingMesh", "signorini_block.msh", "none.msh", "mesh.file"},
        BadProblem{"UnreadableMesh", example("signorini_block.msh"), "no_mesh.msh", "mesh.file"},
        BadProblem{"NotFinite", "pressure_pa: 10.0", "pressure_pa: .nan",
                   "conditions.push.pressure_pa"},
        BadProblem{"ProbeOutside", "[5, 5, 5]", "[5, 5, 15]", "probes.middle"},
        BadProblem{"Contradiction", "pressure_pa: 10.0",
                   "displacement_mm: [0, 0, 1]\n  again:\n    on: top\n    displacement_z_mm: 2.0",
                   "conditions.again prescribes 2 mm"},
        BadProblem{"EmptySelector", "probes:",
                   "groups:\n  far:\n    box: {min_mm: [90, 0, 0], max_mm: [91, 1, 1]}\nprobes:",
                   "groups.far"},
        BadProblem{"GroupNamedTwice", "probes:",
                   "groups:\n  top:\n    box: {min_mm: [0, 0, 0], max_mm: [9, 9, 9]}\nprobes:",
                   "groups.top"},
        BadProblem{"ObstacleThatIsNone",
                   "probes:", "contact:\n  floor: {on: bottom, surface: floor.stl}\nprobes:",
                   "contact.floor.surface"},
        BadProblem{"NegativeRadius", "probes:",
                   "contact:\n  ball:\n    on: bottom\n    sphere: {centre_mm: [0, 0, -9], "
                   "radius_mm: -1}\nprobes:",
                   "contact.ball.sphere.radius_mm"},
        BadProblem{"TimeStepsWithQuadraticElements",
                   "probes:", "time:\n  steps_s: [0.1, 0.2]\nprobes:", "mesh.element = p2"},
        BadProblem{"ContactWithTimeSteps", "element: p2",
                   "element: p1\ntime: {steps_s: [1.0]}\ncontact:\n  floor:\n    on: bottom\n    "
                   "plane: {point_mm: [0, 0, 0], normal: [0, 0, 1]}",
                   "contact.floor"},
        BadProblem{"NegativeTimeStep",
                   "probes:", "time:\n  steps_s: [0.1, -0.2]\nprobes:", "time.steps_s"},
        BadProblem{"PorePressure", "pressure_pa: 10.0", "pore_pressure_pa: 10.0",
                   "conditions.push.pore_pressure_pa"}),
    [](const auto& row) { return std::string(row.param.name); });

TEST(GoodProblemFile, TheTableStartsFromOneThatSolves) {
  const Workspace files;
  const Solved solved = solve(files.write("good.yaml", good_problem()));
  EXPECT_LT(u(solved, "middle", 2), 0.0);
  EXPECT_EQ(solved.err, "");
}

TEST(GoodProblemFile, LinearElementsThatLockAreFlagged) {
  const Workspace files;
  std::string text = good_problem();
  text.replace(text.find("p2"), 2, "p1");
  text.replace(text.find("0.3"), 3, "0.49");
  const Solved solved = solve(files.write("locks.yaml", text));
  ASSERT_EQ(solved.summary["warnings"].size(), 1U);
  EXPECT_THAT(solved.summary["warnings"][0].get<std::string>(), HasSubstr("locks"));
  EXPECT_THAT(solved.err, HasSubstr("warning: element p1 locks"));
}

TEST(SolveUsage, HelpTeachesAndMissingOptionsAreNamed) {
  const Finished help = run({brainshift(), "solve", "--help"});
  EXPECT_EQ(help.exit_status, 0);
  EXPECT_THAT(help.out, AllOf(HasSubstr("--problem"), HasSubstr("Examples:")));
  const Finished bare = run({brainshift(), "solve", "--problem", "p.yaml"});
  EXPECT_EQ(bare.exit_status, 2);
  EXPECT_THAT(bare.err, HasSubstr("--out"));
}

}  // namespace
}  // namespace brainshift::integration
