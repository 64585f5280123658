// SPDX-License-Identifier: GPL-3.0-or-later
// The loop alone, with a method whose answers are written down.
#include "common/inversion/condensed/find_contact_set.hpp"

#include <gmock/gmock.h>

#include <vector>

namespace brainshift::inversion {
namespace {

using testing::ElementsAre;

// Three slaves. Slave i penetrates by its depth until it is active and then presses, but for the
// slaves of `flips`, which pull as soon as they are active.
struct ScriptedMethod {
  explicit ScriptedMethod(VecX when_open, std::vector<bool> pulling = {false, false, false})
      : depths(std::move(when_open)), flips(std::move(pulling)) {}

  Status evaluate(const contact::ActiveSet& set) {
    sets.push_back(contact::count(set));
    if (fail_at == static_cast<int>(sets.size())) {
      return fail(ErrorCode::kSingularMatrix, "scripted");
    }
    forces.setZero(3);
    depth = depths;
    for (int i = 0; i < 3; ++i) {
      if (set.empty() || !set[static_cast<std::size_t>(i)]) continue;
      forces[i] = flips[static_cast<std::size_t>(i)] ? -1.0 : 1.0;
      depth[i] = 0.0;
    }
    if (stop_after == static_cast<int>(sets.size())) source.request_stop();
    return {};
  }
  const VecX& all_forces() const { return forces; }
  const VecX& penetration() const { return depth; }
  const VecX& compliance_diagonal() const { return compliance; }
  void keep() { ++kept; }
  void leave_cycle() {
    ++cycles;
    search->pivot(forces, depth, compliance);
  }
  bool out_of_time() const { return static_cast<int>(sets.size()) == out_of_time_after; }

  Result<SearchEnd> run(int max_iterations = 20) {
    contact::SetSearch own(3, max_iterations);
    search = &own;
    return find_contact_set(own, *this, source.get_token());
  }

  VecX depths, depth, forces;
  VecX compliance = VecX::Ones(3);
  std::vector<bool> flips;
  contact::SetSearch* search = nullptr;
  std::stop_source source;
  std::vector<int> sets;  // sizes of the sets, in order
  int kept = 0, cycles = 0, fail_at = 0, stop_after = 0, out_of_time_after = 0;
};

TEST(FindContactSet, GoesOnUntilContactHolds) {
  ScriptedMethod method(VecX{{1.0, -1.0, 2.0}});
  const auto end = method.run();
  ASSERT_TRUE(end.has_value());
  EXPECT_EQ(*end, SearchEnd::kSolved);
  EXPECT_THAT(method.sets, ElementsAre(0, 2));
  EXPECT_EQ(method.kept, 1);
}

TEST(FindContactSet, LooksForAStopBeforeEverySet) {
  ScriptedMethod method(VecX{{1.0, -1.0, 2.0}});
  method.source.request_stop();
  const auto before = method.run();
  ASSERT_FALSE(before.has_value());
  EXPECT_EQ(before.error().message, "inversion was stopped at iteration 1");
  EXPECT_TRUE(method.sets.empty());

  ScriptedMethod later(VecX{{1.0, -1.0, 2.0}}, {true, false, false});
  later.stop_after = 2;
  later.out_of_time_after = 3;
  const auto during = later.run();
  ASSERT_FALSE(during.has_value());
  EXPECT_EQ(during.error().code, ErrorCode::kNotConverged);
  EXPECT_EQ(during.error().message, "inversion was stopped at iteration 3");
  EXPECT_EQ(later.sets.size(), 2u);
}

TEST(FindContactSet, EndsWithTheBestSetWhenOutOfTime) {
  ScriptedMethod method(VecX{{1.0, -1.0, 2.0}}, {true, false, false});
  method.out_of_time_after = 2;
  const auto end = method.run();
  ASSERT_TRUE(end.has_value());
  EXPECT_EQ(*end, SearchEnd::kDeadline);
  // The empty set violates contact by 2 mm, the one with both slaves by the pull of one: 1 mm.
  EXPECT_THAT(method.sets, ElementsAre(0, 2, 2));
}

TEST(FindContactSet, AsksTheMethodToLeaveACycle) {
  ScriptedMethod method(VecX{{1.0, -1.0, 2.0}}, {true, false, false});
  const auto end = method.run(8);
  ASSERT_TRUE(end.has_value());
  EXPECT_EQ(*end, SearchEnd::kExhausted);
  EXPECT_GT(method.cycles, 0);
}

TEST(FindContactSet, PassesAnErrorOfTheMethodOn) {
  ScriptedMethod method(VecX{{1.0, -1.0, 2.0}});
  method.fail_at = 2;
  const auto end = method.run();
  ASSERT_FALSE(end.has_value());
  EXPECT_EQ(end.error().code, ErrorCode::kSingularMatrix);
}

}  // namespace
}  // namespace brainshift::inversion
