// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/load_descent.hpp"

#include "tests/unit/inversion/condensed_fixture.hpp"

namespace brainshift::inversion {
namespace {

// A descent on the toy, as CondensedInverter drives it.
struct Descent {
  Descent(std::shared_ptr<const CondensedOperators> given,
          std::shared_ptr<const geometry::TetLocator> locator, const CaseConfig& config)
      : operators(std::move(given)),
        window{0, operators->num_modes()},
        sampled(operators, std::move(locator), window, OutsideRegion::kExtend, team),
        strengths(operators->part_columns, window, SparseData::kMaxCommonErrors, true, team),
        descent(*operators, window, config.contact.penalty_n_per_mm, true, team, profile) {
    limits.out_of_time = [] { return false; };
    limits.on_step = [] {};
  }

  // To the most probable loads under strengths that are estimated once.
  void find(const SparseData& data) {
    descent.reserve(data.size());
    sampled.reserve(data.size());
    ASSERT_TRUE(sampled.locate(data));
    sampled.sample(data, RemainderVariances::Ones(), VecX::Ones(data.size()));
    ASSERT_TRUE(descent.take(sampled));
    ASSERT_TRUE(strengths.fit(descent.posterior().gram(), descent.posterior().right_hand_side()));
    ASSERT_TRUE(descent.jump(sampled, strengths));
    ASSERT_TRUE(descent.descend(sampled, strengths, false, limits));
    ASSERT_TRUE(
        strengths.refit(descent.posterior().gram(), descent.posterior().right_hand_side(), false));
  }

  // 1/2 |R^-1/2 (d - A u)|^2 with contact as it is, for data without common errors.
  double misfit(const VecX& z) {
    const auto all = sampled.free_body();
    VecX left = all.col(window.count) - all.leftCols(window.count) * z;
    const ContactAtLoads& contact = descent.contact();
    if (contact.size() > 0) left -= sampled.contact(contact.active()) * contact.forces();
    return 0.5 * left.squaredNorm();
  }

  ThreadTeam team{1};
  std::shared_ptr<const CondensedOperators> operators;
  ModeWindow window;
  SampledOperators sampled;
  PriorStrengths strengths;
  UpdateProfile profile;
  LoadDescent descent;
  DescentLimits limits;
};

using LoadDescentTest = Condensed;

// A few nodes that move outwards, against the skull.
SparseData swelling_data(const BrainModel& brain, const std::vector<NodeIndex>& region,
                         double motion_mm, std::uint64_t seed) {
  Random random(seed);
  const Vec3 centre = brain.mesh.nodes.rowwise().mean();
  constexpr int kData = 8;
  SparseData data{Points(3, kData), Points(3, kData), VecX::Constant(kData, 0.1)};
  for (int i = 0; i < kData; ++i) {
    const auto place =
        static_cast<std::size_t>(random.uniform() * static_cast<double>(region.size()));
    const Vec3 x = brain.mesh.nodes.col(region[place]);
    data.positions.col(i) = x;
    data.displacements.col(i) = motion_mm * (x - centre).normalized() + 0.1 * random.direction();
  }
  return data;
}

TEST_F(LoadDescentTest, TheMeanOverHypothesesMissesTheDataNoMoreThanTheMostProbableLoads) {
  const auto locator = std::make_shared<const geometry::TetLocator>(patient()->mesh);
  const auto given = operators(Boundary::kContact);
  int pressed = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    Descent toy(given, locator, config());
    toy.find(swelling_data(*patient(), given->region, 0.4 * static_cast<double>(seed), seed));
    const double most_probable = toy.misfit(toy.descent.most_probable());
    ASSERT_TRUE(toy.descent.average(toy.sampled, toy.strengths));
    const double mean = toy.misfit(toy.descent.z());
    pressed = std::max(pressed, toy.descent.contact().size());
    EXPECT_LE(mean, most_probable + kLostByMean + 1e-9);
  }
  EXPECT_GT(pressed, 20) << "the test shows nothing without contact";
}

}  // namespace
}  // namespace brainshift::inversion
