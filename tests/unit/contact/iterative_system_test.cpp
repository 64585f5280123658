// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/contact/iterative_system.hpp"

#include <limits>

#include "common/inversion/invert.hpp"
#include "tests/unit/inversion/toy_inversion.hpp"

namespace brainshift::contact {
namespace {

Points load() {
  std::srand(3);
  return Points::Random(3, patient()->mesh.num_nodes());
}

TEST(IterativeSystem, AGoodFirstGuessSavesIterations) {
  const inversion::PreparedModel model = prepare(Boundary::kContact);
  const auto system = IterativeSystem::build(model.forward());
  ASSERT_TRUE(system.has_value());
  Points u;
  ASSERT_TRUE((*system)->solve(load(), u).has_value());
  const int cold = (*system)->iterations();
  ASSERT_GT(cold, 5);
  ASSERT_TRUE((*system)->solve(load(), u).has_value());
  EXPECT_LE((*system)->iterations(), cold + 1);
}

TEST(IterativeSystem, SaysSoWhenTheLimitStopsIt) {
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

TEST(IterativeSystem, RefusesALoadThatIsNotFinite) {
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
    inversion::InversionOptions options;
    options.method = Method::kConjugateGradients;
    const auto direct = inversion::invert(model, data, options);
    options.method = Method::kIterativeSolver;
    const auto iterative = inversion::invert(model, data, options);
    ASSERT_TRUE(direct.has_value() && iterative.has_value());
    ASSERT_GT(direct->displacement.cwiseAbs().maxCoeff(), 1.0);
    EXPECT_LT((iterative->displacement - direct->displacement).colwise().norm().maxCoeff(), 1e-3);
    EXPECT_EQ(iterative->active_slaves, direct->active_slaves);
  }
}

}  // namespace
}  // namespace brainshift::contact
