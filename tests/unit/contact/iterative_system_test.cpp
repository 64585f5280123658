// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/contact/iterative_system.hpp"

#include <limits>

#include "common/contact/woodbury_system.hpp"
#include "common/inversion/descent/descents.hpp"
#include "common/inversion/inverter.hpp"
#include "tests/unit/inversion/toy_inversion.hpp"

namespace brainshift::contact {
namespace {

using inversion::patient;
using inversion::prepare;
using inversion::sagging_data;

Points load() {
  std::srand(3);
  return Points::Random(3, patient()->mesh.num_nodes());
}

// The stop rule asks for a residual of 1e-8 of the cold start's. A guess that is wrong by 1e-4
// has half of the digits already, so about half of the iterations remain. One that is wrong by
// its own size saves nothing and must not spoil the answer.
TEST(IterativeSystem, AGoodFirstGuessSavesIterations) {
  const inversion::PreparedModel model = prepare(Boundary::kContact);
  const auto system = IterativeSystem::build(model.forward());
  ASSERT_TRUE(system.has_value());
  const Points f = load();
  const auto solve_from = [&](Points& u) {
    const int before = (*system)->iterations();
    EXPECT_TRUE((*system)->solve(f, u).has_value());
    return (*system)->iterations() - before;
  };
  Points exact;
  const int cold = solve_from(exact);
  ASSERT_GT(cold, 10);
  Points same = exact;
  EXPECT_EQ(solve_from(same), 0);
  Points near = 1.0001 * exact;
  const int warm = solve_from(near);
  EXPECT_GT(warm, 0);
  EXPECT_LE(warm, 3 * cold / 4);
  Points far = 2.0 * exact;
  solve_from(far);
  // A residual of 1e-8 times the condition of the toy's stiffness, about 1e2.
  for (const Points& u : {near, far}) EXPECT_LT((u - exact).norm(), 1e-6 * exact.norm());
}

TEST(IterativeSystem, ReportsTheLimitThatStopsIt) {
  const inversion::PreparedModel model = prepare(Boundary::kContact);
  const auto system =
      IterativeSystem::build(model.forward(), {.tolerance = 1e-8, .max_iterations = 3});
  ASSERT_TRUE(system.has_value());
  Points u;
  const Status status = (*system)->solve(load(), u);
  ASSERT_FALSE(status.has_value());
  EXPECT_EQ(status.error().code, ErrorCode::kNotConverged);
  EXPECT_NE(status.error().message.find("after 3 iterations"), std::string::npos)
      << status.error().message;
}

TEST(IterativeSystem, RejectsALoadThatIsNotFinite) {
  const inversion::PreparedModel model = prepare(Boundary::kContact);
  const auto system =
      IterativeSystem::build(model.forward(), {.tolerance = 1e-8, .max_iterations = 50});
  ASSERT_TRUE(system.has_value());
  Points f = load();
  f(0, 3) = std::numeric_limits<double>::quiet_NaN();
  Points u;
  EXPECT_FALSE((*system)->solve(f, u).has_value());
}

// 1e-3 mm: a two-hundredth of the data's standard deviation.
TEST(IterativeSystem, GivesTheEstimateOfDirectSolves) {
  for (Boundary boundary : {Boundary::kContact, Boundary::kFixed}) {
    const inversion::PreparedModel model = prepare(boundary);
    const SparseData data = sagging_data(model, 0.3);
    WoodburySystem woodbury(model.forward());
    const auto direct = inversion::conjugate_gradients(model, data, {}, woodbury);
    const auto iterative = inversion::invert(model, data, Method::kIterativeSolver);
    ASSERT_TRUE(direct.has_value() && iterative.has_value());
    ASSERT_GT(direct->displacement.cwiseAbs().maxCoeff(), 1.0);
    EXPECT_LT((iterative->displacement - direct->displacement).colwise().norm().maxCoeff(), 1e-3);
    EXPECT_EQ(iterative->active_slaves, direct->active_slaves);
  }
}

}  // namespace
}  // namespace brainshift::contact
