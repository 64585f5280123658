// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/evidence/evidence_patient.hpp"

#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "client/replay/score.hpp"
#include "client/twin/surgery.hpp"
#include "common/core/stopwatch.hpp"
#include "common/inversion/prepared/condense.hpp"
#include "common/registration/icp.hpp"
#include "server/pipeline/pipeline.hpp"
#include "tests/benchmarks/bench_head.hpp"
#include "tests/evidence/calculix_truth.hpp"
#include "tests/surgeries/played_brain.hpp"
#include "tests/surgeries/surgery_score.hpp"

namespace brainshift::evidence {
namespace {

using surgeries::PlayedBrain;
using surgeries::Row;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
// What an update finds must not depend on what else the machine does; how long it took is a column.
constexpr double kNoDeadline_ms = 1e6;

// The true brains of one patient. Those that no seed changes are kept.
class PlayedBrains {
 public:
  explicit PlayedBrains(const bench::Head& head) : head_(head) {}

  Result<PlayedBrain*> of(const client::Scenario& scenario, std::uint64_t seed) {
    const client::Adversity& adverse = scenario.adverse;
    const BrainModel* other = nullptr;
    if (adverse.other_mesh) {
      if (!anew_) {
        auto anew = client::mesh_anew(head_.config);
        if (!anew) return tl::unexpected(anew.error());
        anew_ = std::move(*anew);
      }
      other = &*anew_;
    }
    const bool seeded = adverse.gap_seed || adverse.tissue_seed || adverse.penalty_factor != 1.0 ||
                        adverse.segmentation_sd_mm > 0.0;
    auto& kept = seeded ? latest_ : kept_[adverse.other_mesh];
    if (kept && !seeded) return kept.get();
    kept.reset();  // before the next one takes memory
    auto brain = client::truth_brain(*head_.model, head_.config, scenario, seed, other);
    if (!brain) return tl::unexpected(brain.error());
    auto made = surgeries::factorised(std::move(*brain));
    if (!made) return tl::unexpected(made.error());
    kept = std::move(*made);
    return kept.get();
  }

 private:
  const bench::Head& head_;
  std::optional<BrainModel> anew_;
  std::map<bool, std::unique_ptr<PlayedBrain>> kept_;
  std::unique_ptr<PlayedBrain> latest_;
};

// The daemon's pipeline under one boundary condition.
struct Session {
  Boundary boundary;
  std::shared_ptr<const inversion::PreparedModel> prepared;
  std::shared_ptr<const CondensedOperators> operators;
  std::unique_ptr<server::Pipeline> pipeline;
};

Result<Session> begin(const bench::Head& head, Boundary boundary) {
  Session session{boundary, head.prepared, head.operators, nullptr};
  if (boundary == Boundary::kFixed) {
    auto prepared = inversion::PreparedModel::prepare(head.model, head.config, boundary);
    if (!prepared) return tl::unexpected(prepared.error());
    session.prepared = std::make_shared<const inversion::PreparedModel>(std::move(*prepared));
    auto operators = inversion::condense(*session.prepared);
    if (!operators) return tl::unexpected(operators.error());
    session.operators = std::make_shared<const CondensedOperators>(std::move(*operators));
  }
  auto inverter = inversion::condensed_inverter(session.operators, head.locator, head.config);
  if (!inverter) return tl::unexpected(inverter.error());
  auto pipeline = server::Pipeline::build(head.model, head.config, Method::kCondensed, boundary,
                                          std::move(*inverter));
  if (!pipeline) return tl::unexpected(pipeline.error());
  session.pipeline = std::make_unique<server::Pipeline>(std::move(*pipeline));
  return session;
}

// Mean error at the tumour of the translation that brings the measured boundary onto its surface.
double shift_error(const BrainModel& model, const Observation& observation,
                   const io::SurgeryTruth& truth) {
  const auto* boundary = std::get_if<TumourBoundary>(&observation.body);
  const auto cross = truth.points.find("cross");
  if (boundary == nullptr || cross == truth.points.end()) return kNaN;
  const auto surface = geometry::ClosestPointIndex::build(model.tumour);
  if (!surface) return kNaN;
  registration::IcpOptions options;
  options.rotation = false;
  const auto fit =
      registration::align(boundary->points, *surface, RigidTransform::Identity(), options);
  if (!fit) return kNaN;
  const Vec3 shift = -fit->T_surface_points.translation();
  const Points errors = (-client::at_points(truth.displacement, cross->second)).colwise() + shift;
  return errors.colwise().norm().mean();
}

double direction_deg(const BrainModel& model, const Points& displacement) {
  const Vec3 direction = client::principal_direction(displacement);
  return direction.isZero() ? kNaN : client::angle_deg(direction, model.gravity_direction);
}

// The rows of one surgery under one boundary condition.
Result<std::vector<Row>> estimate(const bench::Head& head, Session& session,
                                  const client::SimulatedSurgery& surgery,
                                  EvidenceFigures figures) {
  figures.boundary = to_string(session.boundary);
  session.pipeline->reset();
  std::vector<Row> rows;
  for (std::size_t i = 0; i < surgery.observations.size(); ++i) {
    const io::SurgeryTruth& truth = surgery.truths[i];
    figures.data = data_name(static_cast<int>(i));
    const auto update = session.pipeline->run(surgery.observations[i]);
    if (!update) {
      rows.push_back(refused_row(figures, update.error().message));
      continue;
    }
    const Points& displacement = update->estimate.displacement;
    figures.direction_deg = direction_deg(*head.model, displacement);
    figures.true_direction_deg = direction_deg(*head.model, truth.displacement);
    const auto score = surgeries::score_update(*head.model, truth, update->estimate);
    if (!score) return tl::unexpected(score.error());
    rows.push_back(row_of(figures, truth, *update, *score));
  }
  return rows;
}

class Patient {
 public:
  Patient(const PatientPlan& plan, const bench::Head& head)
      : plan_(plan), head_(head), brains_(head) {}

  Status begin_sessions() {
    for (const Boundary boundary : {Boundary::kContact, Boundary::kFixed}) {
      auto session = begin(head_, boundary);
      if (!session) return tl::unexpected(session.error());
      sessions_.push_back(std::move(*session));
    }
    return {};
  }

  // Both boundary conditions over one surgery.
  Result<std::vector<Row>> play(const TruthKind& truth, std::uint64_t seed) {
    EvidenceFigures figures;
    figures.key = {plan_.head, plan_.patient, truth.name, seed};
    figures.nodes = head_.model->mesh.num_nodes();
    const client::Scenario* plain =
        client::find_scenario("patient-" + std::to_string(plan_.patient));
    const auto scenario =
        client::with_ingredients(*plain, truth.ingredients, head_.model->gravity_direction, seed);
    if (!scenario) return tl::unexpected(scenario.error());
    const auto played = brains_.of(*scenario, seed);
    if (!played) return tl::unexpected(played.error());
    const auto surgery = truth.calculix ? play_calculix(**played, *scenario, seed)
                                        : client::play_scenario((*played)->brain, (*played)->solver,
                                                                *scenario, seed);
    if (!surgery) {
      if (surgery.error().code != ErrorCode::kInvalidArgument) {
        return tl::unexpected(surgery.error());
      }
      return std::vector<Row>{refused_row(figures, surgery.error().message)};
    }
    figures.shift_tumour_mm =
        shift_error(*head_.model, surgery->observations[0], surgery->truths[0]);
    std::vector<Row> rows;
    for (Session& session : sessions_) {
      auto some = estimate(head_, session, *surgery, figures);
      if (!some) return some;
      rows.insert(rows.end(), some->begin(), some->end());
    }
    return rows;
  }

 private:
  // What instruments see of the displacement that CalculiX found under the patient's load.
  Result<client::SimulatedSurgery> play_calculix(const PlayedBrain& played,
                                                 client::Scenario scenario, std::uint64_t seed) {
    auto displacement = read_calculix_truth(plan_.calculix, plan_.patient, head_.model->mesh.nodes);
    if (!displacement) return tl::unexpected(displacement.error());
    GivenTruth given(std::move(*displacement), played.forward.contact());
    scenario.tumour_displacement_mm.reset();  // the load is what it was
    return client::play_scenario(played.brain, given, scenario, seed);
  }

  const PatientPlan& plan_;
  const bench::Head& head_;
  PlayedBrains brains_;
  std::vector<Session> sessions_;
};

}  // namespace

Status play_patient(const PatientPlan& plan, surgeries::RowFile& rows, const Told& told) {
  bench::MeshWish wish;
  wish.name = plan.config.case_id;
  wish.thousand_nodes = plan.thousand_nodes;
  CaseConfig config = plan.config;
  config.condensed.deadline_ms = kNoDeadline_ms;
  const auto head = bench::make_head(config, wish);
  if (!head) return tl::unexpected(head.error());
  Patient patient(plan, *head);
  if (Status ok = patient.begin_sessions(); !ok) return ok;
  for (const TruthKind& truth : plan.truths) {
    for (const std::uint64_t seed : plan.seeds) {
      if (rows.has(EvidenceKey{plan.head, plan.patient, truth.name, seed}.texts())) continue;
      const Stopwatch watch;
      const auto played = patient.play(truth, seed);
      if (!played) return fail(played.error().code, truth.name + ": " + played.error().message);
      if (Status ok = rows.append(*played); !ok) return ok;
      if (told) told(*played, watch.seconds());
    }
  }
  return {};
}

}  // namespace brainshift::evidence
