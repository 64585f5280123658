// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/twin/truth_brain.hpp"

#include <utility>

#include "client/twin/stiffness.hpp"
#include "common/geometry/tet_locator.hpp"

namespace brainshift::client {
namespace {

std::vector<io::ScorePoint> tumour_points(const BrainModel& model) {
  const geometry::TetLocator locator(model.mesh);
  std::vector<io::ScorePoint> points;
  for (int i = 0; i < model.tumour.num_vertices(); ++i) {
    const geometry::TetLocation location = locator.locate(model.tumour.vertices.col(i));
    points.push_back({location.nodes, location.weights});
  }
  return points;
}

bool on_tissue(const io::ScorePoint& point, const std::vector<char>& attached) {
  for (int k = 0; k < 4; ++k) {
    if (point.weights[k] > 0.0 && attached[static_cast<std::size_t>(point.nodes[k])] == 0) {
      return false;
    }
  }
  return true;
}

}  // namespace

bool keeps_the_brain(const Scenario& scenario) {
  return scenario.stiffness_sd == 0.0 && !scenario.resection;
}

Result<TruthBrain> truth_brain(const BrainModel& model, const CaseConfig& config,
                               const Scenario& scenario, std::uint64_t seed) {
  TruthBrain brain;
  brain.model = model;
  brain.config = config;
  if (scenario.stiffness_sd > 0.0) {
    VariedBrain varied =
        vary_stiffness(model, config, scenario.stiffness_sd, scenario.stiffness_length_mm, seed);
    brain.model = std::move(varied.model);
    brain.config = std::move(varied.config);
  }
  std::vector<char> attached(static_cast<std::size_t>(model.mesh.num_nodes()), 1);
  if (scenario.resection) {
    auto resected = resect(brain.model, brain.config, *scenario.resection);
    if (!resected) return tl::unexpected(resected.error());
    brain.model = std::move(resected->model);
    brain.config = std::move(resected->config);
    brain.tissue = std::move(resected->tissue);
    attached = std::move(resected->attached);
  } else {
    brain.tissue = brain.model.mesh;
  }
  brain.tumour = tumour_points(brain.model);
  for (std::size_t i = 0; i < brain.tumour.size(); ++i) {
    if (on_tissue(brain.tumour[i], attached)) brain.seen.push_back(static_cast<int>(i));
  }
  if (brain.seen.empty()) {
    return fail(ErrorCode::kEmptySet, "resection: nothing of the tumour's surface is left to see");
  }
  for (std::size_t node = 0; node < attached.size(); ++node) {
    if (attached[node] == 0) brain.removed.push_back(static_cast<NodeIndex>(node));
  }
  return brain;
}

}  // namespace brainshift::client
