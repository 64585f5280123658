// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/twin/scenario.hpp"

namespace brainshift::twin {

const std::vector<Scenario>& all_scenarios() {
  static const std::vector<Scenario> scenarios = [] {
    Scenario paper;
    paper.name = "paper";
    paper.description =
        "gravity sag; 200 tumour surface points with noisy displacements (paper 2.6)";
    paper.fluid_level_mm = 55.0;

    Scenario icp = paper;
    icp.name = "paper-icp";
    icp.description =
        "the same sag; tumour boundary points on ultrasound sections, registered by ICP";
    icp.measurement = Measurement::kProbeSections;
    icp.sparse_points = 0;
    return std::vector<Scenario>{paper, icp};
  }();
  return scenarios;
}

const Scenario* find_scenario(const std::string& name) {
  for (const Scenario& scenario : all_scenarios()) {
    if (scenario.name == name) return &scenario;
  }
  return nullptr;
}

}  // namespace brainshift::twin
