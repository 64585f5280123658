// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/evidence/evidence_patient.hpp"

#include <utility>

#include "common/core/stopwatch.hpp"
#include "tests/benchmarks/bench_head.hpp"
#include "tests/evidence/estimate_session.hpp"

namespace brainshift::evidence {
namespace {

using surgeries::Row;

// The paper's comparison: the case as it is, under both boundary conditions.
std::vector<Variant> boundaries() {
  Variant contact{"contact"}, fixed{"fixed", Anew::kOperators, Boundary::kFixed};
  return {contact, fixed};
}

class Patient {
 public:
  Patient(const PatientPlan& plan, const bench::Head& head)
      : plan_(plan), head_(head), twin_(head, plan.patient, plan.calculix) {}

  Status begin_sessions() {
    for (const Variant& variant : boundaries()) {
      auto session = begin_session(head_, variant);
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
    const auto played = twin_.play(truth, seed);
    if (!played) return tl::unexpected(played.error());
    if (!played->surgery) return std::vector<Row>{refused_row(figures, played->reason)};
    std::vector<Row> rows;
    for (EstimateSession& session : sessions_) {
      auto some = estimate_rows(head_, session, *played, figures);
      if (!some) return some;
      rows.insert(rows.end(), some->begin(), some->end());
    }
    return rows;
  }

 private:
  const PatientPlan& plan_;
  const bench::Head& head_;
  PatientTwin twin_;
  std::vector<EstimateSession> sessions_;
};

}  // namespace

Status play_patient(const PatientPlan& plan, surgeries::RowFile& rows, const Told& told) {
  const bench::MeshWish wish{plan.config.case_id, plan.thousand_nodes};
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
