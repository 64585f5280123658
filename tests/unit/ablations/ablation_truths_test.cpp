// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/ablations/ablation_patient.hpp"

#include <gmock/gmock.h>

#include <set>

#include "client/tools/twin/scenario.hpp"
#include "tests/evidence/patient_twin.hpp"

namespace brainshift::ablations {
namespace {

using testing::Contains;
using testing::Not;

TEST(AblationTruths, AreThoseOfTheEvidenceAndMotionsThatTheTwinKnows) {
  EXPECT_THAT(truth_names(), Contains("consistency"));
  EXPECT_THAT(truth_names(), Contains("all"));
  EXPECT_THAT(truth_names(), Contains("joint-mixed"));
  EXPECT_THAT(truth_names(), Not(Contains("calculix")));
  for (const std::string& name : truth_names()) {
    const bool made_here = name == "mannitol" || name == "outliers";
    EXPECT_TRUE(made_here || evidence::find_truth(name) != nullptr ||
                client::find_scenario(name) != nullptr)
        << name;
  }
}

TEST(AblationTruths, NoSeedOfAMotionIsPlayedTwice) {
  std::set<std::uint64_t> seeds;
  int motions = 0;
  for (int patient = 1; patient <= evidence::kPatients; ++patient) {
    for (const AblationSurgery& one : surgeries_of(patient, 1, {"consistency", "joint-mixed"})) {
      if (one.truth != "joint-mixed") continue;
      ++motions;
      seeds.insert(one.seed);
    }
  }
  EXPECT_EQ(motions, kSeedsPerMotion * evidence::kPatients);
  EXPECT_EQ(static_cast<int>(seeds.size()), motions);
}

}  // namespace
}  // namespace brainshift::ablations
