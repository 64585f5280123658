// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/ablations/ablation_truths.hpp"

#include <algorithm>
#include <array>

#include "client/twin/variation.hpp"
#include "tests/evidence/paper_tables.hpp"

namespace brainshift::ablations {
namespace {

static_assert(kPatients == evidence::paper::kPatients);

constexpr std::array kMotions = {"joint-tangential", "joint-mixed", "joint-distension",
                                 "resection"};

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

std::string group_of(const std::string& truth) {
  if (truth == "all") return "all ingredients";
  return evidence::is_adverse_alone(truth) ? "one ingredient" : truth;
}

const std::vector<std::string>& group_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all = {kEverything};
    for (const std::string& truth : truth_names()) {
      const std::string group = group_of(truth);
      if (std::find(all.begin(), all.end(), group) == all.end()) all.push_back(group);
    }
    return all;
  }();
  return names;
}

std::vector<AblationSurgery> surgeries_of(int patient, std::uint64_t first_seed,
                                          const std::vector<std::string>& truths) {
  const std::uint64_t seed = first_seed + static_cast<std::uint64_t>(patient - 1);
  std::vector<AblationSurgery> surgeries;
  for (const std::string& truth : truths) {
    surgeries.push_back({truth, seed});
    if (is_motion(truth)) surgeries.push_back({truth, seed + kPatients});
  }
  return surgeries;
}

Result<evidence::PlayedSurgery> play(evidence::PatientTwin& twin, const AblationSurgery& surgery) {
  if (!is_motion(surgery.truth)) {
    return twin.play(*evidence::find_truth(surgery.truth), surgery.seed);
  }
  const client::Scenario& plain = *client::find_scenario(surgery.truth);
  return twin.play(client::vary(plain, surgery.seed), surgery.seed);
}

}  // namespace brainshift::ablations
