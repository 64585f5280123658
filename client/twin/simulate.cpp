// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/twin/simulate.hpp"

#include <chrono>
#include <ctime>
#include <set>
#include <sstream>

#include "client/twin/measure.hpp"
#include "client/twin/scenario.hpp"
#include "common/contact/forward_model.hpp"
#include "common/fem/gravity.hpp"
#include "common/geometry/tet_locator.hpp"
#include "common/io/config_file.hpp"
#include "common/io/surgery_file.hpp"
#include "common/scene/brain_model_builder.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::twin {
namespace {

struct Patient {
  CaseConfig config;
  BrainModel model;
};

Result<Patient> load_patient(const std::filesystem::path& case_file, const Progress& progress) {
  auto config = io::read_case_config(case_file);
  if (!config) return tl::unexpected(config.error());
  auto inputs = io::load_case_inputs(*config);
  if (!inputs) return tl::unexpected(inputs.error());
  auto model = scene::build_brain_model(*inputs, progress);
  if (!model) return tl::unexpected(model.error());
  return Patient{std::move(*config), std::move(*model)};
}

// The true deformation: gravity with the fluid drained to the scenario's level, contact converged.
Result<Points> true_deformation(const Patient& patient, const Scenario& scenario,
                                const Progress& progress) {
  auto forward =
      contact::ForwardModel::build(patient.model, patient.config, Boundary::kContact, progress);
  if (!forward) return tl::unexpected(forward.error());
  report(progress, "solve with contact", 0.0);
  const Vec3 g = patient.model.gravity_direction;
  const Points load =
      fem::buoyancy_load(patient.model.mesh, patient.config.material, g,
                         patient.model.fluid_plane_depth_mm + scenario.fluid_level_mm, g);
  auto solution = forward->solve_with_contact(load);
  if (!solution) return tl::unexpected(solution.error());
  if (!solution->converged) {
    return fail(ErrorCode::kNotConverged,
                "scenario " + scenario.name + ": the contact search of the truth did not settle");
  }
  return std::move(solution->displacement);
}

io::ScorePoint score_point(const geometry::TetLocator& locator, const Vec3& x) {
  const geometry::TetLocation location = locator.locate(x);
  return {location.nodes, location.weights};
}

Vec3 value_at(const io::ScorePoint& point, const Points& u) {
  Vec3 value = Vec3::Zero();
  for (int k = 0; k < 4; ++k) value += point.weights[k] * u.col(point.nodes[k]);
  return value;
}

// Which tumour points are given (sparse) and which are kept to check (cross).
struct TumourPool {
  std::vector<io::ScorePoint> points;
  Points displacement;      // true, 3 x pool
  std::vector<int> sparse;  // indices into the pool
};

TumourPool make_pool(const BrainModel& model, const Points& truth, int sparse_points,
                     Random& random) {
  const geometry::TetLocator locator(model.mesh);
  TumourPool pool;
  pool.displacement.resize(3, model.tumour.num_vertices());
  for (int i = 0; i < model.tumour.num_vertices(); ++i) {
    pool.points.push_back(score_point(locator, model.tumour.vertices.col(i)));
    pool.displacement.col(i) = value_at(pool.points.back(), truth);
  }
  pool.sparse = random.choose(sparse_points, model.tumour.num_vertices());
  return pool;
}

io::SurgeryTruth make_truth(const BrainModel& model, const Scenario& scenario, const Points& truth,
                            const TumourPool& pool) {
  io::SurgeryTruth record;
  record.displacement = truth;
  const std::set<int> sparse(pool.sparse.begin(), pool.sparse.end());
  for (int i = 0; i < static_cast<int>(pool.points.size()); ++i) {
    record.points[sparse.count(i) ? "sparse" : "cross"].push_back(pool.points[i]);
  }
  for (NodeIndex node : model.craniotomy) {
    record.points["craniotomy"].push_back(
        {Eigen::Vector4i::Constant(node), Eigen::Vector4d(1, 0, 0, 0)});
  }
  record.scalars["fluid_level_mm"] = scenario.fluid_level_mm;
  record.scalars["noise_sd_mm"] = scenario.noise_sd_mm;
  record.scalars["max_displacement_mm"] = truth.colwise().norm().maxCoeff();
  record.scalars["tumour_displacement_mm"] = pool.displacement.colwise().norm().mean();
  return record;
}

Observation make_observation(const Patient& patient, const Scenario& scenario,
                             const TumourPool& pool, Random& random) {
  const TriangleSurface& tumour = patient.model.tumour;
  Observation observation;
  observation.case_id = patient.model.case_id;
  observation.source = "ius";
  observation.sequence = 1;
  if (scenario.measurement == Measurement::kDisplacements) {
    Points undeformed(3, static_cast<Eigen::Index>(pool.sparse.size()));
    Points displacement(3, undeformed.cols());
    for (Eigen::Index k = 0; k < undeformed.cols(); ++k) {
      const int i = pool.sparse[static_cast<std::size_t>(k)];
      undeformed.col(k) = tumour.vertices.col(i);
      displacement.col(k) = pool.displacement.col(i);
    }
    observation.body =
        measure_displacements(undeformed, displacement, scenario.noise_sd_mm, random);
  } else {
    Vec3 probe = Vec3::Zero();
    for (NodeIndex node : patient.model.craniotomy) probe += patient.model.mesh.nodes.col(node);
    probe /= static_cast<double>(patient.model.craniotomy.size());
    const TriangleSurface deformed{tumour.vertices + pool.displacement, tumour.triangles};
    observation.body = measure_probe_sections(deformed, probe, scenario, random);
  }
  return observation;
}

std::string utc_now() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

Status write_surgery(const SimulateOptions& options, const Patient& patient,
                     const Observation& observation, const io::SurgeryTruth& truth) {
  const std::map<std::string, std::string> meta = {
      {"case_id", patient.model.case_id},
      {"model_id", patient.model.model_id},
      {"case_file", std::filesystem::absolute(options.case_file).lexically_normal().string()},
      {"scenario", options.scenario},
      {"seed", std::to_string(options.seed)},
      {"created_utc", utc_now()},
      {"software", "brainshift twin"},
  };
  auto file = io::SurgeryFile::create(options.out, meta);
  if (!file) return tl::unexpected(file.error());
  Status status = file->append(
      {"observation", observation.sequence, observation.acquired_ns, wire::encode(observation)});
  if (status) status = file->write_truth(observation.sequence, truth);
  if (status) status = file->close();
  if (!status) {
    for (const char* suffix : {"", "-wal", "-shm"}) {
      std::error_code ignored;
      std::filesystem::remove(options.out.string() + suffix, ignored);
    }
  }
  return status;
}

}  // namespace

std::vector<ScenarioInfo> scenarios() {
  std::vector<ScenarioInfo> infos;
  for (const Scenario& scenario : all_scenarios())
    infos.push_back({scenario.name, scenario.description});
  return infos;
}

Status simulate(const SimulateOptions& options, const Progress& progress) {
  const Scenario* scenario = find_scenario(options.scenario);
  if (scenario == nullptr) {
    std::string known;
    for (const Scenario& each : all_scenarios()) known += (known.empty() ? "" : ", ") + each.name;
    return fail(ErrorCode::kNotFound,
                "scenario " + options.scenario + " is unknown; known: " + known);
  }
  if (std::filesystem::exists(options.out)) {
    return fail(ErrorCode::kWriteFailed, options.out.string() + ": exists already");
  }
  auto patient = load_patient(options.case_file, progress);
  if (!patient) return tl::unexpected(patient.error());
  auto truth = true_deformation(*patient, *scenario, progress);
  if (!truth) return tl::unexpected(truth.error());

  Random random(options.seed);
  const TumourPool pool = make_pool(patient->model, *truth, scenario->sparse_points, random);
  const Observation observation = make_observation(*patient, *scenario, pool, random);
  report(progress, "write", 0.0);
  return write_surgery(options, *patient, observation,
                       make_truth(patient->model, *scenario, *truth, pool));
}

}  // namespace brainshift::twin
