// SPDX-License-Identifier: Apache-2.0
#include "common/configuration/key_table.hpp"

#include <gmock/gmock.h>

#include <limits>

#include "tests/support/key_documenter.hpp"

namespace brainshift {

// A table with a key of every kind.
namespace key_table_test {

struct Plane {
  double offset_mm = 1.5;
};
struct Ball {
  Vec3 centre_mm = Vec3::Zero();
};
enum class Mood { kCalm, kWild };
constexpr Word<Mood> kMoods[] = {{Mood::kCalm, "calm"}, {Mood::kWild, "wild"}};

struct Tissue {
  double stiffness_pa = 0.0;
};
struct Values {
  std::string name = "n";
  double any = 0.0, finite = 0.0, not_negative = 0.0, low = 2.0, high = 3.0;
  double like_low = 2.0;
  Vec3 towards = Vec3(0, 1, 0);
  std::vector<double> levels = {1.0, 1e6};
  Mood mood = Mood::kCalm;
  std::filesystem::path file;
  std::optional<std::filesystem::path> other;
  std::variant<Plane, Ball> shape;
  std::optional<Tissue> tumour;
  std::map<int, Tissue> regions;
};

const char* kind_name(const Plane&) { return "plane"; }
const char* kind_name(const Ball&) { return "ball"; }
template <typename A, Of<Plane> V>
void visit_kind(A& a, V& v) {
  a.section({kind_name(v), "", "A plane"}, Need::kOptional, [&] {
    a({"offset_mm", "mm", "Offset"}, v.offset_mm, between(1.0, 2.0));
  });
}
template <typename A, Of<Ball> V>
void visit_kind(A& a, V& v) {
  a.section({kind_name(v), "", "A ball"}, Need::kOptional, [&] {
    a({"centre_mm", "mm", "Centre"}, v.centre_mm, finite(), Need::kRequired);
  });
}
template <typename A, Of<Tissue> V>
void visit(A& a, V& v) {
  a({"stiffness_pa", "Pa", "Stiffness"}, v.stiffness_pa, not_negative());
}
template <typename A, Of<Values> V>
void visit(A& a, V& v) {
  a({"name", "", "A name"}, v.name, Need::kRequired);
  a.section({"numbers", "", "All numbers"}, Need::kOptional, [&] {
    a({"any", "mm", "Any number", "", "Even nan."}, v.any, unlimited());
    a({"finite"}, v.finite, finite());
    a({"not_negative", "", "Not less than nothing", "a source"}, v.not_negative, not_negative());
    a({"low", "", "The lower one"}, v.low, between(1e-7, v.high, "high"));
    a({"like_low", "", "As low"}, v.like_low, between(0.0, 10.0), SameAs{v.low, "low"});
    a({"towards", "", "A direction"}, v.towards, direction());
    a({"levels", "mm", "Levels"}, v.levels, between(0.5, 1e7));
  });
  a({"mood", "", "A mood"}, v.mood, kMoods);
  a({"file", "", "A file"}, v.file);
  a({"other", "", "Another file"}, v.other);
  a.one_of({"shape", "", "A shape"}, Need::kRequired, v.shape);
  a.section_if({"tumour", "", "A tumour"}, v.tumour, Tissue{7.0});
  a.sections({"regions", "", "Regions"}, v.regions, Tissue{7.0});
}

}  // namespace key_table_test

namespace {

using key_table_test::Ball;
using key_table_test::Plane;
using key_table_test::Tissue;
using key_table_test::Values;
using testing::ElementsAre;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::string problem_of(const Values& values) {
  KeyChecker checker;
  visit(checker, values);
  return checker.status() ? "none" : checker.status().error().message;
}

template <typename Change>
std::string problem_after(Change change) {
  Values values;
  change(values);
  return problem_of(values);
}

TEST(KeyChecker, DefaultsAreValidAndAnyNumberMayBeAnything) {
  EXPECT_EQ(problem_of({}), "none");
  EXPECT_EQ(problem_after([](Values& v) { v.any = kNan; }), "none");
}

TEST(KeyChecker, NamesKeyValueAndConstraint) {
  EXPECT_EQ(problem_after([](Values& v) { v.name.clear(); }), "name: must not be empty");
  EXPECT_EQ(problem_after([](Values& v) { v.finite = 1.0 / 0.0; }),
            "numbers.finite = inf: must be finite");
  EXPECT_EQ(problem_after([](Values& v) { v.not_negative = -0.5; }),
            "numbers.not_negative = -0.5: must be finite and >= 0");
  EXPECT_EQ(problem_after([](Values& v) { v.low = 3.5; }),
            "numbers.low = 3.5: must be between 1e-07 and 3");
  EXPECT_EQ(problem_after([](Values& v) { v.low = kNan; }),
            "numbers.low = nan: must be between 1e-07 and 3");
  EXPECT_EQ(problem_after([](Values& v) { v.like_low = 11.0; }),
            "numbers.like_low = 11: must be between 0 and 10");
  EXPECT_EQ(problem_after([](Values& v) { v.towards.setZero(); }),
            "numbers.towards length = 0: must be > 0");
  EXPECT_EQ(problem_after([](Values& v) { v.towards.y() = kNan; }),
            "numbers.towards[1] = nan: must be finite");
  EXPECT_EQ(problem_after([](Values& v) { v.levels.push_back(0.0); }),
            "numbers.levels[2] = 0: must be between 0.5 and 1e+07");
  EXPECT_EQ(problem_after([](Values& v) { v.shape = Plane{0.0}; }),
            "shape.plane.offset_mm = 0: must be between 1 and 2");
  EXPECT_EQ(problem_after([](Values& v) { v.shape = Ball{Vec3(0, 0, kNan)}; }),
            "shape.ball.centre_mm[2] = nan: must be finite");
  EXPECT_EQ(problem_after([](Values& v) { v.tumour = Tissue{-1.0}; }),
            "tumour.stiffness_pa = -1: must be finite and >= 0");
  EXPECT_EQ(problem_after([](Values& v) {
              v.regions = {{2, {1.0}}, {7, {-1.0}}};
            }),
            "regions.7.stiffness_pa = -1: must be finite and >= 0");
}

TEST(KeyChecker, KeepsTheFirstProblem) {
  Values values;
  values.not_negative = -1.0;
  values.low = -1.0;
  EXPECT_EQ(problem_of(values), "numbers.not_negative = -1: must be finite and >= 0");
  KeyChecker checker;
  visit(checker, values);
  checker.require(false, "name", "must be another");
  EXPECT_EQ(checker.status().error().message, "numbers.not_negative = -1: must be finite and >= 0");
}

TEST(KeyChecker, TakesRulesAboutSeveralKeys) {
  KeyChecker checker;
  checker.require(true, "a", "must be b");
  EXPECT_TRUE(checker.status());
  checker.require(false, "a", "must be b");
  EXPECT_EQ(checker.status().error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(checker.status().error().message, "a: must be b");
}

TEST(KeyDocumenter, SaysMeaningUnitDefaultSourceRangeAndNote) {
  KeyDocumenter documenter;
  const Values values;
  visit(documenter, values);
  std::vector<std::string> lines;
  for (const KeyDocument& document : documenter.documents()) {
    lines.push_back(document.key + " | " + document.text);
  }
  EXPECT_THAT(
      lines,
      ElementsAre(
          "name | A name. No default; not empty.", "numbers | All numbers.",
          "numbers.any | Any number, mm. Default 0. Even nan.", "numbers.finite |  Default 0.",
          "numbers.not_negative | Not less than nothing. Default 0 (a source); at least 0.",
          "numbers.low | The lower one. Default 2; range 1e-7 to high.",
          "numbers.like_low | As low. Default low; range 0 to 10.",
          "numbers.towards | A direction. Default [0, 1, 0]; any length but 0.",
          "numbers.levels | Levels, mm. Default [1, 1e6]; each 0.5 to 1e7.",
          "mood | A mood. Default calm; one of calm, wild.", "file | A file. Default none.",
          "other | Another file. Default none.", "shape | A shape.", "shape.plane | A plane.",
          "shape.plane.offset_mm | Offset, mm. Default 1.5; range 1 to 2.", "shape.ball | A ball.",
          "shape.ball.centre_mm | Centre, mm. No default.", "tumour | A tumour.",
          "tumour.stiffness_pa | Stiffness, Pa. Default 7; at least 0.", "regions | Regions."));
}

TEST(WordOf, IsTheWordOfTheValue) {
  using key_table_test::kMoods;
  using key_table_test::Mood;
  EXPECT_STREQ(word_of(Mood::kWild, kMoods), "wild");
  EXPECT_STREQ(word_of(static_cast<Mood>(9), kMoods), "");
}

}  // namespace
}  // namespace brainshift
