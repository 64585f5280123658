// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/anatomy/head_pair.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <utility>

#include "client/tools/twin/surgery.hpp"
#include "client/tools/twin/truth.hpp"
#include "common/contact/forward_model.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/geometry/surface.hpp"
#include "common/inversion/inverter.hpp"
#include "common/pipeline/pipeline.hpp"
#include "tests/surgeries/outside/cavity.hpp"
#include "tests/surgeries/surgery_place.hpp"

namespace brainshift::anatomy_study {

using surgeries::Cells;
using surgeries::Row;

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr CommonPlaces::Means kNoMeans{kNaN, kNaN, kNaN};
constexpr double kNoDeadline_ms = 600000.0;
constexpr std::uint64_t kPlaceSeed = 42;

}  // namespace

// NaN: not measured.
struct ModelScore {
  std::string status = "refused";
  CommonPlaces::Means field_mm = kNoMeans;
  double loaded_mm = kNaN;  // of error_under_the_true_load
  double ventricle_change_mm3 = kNaN, update_ms = kNaN;
  std::optional<surgeries::UpdateScore> nodes;
  std::string quality;
};

namespace {

struct TruthFacts {
  CommonPlaces::Means motion_mm = kNoMeans;
  double largest_mm = kNaN, load_scale = kNaN, volume_loss = kNaN, change_mm3 = kNaN;
  int pressed = 0, places = 0;
};

void add_means(const std::string& prefix, const CommonPlaces::Means& means, Cells& cells) {
  cells.add(prefix + "mm", means.all);
  cells.add(prefix + "opened_mm", means.opened);
  cells.add(prefix + "other_mm", means.other);
}

void add_model(const std::string& prefix, const ModelScore& score, Cells& cells) {
  cells.add(prefix + "status", score.status);
  add_means(prefix + "field_", score.field_mm, cells);
  cells.add(prefix + "loaded_mm", score.loaded_mm);
  const auto of = [&](auto member) { return score.nodes ? member(*score.nodes) : kNaN; };
  using Score = surgeries::UpdateScore;
  cells.add(prefix + "nodes_mm", of([](const Score& s) { return s.estimate.mean_mm; }));
  cells.add(prefix + "nodes_none_mm", of([](const Score& s) { return s.none.mean_mm; }));
  cells.add(prefix + "tumour_mm", of([](const Score& s) { return s.estimate.tumour_mm; }));
  cells.add(prefix + "none_tumour_mm", of([](const Score& s) { return s.none.tumour_mm; }));
  cells.add(prefix + "near_mm", of([](const Score& s) { return s.near.error_mm; }));
  cells.add(prefix + "far_mm", of([](const Score& s) { return s.far.error_mm; }));
  cells.add(prefix + "near_coverage_90", of([](const Score& s) { return s.near.coverage_90; }));
  cells.add(prefix + "far_coverage_90", of([](const Score& s) { return s.far.coverage_90; }));
  cells.add(prefix + "ventricle_change_mm3", score.ventricle_change_mm3);
  cells.add(prefix + "quality", score.quality);
  cells.add(prefix + "update_ms", score.update_ms);
}

Row row_of(const AnatomyKey& key, int stage, const std::string& reason, const TruthFacts& truth,
           const ModelScore& with, const ModelScore& without) {
  Cells cells;
  cells.add("head", key.head);
  cells.add("kind", key.kind);
  cells.add("seed", std::to_string(key.seed));
  cells.add("stage", surgeries::stage_name(stage));
  cells.add("reason", reason);
  cells.add("places", truth.places);
  add_means("true_", truth.motion_mm, cells);
  cells.add("true_max_mm", truth.largest_mm);
  cells.add("load_scale", truth.load_scale);
  cells.add("pressed", truth.pressed);
  cells.add("volume_loss", truth.volume_loss);
  cells.add("true_change_mm3", truth.change_mm3);
  add_model("with_", with, cells);
  add_model("without_", without, cells);
  return cells.take();
}

// Nodes of a model that lie in the cavities of the truth's mesh: nothing is true there.
Result<std::vector<NodeIndex>> nodes_in_cavities(const BrainModel& model, const BrainModel& truth) {
  std::vector<NodeIndex> inside;
  if (truth.ventricle_wall.cols() == 0) return inside;
  const auto wall = geometry::ClosestPointIndex::build(
      geometry::surface_of(truth.mesh.nodes, truth.ventricle_wall));
  if (!wall) return tl::unexpected(wall.error());
  for (int node = 0; node < model.mesh.num_nodes(); ++node) {
    if (wall->contains(model.mesh.nodes.col(node))) inside.push_back(node);
  }
  return inside;
}

// What the model's own answer to the true load is wrong by: the error that no inference takes away.
// The least over scales of the load, as the true tissue is stiffer or softer than the model's.
double error_under_the_true_load(const bench::Head& head, const outside::OutsideTruth& truth,
                                 const std::function<double(const Points&)>& error_of) {
  const contact::ForwardModel& forward = head.prepared->forward();
  client::TruthSolver solver(forward);
  const Points load = truth.load(fem::make_space(head.model->mesh, fem::Element::kP1));
  double least = kNaN;
  for (const double scale : {0.6, 0.8, 1.0, 1.2, 1.45, 1.75, 2.1}) {
    const auto answer = solver.solve(scale * load);
    if (answer) least = std::fmin(least, error_of(answer->displacement));
  }
  return least;
}

}  // namespace

const std::vector<StudyKind>& study_kinds() {
  static const std::vector<StudyKind> kinds = {
      {outside::find_kind("air-side"), true, true},
      {outside::find_kind("falx-sag"), true, true},
      {outside::find_kind("ventricles-drain"), true, false},
      {&outside::plain_sag(), false, true}};
  return kinds;
}

const StudyKind* find_study_kind(const std::string& name) {
  for (const StudyKind& kind : study_kinds()) {
    if (kind.kind->name == name) return &kind;
  }
  return nullptr;
}

Row refused_row(const AnatomyKey& key, const std::string& reason) {
  return row_of(key, 0, reason, {}, {}, {});
}

struct HeadPair::Model {
  bench::Head head;
  std::unique_ptr<pipeline::Pipeline> pipeline;
  const BrainModel& brain() const { return *head.model; }
};

struct HeadPair::World {
  std::unique_ptr<outside::OutsideTruths> truths;
  CommonPlaces places;
  client::SpacePoints nodes_with, nodes_without;
  std::vector<NodeIndex> removed_with, removed_without;

  const outside::OutsideHead& head() const { return truths->head(); }
};

HeadPair::~HeadPair() = default;

Result<std::unique_ptr<HeadPair::Model>> HeadPair::model_of(const CaseConfig& config,
                                                            double thousand_nodes) {
  auto head = bench::make_head(config, {config.case_id, thousand_nodes});
  if (!head) return tl::unexpected(head.error());
  auto model = std::make_unique<Model>();
  model->head = std::move(*head);
  auto inverter =
      inversion::condensed_inverter(model->head.operators, model->head.locator, model->head.config);
  if (!inverter) return tl::unexpected(inverter.error());
  auto pipeline = pipeline::Pipeline::build(model->brain(), model->head.config, Method::kCondensed,
                                            Boundary::kContact, std::move(*inverter));
  if (!pipeline) return tl::unexpected(pipeline.error());
  model->pipeline = std::make_unique<pipeline::Pipeline>(std::move(*pipeline));
  return model;
}

Result<std::unique_ptr<HeadPair::World>> HeadPair::world_of(const Model& home, const Model& with,
                                                            const Model& without) {
  auto truths = outside::OutsideTruths::make(home.brain(), home.head.config);
  if (!truths) return tl::unexpected(truths.error());
  const client::OtherMesh& mesh = *(*truths)->head().mesh;
  auto places = CommonPlaces::make((*truths)->head(), with.head, without.head, kPlaceSeed);
  if (!places) return tl::unexpected(places.error());
  auto removed_with = nodes_in_cavities(with.brain(), mesh.model);
  auto removed_without = nodes_in_cavities(without.brain(), mesh.model);
  if (!removed_with) return tl::unexpected(removed_with.error());
  if (!removed_without) return tl::unexpected(removed_without.error());
  return std::make_unique<World>(
      World{std::move(*truths), std::move(*places),
            client::nodes_elsewhere(with.brain(), mesh.model, mesh.locator),
            client::nodes_elsewhere(without.brain(), mesh.model, mesh.locator),
            std::move(*removed_with), std::move(*removed_without)});
}

Result<std::unique_ptr<HeadPair>> HeadPair::make(CaseConfig config, double thousand_nodes) {
  config.condensed.deadline_ms = kNoDeadline_ms;
  CaseConfig plain = config;
  plain.anatomy.labels.reset();
  auto pair = std::unique_ptr<HeadPair>(new HeadPair);
  for (auto& [model, given] :
       {std::pair(&pair->with_, &config), std::pair(&pair->without_, &plain)}) {
    auto made = model_of(*given, thousand_nodes);
    if (!made) return tl::unexpected(made.error());
    *model = std::move(*made);
  }
  for (auto& [world, home] :
       {std::pair(&pair->open_, &*pair->with_), std::pair(&pair->plain_, &*pair->without_)}) {
    auto made = world_of(*home, *pair->with_, *pair->without_);
    if (!made) return tl::unexpected(made.error());
    *world = std::move(*made);
  }
  return pair;
}

std::string HeadPair::told() const {
  const auto volume = [](const BrainModel& model) {
    return -1e-3 * geometry::enclosed_volume({model.mesh.nodes, model.ventricle_wall});
  };
  const auto sheets = [](const BrainModel& model) {  // cm2; each is there twice
    return 0.005 * geometry::area({model.mesh.nodes, model.septa.triangles});
  };
  const BrainModel &with = with_->brain(), &truth = open_->head().mesh->model;
  return fmt::format(
      "nodes with anatomy {}, without {}; truths {} and {} quadratic; ventricles {:.1f} cc, of the "
      "truth {:.1f} cc; falx and tentorium {:.0f} cm2, of the truth {:.0f} cm2; {} and {} common "
      "places; {} nodes of the model without anatomy lie in ventricles",
      with.mesh.num_nodes(), without_->brain().mesh.num_nodes(), open_->head().space().num_nodes(),
      plain_->head().space().num_nodes(), volume(with), volume(truth), sheets(with), sheets(truth),
      open_->places.size(), plain_->places.size(), open_->removed_without.size());
}

Result<std::vector<ModelScore>> HeadPair::estimates(const Model& model, const World& world,
                                                    bool anatomy, const StudyKind& kind,
                                                    const outside::OutsideTruth& truth,
                                                    std::uint64_t seed) {
  const fem::DisplacementSpace& space = world.head().space();
  const auto& points = anatomy ? world.nodes_with : world.nodes_without;
  auto surgery = client::play_given(model.brain(), model.head.config,
                                    *client::find_scenario(surgeries::kSeenBy),
                                    points.displacement(space, truth.quadratic), seed);
  if (!surgery) return tl::unexpected(surgery.error());
  for (io::SurgeryTruth& each : surgery->truths) {
    for (const NodeIndex node : anatomy ? world.removed_with : world.removed_without) {
      each.points["removed"].push_back(
          {Eigen::Vector4i::Constant(node), Eigen::Vector4d(1, 0, 0, 0)});
    }
  }
  const auto errors = [&](const Points& nodal) {
    return anatomy ? world.places.error_with(space, truth.quadratic, nodal)
                   : world.places.error_without(space, truth.quadratic, nodal);
  };
  const double loaded_mm =
      kind.any_mesh ? error_under_the_true_load(model.head, truth,
                                                [&](const Points& u) { return errors(u).all; })
                    : kNaN;
  model.pipeline->reset();
  std::vector<ModelScore> scores;
  for (std::size_t i = 0; i < surgery->observations.size(); ++i) {
    ModelScore& score = scores.emplace_back();
    score.loaded_mm = loaded_mm;
    const auto update = model.pipeline->run(surgery->observations[i]);
    if (!update) continue;
    const Estimate& estimate = update->estimate;
    const auto nodes =
        surgeries::score_update(model.brain(), surgery->truths[i], estimate, static_cast<int>(i));
    if (!nodes) return tl::unexpected(nodes.error());
    score.status = std::string(to_string(estimate.status));
    score.quality = std::string(to_string(estimate.quality.quality));
    score.nodes = *nodes;
    score.field_mm = errors(estimate.displacement);
    score.ventricle_change_mm3 = estimate.ventricle_change_mm3;
    score.update_ms =
        update->timings.register_ms + update->timings.invert_ms + update->timings.rebuild_ms;
  }
  return scores;
}

Result<std::vector<Row>> HeadPair::play(const AnatomyKey& key) {
  const StudyKind& kind = *find_study_kind(key.kind);
  World& world = kind.anatomy ? *open_ : *plain_;
  const auto truth = world.truths->make(*kind.kind, key.seed);
  if (!truth) {
    if (truth.error().code != ErrorCode::kNotConverged) return tl::unexpected(truth.error());
    return std::vector<Row>{refused_row(key, truth.error().message)};
  }
  const fem::DisplacementSpace& space = world.head().space();
  const outside::Wall& wall = world.head().mesh->model.ventricle_wall;
  TruthFacts facts{world.places.motion(space, truth->quadratic),
                   truth->largest_mm,
                   truth->load_scale,
                   truth->volume_loss,
                   kNaN,
                   truth->pressed,
                   world.places.size()};
  if (wall.cols() > 0) {
    const Points rest = Points::Zero(3, space.num_nodes());
    facts.change_mm3 = outside::cavity_volume(space, truth->quadratic, wall) -
                       outside::cavity_volume(space, rest, wall);
  }
  const auto with = estimates(*with_, world, true, kind, *truth, key.seed);
  if (!with) return tl::unexpected(with.error());
  const auto without = estimates(*without_, world, false, kind, *truth, key.seed);
  if (!without) return tl::unexpected(without.error());
  std::vector<Row> rows;
  for (std::size_t i = 0; i < with->size(); ++i) {
    rows.push_back(row_of(key, static_cast<int>(i), "", facts, (*with)[i], (*without)[i]));
  }
  return rows;
}

}  // namespace brainshift::anatomy_study
