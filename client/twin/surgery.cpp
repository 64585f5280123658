// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/twin/surgery.hpp"

#include <Eigen/Geometry>
#include <numbers>
#include <set>
#include <string>
#include <utility>

#include "client/twin/measure.hpp"
#include "common/fem/gravity.hpp"
#include "common/registration/surface_distances.hpp"

namespace brainshift::client {
namespace {

constexpr double kBetweenInstruments_s = 2.0;

Vec3 value_at(const io::ScorePoint& point, const Points& u) {
  Vec3 value = Vec3::Zero();
  for (int k = 0; k < 4; ++k) value += point.weights[k] * u.col(point.nodes[k]);
  return value;
}

// One moment of the surgery.
struct Moment {
  double fluid_level_mm = 0.0;
  Truth truth;
  Points tumour_displacement;  // true, 3 x TruthBrain::tumour
  std::vector<int> sparse;     // indices into TruthBrain::tumour
};

std::vector<io::ScorePoint> at_each(const std::vector<NodeIndex>& nodes) {
  std::vector<io::ScorePoint> points;
  for (const NodeIndex node : nodes) {
    points.push_back({Eigen::Vector4i::Constant(node), Eigen::Vector4d(1, 0, 0, 0)});
  }
  return points;
}

io::SurgeryTruth record_truth(const TruthBrain& brain, const Scenario& scenario,
                              const Moment& moment) {
  io::SurgeryTruth record;
  const std::set<int> sparse(moment.sparse.begin(), moment.sparse.end());
  for (const int i : brain.seen) {
    record.points[sparse.count(i) ? "sparse" : "cross"].push_back(
        brain.tumour[static_cast<std::size_t>(i)]);
  }
  record.points["craniotomy"] = at_each(brain.model.craniotomy);
  if (!brain.removed.empty()) record.points["removed"] = at_each(brain.removed);
  record.displacement = moment.truth.displacement;
  auto& scalars = record.scalars;
  scalars["fluid_level_mm"] = moment.fluid_level_mm;
  scalars["noise_sd_mm"] = scenario.noise_sd_mm;
  scalars["max_displacement_mm"] = record.displacement.colwise().norm().maxCoeff();
  scalars["tumour_displacement_mm"] =
      moment.tumour_displacement(Eigen::all, brain.seen).colwise().norm().mean();
  scalars["active_slaves"] = moment.truth.active;
  scalars["max_penetration_mm"] = moment.truth.max_penetration_mm;
  if (scenario.swelling.volume_strain != 0.0) {
    scalars["swelling_volume_strain"] = scenario.swelling.volume_strain;
    scalars["swelling_radius_mm"] = scenario.swelling.radius_mm;
  }
  if (scenario.volume.strain != 0.0) scalars["brain_volume_strain"] = scenario.volume.strain;
  if (scenario.resection) {
    scalars["resected_fraction"] = scenario.resection->volume_fraction;
    scalars["removed_nodes"] = static_cast<double>(brain.removed.size());
  }
  return record;
}

LandmarkPairs measure_sparse(const BrainModel& model, const Scenario& scenario,
                             const Moment& moment, Random& random) {
  Points undeformed(3, static_cast<Eigen::Index>(moment.sparse.size()));
  Points displacement(3, undeformed.cols());
  for (Eigen::Index k = 0; k < undeformed.cols(); ++k) {
    const int i = moment.sparse[static_cast<std::size_t>(k)];
    undeformed.col(k) = model.tumour.vertices.col(i);
    displacement.col(k) = moment.tumour_displacement.col(i);
  }
  return measure_displacements(undeformed, displacement, scenario.noise_sd_mm, random);
}

// The triangles between vertices that can be seen; of an intact brain all, in their order.
Eigen::Matrix<int, 3, Eigen::Dynamic> seen_triangles(const TruthBrain& brain) {
  const auto& triangles = brain.model.tumour.triangles;
  if (brain.seen.size() == brain.tumour.size()) return triangles;
  const std::set<int> seen(brain.seen.begin(), brain.seen.end());
  std::vector<int> kept;
  for (int t = 0; t < static_cast<int>(triangles.cols()); ++t) {
    const auto corners = triangles.col(t);
    if (seen.count(corners[0]) && seen.count(corners[1]) && seen.count(corners[2])) {
      kept.push_back(t);
    }
  }
  return triangles(Eigen::all, kept);
}

TumourBoundary measure_sections(const TruthBrain& brain, const Scenario& scenario,
                                const Moment& moment, Random& random) {
  const TriangleSurface deformed{brain.model.tumour.vertices + moment.tumour_displacement,
                                 seen_triangles(brain)};
  return measure_probe_sections(deformed, craniotomy_centre(brain.model), scenario, random);
}

Points at_nodes(const Points& nodal, const std::vector<NodeIndex>& nodes) {
  return nodal(Eigen::all, nodes);
}

CorticalSurface view_cortex(const registration::SurfacePatch& patch, const CortexView& view,
                            const Moment& moment, Random& random) {
  const TriangleSurface deformed{
      patch.surface.vertices + at_nodes(moment.truth.displacement, patch.nodes),
      patch.surface.triangles};
  return measure_cortex(deformed, view, random);
}

LandmarkPairs track_cortex(const registration::SurfacePatch& patch, const CortexView& view,
                           const Moment& moment, Random& random) {
  const int available = static_cast<int>(patch.nodes.size());
  const std::vector<int> chosen = random.choose(view.tracks, available);
  const Points u = at_nodes(moment.truth.displacement, patch.nodes);
  return measure_displacements(patch.surface.vertices(Eigen::all, chosen), u(Eigen::all, chosen),
                               view.track_noise_sd_mm, random);
}

// What every instrument says of one moment, one after the other.
std::vector<Observation> observe(const TruthBrain& brain, const Scenario& scenario,
                                 const Moment& moment, double time_s, Random& random) {
  const BrainModel& model = brain.model;
  std::vector<Observation> observations;
  const auto add = [&](const char* source, auto body) {
    Observation observation;
    observation.case_id = model.case_id;
    observation.source = source;
    observation.acquired_ns = static_cast<std::int64_t>(
        1e9 * (time_s + kBetweenInstruments_s * static_cast<double>(observations.size())));
    observation.body = std::move(body);
    observations.push_back(std::move(observation));
  };
  if (scenario.measurement == Measurement::kDisplacements) {
    add("ius", measure_sparse(model, scenario, moment, random));
  } else {
    add("ius", measure_sections(brain, scenario, moment, random));
  }
  if (scenario.cortex) {
    const registration::SurfacePatch patch = registration::craniotomy_patch(model);
    add("stereopsis", view_cortex(patch, *scenario.cortex, moment, random));
    if (scenario.cortex->tracks > 0) {
      add("tracks", track_cortex(patch, *scenario.cortex, moment, random));
    }
  }
  return observations;
}

// The case's gravity, turned as the scenario says, and the fluid plane perpendicular to it through
// the lowest craniotomy node.
struct Gravity {
  Vec3 direction;
  double fluid_plane_depth_mm = 0.0;
};

Gravity gravity_of(const BrainModel& model, const Scenario& scenario) {
  if (scenario.gravity_tilt_deg == 0.0 && scenario.gravity_turn_deg.isZero(0.0)) {
    return {model.gravity_direction, model.fluid_plane_depth_mm};
  }
  constexpr double kPerDegree = std::numbers::pi / 180.0;
  const Vec3 axis =
      (craniotomy_centre(model) - Vec3(model.tumour.vertices.rowwise().mean())).normalized();
  Vec3 direction =
      Eigen::AngleAxisd(scenario.gravity_tilt_deg * kPerDegree, axis) * model.gravity_direction;
  const Vec3 turn = kPerDegree * scenario.gravity_turn_deg;
  direction = Eigen::AngleAxisd(turn.norm(), turn.stableNormalized()) * direction;
  const Points nodes = at_nodes(model.mesh.nodes, model.craniotomy);
  return {direction, (direction.transpose() * nodes).maxCoeff()};
}

Status keeps_promise(const Scenario& scenario, const Truth& truth) {
  if (!scenario.contact_free || truth.active == 0) return {};
  return fail(ErrorCode::kInvalidArgument,
              "scenario " + scenario.name + ": " + std::to_string(truth.active) +
                  " slaves of this case touch the skull, it promises none");
}

Points constant_load(const TruthBrain& brain, const Scenario& scenario) {
  const Material& material = brain.config.material;
  Points load = swelling_load(brain.tissue, material,
                              swelling_centre(brain.model, scenario.swelling), scenario.swelling);
  if (scenario.volume.strain != 0.0) {
    load += volume_change_load(brain.tissue, material, brain.model.tumour.vertices.rowwise().mean(),
                               scenario.volume);
  }
  return load;
}

Result<Moment> play_moment(const TruthBrain& brain, TruthSolver& solver, const Scenario& scenario,
                           const Gravity& gravity, const Points& swelling, double fluid_level_mm,
                           Random& random) {
  Moment moment;
  moment.fluid_level_mm = fluid_level_mm;
  const Points buoyancy =
      fem::buoyancy_load(brain.tissue, brain.config.material, gravity.direction,
                         gravity.fluid_plane_depth_mm + fluid_level_mm, gravity.direction);
  auto truth = solver.solve(buoyancy + swelling);
  if (!truth) return tl::unexpected(truth.error());
  if (Status ok = keeps_promise(scenario, *truth); !ok) return tl::unexpected(ok.error());
  moment.truth = std::move(*truth);
  moment.tumour_displacement.resize(3, static_cast<Eigen::Index>(brain.tumour.size()));
  for (std::size_t k = 0; k < brain.tumour.size(); ++k) {
    moment.tumour_displacement.col(static_cast<Eigen::Index>(k)) =
        value_at(brain.tumour[k], moment.truth.displacement);
  }
  for (const int k : random.choose(scenario.sparse_points, static_cast<int>(brain.seen.size()))) {
    moment.sparse.push_back(brain.seen[static_cast<std::size_t>(k)]);
  }
  return moment;
}

}  // namespace

Result<SimulatedSurgery> play_scenario(const TruthBrain& brain, TruthSolver& solver,
                                       const Scenario& scenario, std::uint64_t seed,
                                       const Progress& progress) {
  const Points swelling = constant_load(brain, scenario);
  const Gravity gravity = gravity_of(brain.model, scenario);
  Random random(seed);
  SimulatedSurgery surgery;
  const std::size_t moments = scenario.fluid_levels_mm.size();
  for (std::size_t i = 0; i < moments; ++i) {
    report(progress, "solve with contact", static_cast<double>(i) / static_cast<double>(moments));
    const auto moment = play_moment(brain, solver, scenario, gravity, swelling,
                                    scenario.fluid_levels_mm[i], random);
    if (!moment) return tl::unexpected(moment.error());
    const double time_s = scenario.interval_s * static_cast<double>(i);
    const io::SurgeryTruth record = record_truth(brain, scenario, *moment);
    for (Observation& observation : observe(brain, scenario, *moment, time_s, random)) {
      observation.sequence = surgery.observations.size() + 1;
      surgery.observations.push_back(std::move(observation));
      surgery.truths.push_back(record);
    }
  }
  report(progress, "solve with contact", 1.0);
  return surgery;
}

Result<SimulatedSurgery> play_scenario(const BrainModel& model, const CaseConfig& config,
                                       const Scenario& scenario, std::uint64_t seed,
                                       const Progress& progress) {
  const auto brain = truth_brain(model, config, scenario, seed);
  if (!brain) return tl::unexpected(brain.error());
  const auto forward =
      contact::ForwardModel::build(brain->model, brain->config, Boundary::kContact, progress);
  if (!forward) return tl::unexpected(forward.error());
  TruthSolver solver(*forward);
  return play_scenario(*brain, solver, scenario, seed, progress);
}

Result<SimulatedSurgery> play_scenario(const BrainModel& model, const CaseConfig& config,
                                       const contact::ForwardModel& forward,
                                       const Scenario& scenario, std::uint64_t seed,
                                       const Progress& progress) {
  if (!keeps_the_brain(scenario)) return play_scenario(model, config, scenario, seed, progress);
  const auto brain = truth_brain(model, config, scenario, seed);
  if (!brain) return tl::unexpected(brain.error());
  TruthSolver solver(forward);
  return play_scenario(*brain, solver, scenario, seed, progress);
}

}  // namespace brainshift::client
