// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/simulate.hpp"

#include <fmt/format.h>

#include <utility>

#include "client/tools/twin/adverse.hpp"
#include "client/tools/twin/scenario.hpp"
#include "client/tools/twin/surgery.hpp"
#include "common/core/text.hpp"
#include "common/io/geometry/mesh_file.hpp"
#include "common/linalg/openblas.hpp"
#include "common/patient/read_patient.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::client {
namespace {

using patient::Patient;

Status write_surgery(const SimulateOptions& options, const std::string& scenario_name,
                     const Patient& patient, const SimulatedSurgery& surgery) {
  auto file = io::SurgeryFile::create(
      options.out, simulated_meta(patient.model, options.case_file, scenario_name, options.seed,
                                  "brainshift twin"));
  if (!file) return tl::unexpected(file.error());
  Status status;
  for (std::size_t i = 0; status && i < surgery.observations.size(); ++i) {
    const Observation& observation = surgery.observations[i];
    status = file->append({io::RecordKind::kObservation, observation.sequence,
                           observation.acquired_ns, wire::encode(observation)});
    if (status) status = file->write_truth(observation.sequence, surgery.truths[i]);
  }
  if (status) status = file->close();
  if (!status) io::discard_surgery(options.out);
  return status;
}

}  // namespace

io::SurgeryMeta simulated_meta(const BrainModel& model, const std::filesystem::path& case_file,
                               const std::string& scenario, std::uint64_t seed,
                               const std::string& software) {
  return {.case_id = model.case_id,
          .model_id = model.model_id,
          .case_file = std::filesystem::absolute(case_file).lexically_normal().string(),
          .scenario = scenario,
          .seed = seed,
          .created_utc = utc_now(),
          .software = software};
}

Result<Points> read_truth_field(const std::filesystem::path& path, const BrainModel& model) {
  const auto file = io::read_vtu(path);
  if (!file) return tl::unexpected(file.error());
  const Points& nodes = model.mesh.nodes;
  const auto refuse = [&](const std::string& what) {
    return invalid(path.string() + ": " + what + " (--truth: a field on the mesh of case " +
                   model.case_id + ")");
  };
  if (file->mesh.nodes.cols() != nodes.cols()) {
    return refuse(fmt::format("has {} points, the case's mesh has {} nodes",
                              file->mesh.nodes.cols(), nodes.cols()));
  }
  Eigen::Index worst = 0;
  const double apart = (file->mesh.nodes - nodes).colwise().norm().maxCoeff(&worst);
  if (!(apart <= kSameNode_mm)) {
    return refuse(fmt::format("its point {} lies {:.3g} mm beside the case's node", worst, apart));
  }
  for (const io::NodeField& field : file->node_fields) {
    if (field.name != "displacement") continue;
    if (field.values.rows() != 3) {
      return refuse(fmt::format("its point array displacement has {} components instead of 3",
                                field.values.rows()));
    }
    for (Eigen::Index i = 0; i < nodes.cols(); ++i) {
      if (!field.values.col(i).allFinite()) {
        return refuse(fmt::format("displacement of point {} is not finite", i));
      }
    }
    return Points(field.values);
  }
  return refuse("has no point array displacement");
}

Status simulate(const SimulateOptions& options, const Progress& progress) {
  const bool given = !options.truth.empty();
  const std::string name =
      given && options.scenario.empty() ? kInstrumentsOfTruth : options.scenario;
  const Scenario* scenario = find_scenario(name);
  if (scenario == nullptr) {
    std::string known;
    for (const Scenario& each : all_scenarios()) known += (known.empty() ? "" : ", ") + each.name;
    return fail(ErrorCode::kNotFound, "scenario " + name + " is unknown; known: " + known);
  }
  Ingredients ingredients;
  if (!options.adverse.empty()) {
    const auto named = ingredients_from(options.adverse);
    if (!named) return tl::unexpected(named.error());
    ingredients = *named;
  }
  if (given && !ingredients.empty()) {
    return invalid("--adverse " + options.adverse +
                   ": a truth that --truth gives has no ingredients");
  }
  if (std::filesystem::exists(options.out)) {
    return invalid(options.out.string() + ": exists already");
  }
  linalg::use_single_threaded_blas();  // before the first factorisation
  const auto patient = patient::read_patient(options.case_file, progress);
  if (!patient) return tl::unexpected(patient.error());
  const auto adverse =
      with_ingredients(*scenario, ingredients, patient->model.gravity_direction, options.seed);
  if (!adverse) return tl::unexpected(adverse.error());
  Result<Points> field = Points();
  if (given) field = read_truth_field(options.truth, patient->model);
  if (!field) return tl::unexpected(field.error());
  const auto surgery =
      given ? play_given(patient->model, patient->config, *adverse, std::move(*field), options.seed)
            : play_scenario(patient->model, patient->config, *adverse, options.seed, progress);
  if (!surgery) return tl::unexpected(surgery.error());
  report(progress, "write", 0.0);
  const std::string suffix = given                 ? "+truth"
                             : ingredients.empty() ? ""
                                                   : "+" + name_of(ingredients);
  return write_surgery(options, name + suffix, *patient, *surgery);
}

}  // namespace brainshift::client
