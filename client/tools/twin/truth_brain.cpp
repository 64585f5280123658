// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/truth_brain.hpp"

#include <utility>

#include "client/tools/twin/stiffness.hpp"
#include "common/geometry/surface.hpp"
#include "common/geometry/tet_locator.hpp"

namespace brainshift::client {
namespace {

constexpr double kOutlineLength_mm = 10.0;  // over which errors of segmentation vary

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

// Stiffness of the scenario; the model's labels and the case's regions change together.
Status set_stiffness(const Scenario& scenario, std::uint64_t seed, BrainModel& model,
                     CaseConfig& config) {
  if (scenario.adverse.tissue_seed) {
    auto varied = vary_tissues(model, config, *scenario.adverse.tissue_seed);
    if (!varied) return tl::unexpected(varied.error());
    model = std::move(varied->model);
    config = std::move(varied->config);
  } else if (scenario.stiffness_sd > 0.0) {
    VariedBrain varied =
        vary_stiffness(model, config, scenario.stiffness_sd, scenario.stiffness_length_mm, seed);
    model = std::move(varied.model);
    config = std::move(varied.config);
  }
  return {};
}

Points outline_of(const BrainModel& model, const Adversity& adverse) {
  Points outline = model.tumour.vertices;
  if (adverse.segmentation_sd_mm == 0.0) return outline;
  const GaussianField field(kOutlineLength_mm, adverse.segmentation_seed);
  const Points normals = geometry::vertex_normals(model.tumour);
  for (Eigen::Index i = 0; i < outline.cols(); ++i) {
    const Vec3 x = outline.col(i);
    outline.col(i) += adverse.segmentation_sd_mm * field.at(x) * normals.col(i);
  }
  return outline;
}

// All but the resection. `brain` holds model and config of the case.
Status set_adversity(const Scenario& scenario, std::uint64_t seed, const BrainModel* other,
                     TruthBrain& brain) {
  const Adversity& adverse = scenario.adverse;
  brain.outline = outline_of(brain.model, adverse);
  brain.gap_seed = adverse.gap_seed;
  brain.config.contact.penalty_n_per_mm *= adverse.penalty_factor;
  if (!adverse.other_mesh) return set_stiffness(scenario, seed, brain.model, brain.config);
  Result<BrainModel> anew = other == nullptr ? mesh_anew(brain.config) : *other;
  if (!anew) return tl::unexpected(anew.error());
  if (Status ok = set_stiffness(scenario, seed, *anew, brain.config); !ok) return ok;
  auto elsewhere = make_other_mesh(brain.model, std::move(*anew));
  if (!elsewhere) return tl::unexpected(elsewhere.error());
  brain.elsewhere = std::move(*elsewhere);
  return {};
}

}  // namespace

Result<TruthBrain> truth_brain(const BrainModel& model, const CaseConfig& config,
                               const Scenario& scenario, std::uint64_t seed,
                               const BrainModel* other) {
  TruthBrain brain;
  brain.model = model;
  brain.config = config;
  if (Status ok = set_adversity(scenario, seed, other, brain); !ok) {
    return tl::unexpected(ok.error());
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
