// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/twin/surgery.hpp"

#include <Eigen/Geometry>
#include <numbers>
#include <set>
#include <string>
#include <utility>

#include "client/twin/measure.hpp"
#include "client/twin/stiffness.hpp"
#include "client/twin/truth.hpp"
#include "common/fem/gravity.hpp"
#include "common/geometry/tet_locator.hpp"
#include "common/registration/surface_distances.hpp"

namespace brainshift::client {
namespace {

constexpr double kBetweenInstruments_s = 2.0;

Vec3 value_at(const io::ScorePoint& point, const Points& u) {
  Vec3 value = Vec3::Zero();
  for (int k = 0; k < 4; ++k) value += point.weights[k] * u.col(point.nodes[k]);
  return value;
}

// The tumour's surface vertices as points of the mesh: which of them are given (sparse) and which
// are kept to check (cross) is drawn for every observation.
std::vector<io::ScorePoint> tumour_pool(const BrainModel& model) {
  const geometry::TetLocator locator(model.mesh);
  std::vector<io::ScorePoint> pool;
  for (int i = 0; i < model.tumour.num_vertices(); ++i) {
    const geometry::TetLocation location = locator.locate(model.tumour.vertices.col(i));
    pool.push_back({location.nodes, location.weights});
  }
  return pool;
}

// One moment of the surgery.
struct Moment {
  double fluid_level_mm = 0.0;
  Truth truth;
  Points pool_displacement;  // true, 3 x pool
  std::vector<int> sparse;   // indices into the pool
};

io::SurgeryTruth record_truth(const BrainModel& model, const Scenario& scenario,
                              const std::vector<io::ScorePoint>& pool, const Moment& moment) {
  io::SurgeryTruth record;
  const std::set<int> sparse(moment.sparse.begin(), moment.sparse.end());
  for (int i = 0; i < static_cast<int>(pool.size()); ++i) {
    record.points[sparse.count(i) ? "sparse" : "cross"].push_back(
        pool[static_cast<std::size_t>(i)]);
  }
  for (NodeIndex node : model.craniotomy) {
    record.points["craniotomy"].push_back(
        {Eigen::Vector4i::Constant(node), Eigen::Vector4d(1, 0, 0, 0)});
  }
  record.displacement = moment.truth.displacement;
  auto& scalars = record.scalars;
  scalars["fluid_level_mm"] = moment.fluid_level_mm;
  scalars["noise_sd_mm"] = scenario.noise_sd_mm;
  scalars["max_displacement_mm"] = record.displacement.colwise().norm().maxCoeff();
  scalars["tumour_displacement_mm"] = moment.pool_displacement.colwise().norm().mean();
  scalars["active_slaves"] = moment.truth.active;
  scalars["max_penetration_mm"] = moment.truth.max_penetration_mm;
  if (scenario.swelling.volume_strain != 0.0) {
    scalars["swelling_volume_strain"] = scenario.swelling.volume_strain;
    scalars["swelling_radius_mm"] = scenario.swelling.radius_mm;
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
    displacement.col(k) = moment.pool_displacement.col(i);
  }
  return measure_displacements(undeformed, displacement, scenario.noise_sd_mm, random);
}

TumourBoundary measure_sections(const BrainModel& model, const Scenario& scenario,
                                const Moment& moment, Random& random) {
  const TriangleSurface deformed{model.tumour.vertices + moment.pool_displacement,
                                 model.tumour.triangles};
  return measure_probe_sections(deformed, craniotomy_centre(model), scenario, random);
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
std::vector<Observation> observe(const BrainModel& model, const Scenario& scenario,
                                 const Moment& moment, double time_s, Random& random) {
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
    add("ius", measure_sections(model, scenario, moment, random));
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

// The case's gravity, turned about the axis from the tumour to the craniotomy, and the fluid plane
// perpendicular to it through the lowest craniotomy node.
struct Gravity {
  Vec3 direction;
  double fluid_plane_depth_mm = 0.0;
};

Gravity gravity_of(const BrainModel& model, const Scenario& scenario) {
  if (scenario.gravity_tilt_deg == 0.0) {
    return {model.gravity_direction, model.fluid_plane_depth_mm};
  }
  const Vec3 axis =
      (craniotomy_centre(model) - Vec3(model.tumour.vertices.rowwise().mean())).normalized();
  const Vec3 direction =
      Eigen::AngleAxisd(scenario.gravity_tilt_deg * std::numbers::pi / 180.0, axis) *
      model.gravity_direction;
  const Points nodes = at_nodes(model.mesh.nodes, model.craniotomy);
  return {direction, (direction.transpose() * nodes).maxCoeff()};
}

Status keeps_promise(const Scenario& scenario, const Truth& truth) {
  if (!scenario.contact_free || truth.active == 0) return {};
  return fail(ErrorCode::kInvalidArgument,
              "scenario " + scenario.name + ": " + std::to_string(truth.active) +
                  " slaves of this case touch the skull, it promises none");
}

Result<SimulatedSurgery> play(const BrainModel& model, const CaseConfig& config,
                              const contact::ForwardModel& forward, const Scenario& scenario,
                              std::uint64_t seed, const Progress& progress) {
  const std::vector<io::ScorePoint> pool = tumour_pool(model);
  const Points swelling = swelling_load(
      model.mesh, config.material, swelling_centre(model, scenario.swelling), scenario.swelling);
  const Gravity gravity = gravity_of(model, scenario);
  TruthSolver solver(forward);
  Random random(seed);
  SimulatedSurgery surgery;
  const std::size_t moments = scenario.fluid_levels_mm.size();
  for (std::size_t i = 0; i < moments; ++i) {
    report(progress, "solve with contact", static_cast<double>(i) / static_cast<double>(moments));
    Moment moment;
    moment.fluid_level_mm = scenario.fluid_levels_mm[i];
    const Points buoyancy =
        fem::buoyancy_load(model.mesh, config.material, gravity.direction,
                           gravity.fluid_plane_depth_mm + moment.fluid_level_mm, gravity.direction);
    auto truth = solver.solve(buoyancy + swelling);
    if (!truth) return tl::unexpected(truth.error());
    if (Status ok = keeps_promise(scenario, *truth); !ok) return tl::unexpected(ok.error());
    moment.truth = std::move(*truth);
    moment.pool_displacement.resize(3, model.tumour.num_vertices());
    for (int k = 0; k < model.tumour.num_vertices(); ++k) {
      moment.pool_displacement.col(k) =
          value_at(pool[static_cast<std::size_t>(k)], moment.truth.displacement);
    }
    moment.sparse = random.choose(scenario.sparse_points, model.tumour.num_vertices());
    const double time_s = scenario.interval_s * static_cast<double>(i);
    const io::SurgeryTruth record = record_truth(model, scenario, pool, moment);
    for (Observation& observation : observe(model, scenario, moment, time_s, random)) {
      observation.sequence = surgery.observations.size() + 1;
      surgery.observations.push_back(std::move(observation));
      surgery.truths.push_back(record);
    }
  }
  report(progress, "solve with contact", 1.0);
  return surgery;
}

}  // namespace

Result<SimulatedSurgery> play_scenario(const BrainModel& model, const CaseConfig& config,
                                       const Scenario& scenario, std::uint64_t seed,
                                       const Progress& progress) {
  const auto play_on = [&](const BrainModel& brain,
                           const CaseConfig& with) -> Result<SimulatedSurgery> {
    const auto forward = contact::ForwardModel::build(brain, with, Boundary::kContact, progress);
    if (!forward) return tl::unexpected(forward.error());
    return play(brain, with, *forward, scenario, seed, progress);
  };
  if (scenario.stiffness_sd == 0.0) return play_on(model, config);
  const VariedBrain varied =
      vary_stiffness(model, config, scenario.stiffness_sd, scenario.stiffness_length_mm, seed);
  return play_on(varied.model, varied.config);
}

Result<SimulatedSurgery> play_scenario(const BrainModel& model, const CaseConfig& config,
                                       const contact::ForwardModel& forward,
                                       const Scenario& scenario, std::uint64_t seed,
                                       const Progress& progress) {
  if (scenario.stiffness_sd > 0.0) return play_scenario(model, config, scenario, seed, progress);
  return play(model, config, forward, scenario, seed, progress);
}

}  // namespace brainshift::client
