// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/evidence/estimate_session.hpp"

#include <limits>
#include <utility>

#include "client/tools/replay/score.hpp"
#include "common/inversion/prepared/condense.hpp"
#include "tests/surgeries/surgery_rows.hpp"

namespace brainshift::evidence {
namespace {

using surgeries::Row;

double direction_deg(const BrainModel& model, const Points& displacement) {
  const Vec3 direction = client::principal_direction(displacement);
  return direction.isZero() ? std::numeric_limits<double>::quiet_NaN()
                            : client::angle_deg(direction, model.gravity_direction);
}

}  // namespace

Result<EstimateSession> begin_session(const bench::Head& head, const Variant& variant) {
  EstimateSession session{variant, head.prepared, head.operators, nullptr};
  CaseConfig config = head.config;
  if (variant.change && variant.anew != Anew::kMesh) variant.change(config);
  if (Status ok = validate(config); !ok) return tl::unexpected(ok.error());
  if (variant.anew == Anew::kOperators) {
    auto prepared = inversion::PreparedModel::prepare(head.model, config, variant.boundary);
    if (!prepared) return tl::unexpected(prepared.error());
    session.prepared = std::make_shared<const inversion::PreparedModel>(std::move(*prepared));
    auto operators = inversion::condense(*session.prepared);
    if (!operators) return tl::unexpected(operators.error());
    session.operators = std::make_shared<const CondensedOperators>(std::move(*operators));
  }
  auto inverter = inversion::condensed_inverter(session.operators, head.locator, config);
  if (!inverter) return tl::unexpected(inverter.error());
  auto pipeline = pipeline::Pipeline::build(*head.model, config, Method::kCondensed,
                                            variant.boundary, std::move(*inverter));
  if (!pipeline) return tl::unexpected(pipeline.error());
  session.pipeline = std::make_unique<pipeline::Pipeline>(std::move(*pipeline));
  return session;
}

Result<std::vector<Row>> estimate_rows(const bench::Head& head, EstimateSession& session,
                                       const PlayedSurgery& played, EvidenceFigures figures) {
  if (!played.surgery) return std::vector<Row>{refused_row(figures, played.reason)};
  const client::SimulatedSurgery& surgery = *played.surgery;
  figures.shift_tumour_mm = played.shift_tumour_mm;
  figures.boundary = to_string(session.variant.boundary);
  session.pipeline->reset();
  std::vector<Row> rows;
  for (std::size_t i = 0; i < surgery.observations.size(); ++i) {
    const io::SurgeryTruth& truth = surgery.truths[i];
    if (session.variant.has_seen && !session.variant.has_seen(surgery.observations[i])) continue;
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

}  // namespace brainshift::evidence
