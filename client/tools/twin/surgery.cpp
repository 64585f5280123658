// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/surgery.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "client/tools/twin/measure.hpp"
#include "client/tools/twin/truth_load.hpp"
#include "common/registration/surface_distances.hpp"

namespace brainshift::client {
namespace {

constexpr double kBetweenInstruments_s = 2.0;

// One moment of the surgery.
struct Moment {
  double fluid_level_mm = 0.0;
  double load_scale = 1.0;     // Scenario::tumour_displacement_mm
  Truth truth;                 // its displacement: of the body that was solved for
  Points displacement;         // true, at the nodes of the case's model
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
  record.displacement = moment.displacement;
  auto& scalars = record.scalars;
  scalars["fluid_level_mm"] = moment.fluid_level_mm;
  scalars["noise_sd_mm"] = scenario.noise_sd_mm;
  scalars["max_displacement_mm"] = record.displacement.colwise().norm().maxCoeff();
  scalars["tumour_displacement_mm"] =
      moment.tumour_displacement(Eigen::all, brain.seen).colwise().norm().mean();
  scalars["active_slaves"] = moment.truth.active;
  scalars["max_penetration_mm"] = moment.truth.max_penetration_mm;
  if (scenario.tumour_displacement_mm) scalars["load_scale"] = moment.load_scale;
  if (brain.elsewhere) scalars["truth_nodes"] = brain.elsewhere->space.num_nodes();
  if (scenario.swelling.volume_strain != 0.0) {
    scalars["swelling_volume_strain"] = scenario.swelling.volume_strain;
    scalars["swelling_radius_mm"] = scenario.swelling.radius_mm;
  }
  if (scenario.volume.strain != 0.0) scalars["brain_volume_strain"] = scenario.volume.strain;
  if (scenario.retraction) scalars["retraction_pa"] = scenario.retraction->pressure_pa;
  if (scenario.resection) {
    scalars["resected_fraction"] = scenario.resection->volume_fraction;
    scalars["removed_nodes"] = static_cast<double>(brain.removed.size());
  }
  return record;
}

// Every point is a section of its own to the probe's errors.
LandmarkPairs measure_sparse(const BrainModel& model, const Scenario& scenario,
                             const Moment& moment, ProbeError& error, Random& random) {
  const Points undeformed = model.tumour.vertices(Eigen::all, moment.sparse);
  const Points displacement = moment.tumour_displacement(Eigen::all, moment.sparse);
  LandmarkPairs pairs =
      measure_displacements(undeformed, displacement, scenario.noise_sd_mm, random);
  const Vec3 centre = undeformed.rowwise().mean(), probe = craniotomy_centre(model);
  for (Eigen::Index k = 0; k < pairs.deformed.cols(); ++k) {
    Points point = pairs.deformed.col(k);
    error.disturb(point, centre, probe);
    pairs.deformed.col(k) = point;
  }
  return pairs;
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

// The outline moves as the model's surface beneath it does.
TumourBoundary measure_sections(const TruthBrain& brain, const Scenario& scenario,
                                const Moment& moment, ProbeError& error, Random& random) {
  const TriangleSurface deformed{brain.outline + moment.tumour_displacement, seen_triangles(brain)};
  return measure_probe_sections(deformed, craniotomy_centre(brain.model), scenario, error, random);
}

// The exposed cortex of the body that was solved for, as a camera sees it.
CorticalSurface view_cortex(const TruthBrain& brain, const CortexView& view, const Moment& moment,
                            Random& random) {
  const BrainModel& body = brain.elsewhere ? brain.elsewhere->model : brain.model;
  const registration::SurfacePatch patch = registration::craniotomy_patch(body);
  const TriangleSurface deformed{
      patch.surface.vertices + moment.truth.displacement(Eigen::all, patch.nodes),
      patch.surface.triangles};
  return measure_cortex(deformed, view, random);
}

// Forks of vessels: nodes of the case's model, where the MRI shows them.
LandmarkPairs track_cortex(const BrainModel& model, const CortexView& view, const Moment& moment,
                           Random& random) {
  const registration::SurfacePatch patch = registration::craniotomy_patch(model);
  const int available = static_cast<int>(patch.nodes.size());
  const std::vector<int> chosen = random.choose(view.tracks, available);
  const Points u = moment.displacement(Eigen::all, patch.nodes);
  return measure_displacements(patch.surface.vertices(Eigen::all, chosen), u(Eigen::all, chosen),
                               view.track_noise_sd_mm, random);
}

// What every instrument says of one moment, one after the other.
std::vector<Observation> observe(const TruthBrain& brain, const Scenario& scenario,
                                 const Moment& moment, double time_s, ProbeError& error,
                                 Random& random) {
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
    add("ius", measure_sparse(model, scenario, moment, error, random));
  } else {
    add("ius", measure_sections(brain, scenario, moment, error, random));
  }
  if (scenario.cortex) {
    add("stereopsis", view_cortex(brain, *scenario.cortex, moment, random));
    if (scenario.cortex->tracks > 0) {
      add("tracks", track_cortex(model, *scenario.cortex, moment, random));
    }
  }
  return observations;
}

Status keeps_promise(const Scenario& scenario, const Truth& truth) {
  if (!scenario.contact_free || truth.active == 0) return {};
  return invalid("scenario " + scenario.name + ": " + std::to_string(truth.active) +
                 " slaves of this case touch the skull, it promises none");
}

// The true displacement under the load times moment.load_scale. With a displacement that the
// tumour must have, the scale is sought by secants through the logarithms of scale and
// displacement: without contact they lie on a line of slope 1, and contact bends it.
Status solve_moment(const TruthBrain& brain, TruthSource& solver, const Scenario& scenario,
                    const Points& load, Moment& moment) {
  constexpr int kSteps = 20;
  constexpr double kClose = 0.005;  // relative
  constexpr double kMinSlope = 0.25, kMaxSlope = 1.5;
  double slope = 1.0, last_scale = 0.0, last_moved = 0.0;
  for (int step = 0; step < kSteps; ++step) {
    auto truth = solver.solve(moment.load_scale * load);
    if (!truth) return tl::unexpected(truth.error());
    moment.truth = std::move(*truth);
    moment.displacement = displacement_at_nodes(brain, moment.truth.displacement);
    moment.tumour_displacement = displacement_of_tumour(brain, moment.truth.displacement);
    if (!scenario.tumour_displacement_mm) return {};
    const double moved = moment.tumour_displacement(Eigen::all, brain.seen).colwise().norm().mean();
    const double ratio = *scenario.tumour_displacement_mm / moved;
    if (std::abs(ratio - 1.0) < kClose) return {};
    if (!std::isfinite(ratio)) break;
    if (step > 0) {
      slope = std::log(moved / last_moved) / std::log(moment.load_scale / last_scale);
      slope = std::clamp(slope, kMinSlope, kMaxSlope);
    }
    last_scale = moment.load_scale;
    last_moved = moved;
    moment.load_scale *= std::pow(ratio, 1.0 / slope);
  }
  return fail(ErrorCode::kNotConverged,
              "scenario " + scenario.name + ": its load does not move this case's tumour by " +
                  std::to_string(*scenario.tumour_displacement_mm) + " mm");
}

// Vertices of the tumour that an instrument sees and that a partial sweep crosses.
std::vector<int> crossed(const TruthBrain& brain, const ProbeError& error) {
  const Points& vertices = brain.model.tumour.vertices;
  const std::array<Vec3, 2> normals =
      sweep_normals(vertices.rowwise().mean(), craniotomy_centre(brain.model));
  VecX shares[2];  // where a vertex lies in the tumour's extent across a sweep's sections
  for (std::size_t sweep = 0; sweep < 2; ++sweep) {
    const VecX heights = vertices.transpose() * normals[sweep];
    const double low = heights.minCoeff();
    shares[sweep] = (heights.array() - low) / (heights.maxCoeff() - low);
  }
  std::vector<int> kept;
  for (const int i : brain.seen) {
    if (error.sweeps(0, shares[0][i]) || error.sweeps(1, shares[1][i])) kept.push_back(i);
  }
  return kept;
}

Result<Moment> play_moment(const TruthBrain& brain, TruthSource& solver, const Scenario& scenario,
                           const Points& swelling, std::size_t index, const ProbeError& error,
                           Random& random) {
  Moment moment;
  moment.fluid_level_mm = scenario.fluid_levels_mm[index] + scenario.adverse.level_error_mm;
  const Gravity gravity = gravity_of(brain.model, scenario);
  const Points load = gravity_load(brain, gravity, moment.fluid_level_mm) + swelling;
  if (Status ok = solve_moment(brain, solver, scenario, load, moment); !ok) {
    return tl::unexpected(ok.error());
  }
  if (Status ok = keeps_promise(scenario, moment.truth); !ok) return tl::unexpected(ok.error());
  const bool partial = scenario.adverse.probe.swept_part < 1.0;
  const std::vector<int> candidates = partial ? crossed(brain, error) : brain.seen;
  for (const int k : random.choose(scenario.sparse_points, static_cast<int>(candidates.size()))) {
    moment.sparse.push_back(candidates[static_cast<std::size_t>(k)]);
  }
  return moment;
}

}  // namespace

Result<SimulatedSurgery> play_scenario(const TruthBrain& brain, TruthSource& solver,
                                       const Scenario& scenario, std::uint64_t seed,
                                       const Progress& progress) {
  if (Status ok = check_gravity(brain, scenario); !ok) return tl::unexpected(ok.error());
  if (Status ok = check_retraction(brain, scenario); !ok) return tl::unexpected(ok.error());
  const Points swelling = constant_load(brain, scenario);
  Random random(seed);
  ProbeError error(scenario.adverse.probe);
  SimulatedSurgery surgery;
  ContactSeen contact;
  const std::size_t moments = scenario.fluid_levels_mm.size();
  for (std::size_t i = 0; i < moments; ++i) {
    report(progress, "solve with contact", static_cast<double>(i) / static_cast<double>(moments));
    const auto moment = play_moment(brain, solver, scenario, swelling, i, error, random);
    if (!moment) return tl::unexpected(moment.error());
    if (depends_on_contact(scenario)) {
      contact.add(brain.model, moment->truth.active, moment->displacement);
    }
    const double time_s = scenario.interval_s * static_cast<double>(i);
    const io::SurgeryTruth record = record_truth(brain, scenario, *moment);
    for (Observation& observation : observe(brain, scenario, *moment, time_s, error, random)) {
      observation.sequence = surgery.observations.size() + 1;
      surgery.observations.push_back(std::move(observation));
      surgery.truths.push_back(record);
    }
  }
  if (Status ok = check_contact(scenario, contact); !ok) return tl::unexpected(ok.error());
  report(progress, "solve with contact", 1.0);
  return surgery;
}

Result<SimulatedSurgery> play_scenario(const BrainModel& model, const CaseConfig& config,
                                       const Scenario& scenario, std::uint64_t seed,
                                       const Progress& progress) {
  const auto brain = truth_brain(model, config, scenario, seed);
  if (!brain) return tl::unexpected(brain.error());
  const auto forward = truth_forward(*brain, progress);
  if (!forward) return tl::unexpected(forward.error());
  TruthSolver solver(*forward);
  return play_scenario(*brain, solver, scenario, seed, progress);
}

Result<SimulatedSurgery> play_given(const BrainModel& model, const CaseConfig& config,
                                    Scenario scenario, Points displacement, std::uint64_t seed) {
  scenario.stiffness_sd = 0.0;
  scenario.tumour_displacement_mm.reset();
  scenario.contact_free = false;
  const auto brain = truth_brain(model, config, scenario, seed);
  if (!brain) return tl::unexpected(brain.error());
  auto pairs = contact::contact_pairs(model);
  if (!pairs) return tl::unexpected(pairs.error());
  GivenTruth given(std::move(displacement),
                   contact::PenaltyContact(std::move(*pairs), config.contact.penalty_n_per_mm));
  auto surgery = play_scenario(*brain, given, scenario, seed);
  if (!surgery) return surgery;
  for (io::SurgeryTruth& truth : surgery->truths) truth.scalars.erase("fluid_level_mm");
  return surgery;
}

}  // namespace brainshift::client
