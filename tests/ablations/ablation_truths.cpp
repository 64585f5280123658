// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/ablations/ablation_truths.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "client/tools/twin/variation.hpp"
#include "common/core/random.hpp"
#include "tests/support/gross_errors.hpp"

namespace brainshift::ablations {
namespace {

constexpr std::array kMotions = {"joint-tangential", "joint-mixed", "joint-distension", "resection",
                                 "retraction",       "mannitol",    "outliers"};

// Sag of a brain that shrinks by 2 to 4 % of its volume or, every other time, in one hemisphere.
client::Scenario mannitol(std::uint64_t seed) {
  client::Scenario scenario = client::vary(*client::find_scenario("joint-sag"), seed);
  Random random(seed);
  scenario.volume = {-kLeastShrinkage * (1.0 + random.uniform()), seed % 2 == 0};
  return scenario;
}

client::Scenario motion(const AblationSurgery& surgery) {
  if (surgery.truth == "mannitol") return mannitol(surgery.seed);
  const char* name = surgery.truth == "outliers" ? "joint-sag" : surgery.truth.c_str();
  return client::vary(*client::find_scenario(name), surgery.seed);
}

bool is_motion(const std::string& truth) {
  return std::find(kMotions.begin(), kMotions.end(), truth) != kMotions.end();
}

}  // namespace

const std::vector<std::string>& truth_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const evidence::TruthKind& kind : evidence::truth_kinds()) {
      if (!kind.calculix) all.push_back(kind.name);
    }
    all.insert(all.end(), kMotions.begin(), kMotions.end());
    return all;
  }();
  return names;
}

std::vector<AblationSurgery> surgeries_of(int patient, std::uint64_t first_seed,
                                          const std::vector<std::string>& truths) {
  const std::uint64_t seed = first_seed + static_cast<std::uint64_t>(patient - 1);
  std::vector<AblationSurgery> surgeries;
  for (const std::string& truth : truths) {
    const int seeds = is_motion(truth) ? kSeedsPerMotion : 1;
    for (int k = 0; k < seeds; ++k) {
      surgeries.push_back({truth, seed + static_cast<std::uint64_t>(k * evidence::kPatients)});
    }
  }
  return surgeries;
}

Result<evidence::PlayedSurgery> play(evidence::PatientTwin& twin, const AblationSurgery& surgery) {
  if (!is_motion(surgery.truth)) {
    return twin.play(*evidence::find_truth(surgery.truth), surgery.seed);
  }
  auto played = twin.play(motion(surgery), surgery.seed);
  if (!played || !played->surgery || surgery.truth != "outliers") return played;
  Random random(surgery.seed);
  for (Observation& one : played->surgery->observations) {
    one = test_support::with_gross_errors(std::move(one), kOutliers, random);
  }
  return played;
}

}  // namespace brainshift::ablations
