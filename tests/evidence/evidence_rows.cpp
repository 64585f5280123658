// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/evidence/evidence_rows.hpp"

#include <algorithm>

namespace brainshift::evidence {
namespace {

using surgeries::Cells;

void add_errors(const surgeries::UpdateScore& score, double shift_tumour_mm, Cells& cells) {
  cells.add("initial_mm", score.none.tumour_mm);
  cells.add("recovered_pct", score.recovered_pct);
  cells.add("tumour_mm", score.estimate.tumour_mm);
  cells.add("shift_tumour_mm", shift_tumour_mm);
  cells.add("rigid_tumour_mm", score.rigid.tumour_mm);
  cells.add("initial_cppd_mm", score.none.craniotomy_closest_mm);
  cells.add("cppd_mm", score.estimate.craniotomy_closest_mm);
  cells.add("rigid_cppd_mm", score.rigid.craniotomy_closest_mm);
  cells.add("initial_craniotomy_mm", score.none.craniotomy_mm);
  cells.add("craniotomy_mm", score.estimate.craniotomy_mm);
  cells.add("initial_field_mm", score.none.mean_mm);
  cells.add("field_mm", score.estimate.mean_mm);
  cells.add("field_max_mm", score.estimate.max_mm);
  cells.add("worse_nodes", score.worse_nodes);
  cells.add("worst_excess_mm", score.worst_excess_mm);
  for (std::size_t i = 0; i < surgeries::kIntervals.size(); ++i) {
    cells.add("coverage_" + std::to_string(surgeries::kIntervals[i].percent), score.coverage[i]);
  }
  cells.add("mean_sd_mm", score.mean_sd_mm);
}

void add_estimate(const Update& update, Cells& cells) {
  const Estimate& estimate = update.estimate;
  double contradictions = 0.0;
  for (const SourceSummary& source : estimate.sources) {
    contradictions += source.consistent ? 0.0 : 1.0;
  }
  cells.add("quality", std::string(to_string(estimate.quality.quality)));
  cells.add("contradictions", contradictions);
  cells.add("misfit_mm", estimate.misfit_mm.mean);
  cells.add("swelling_absent",
            estimate.prior_absent[static_cast<std::size_t>(PriorPart::kTumourVolume)]);
  cells.add("active", estimate.contact.active);
  cells.add("contact_sets", estimate.contact.iterations);
  cells.add("update_ms",
            update.timings.register_ms + update.timings.invert_ms + update.timings.rebuild_ms);
}

void add_truth(const io::SurgeryTruth& truth, Cells& cells) {
  for (const char* name :
       {"load_scale", "fluid_level_mm", "active_slaves", "max_displacement_mm", "truth_nodes"}) {
    const auto found = truth.scalars.find(name);
    cells.add(std::string("true_") + name, found == truth.scalars.end() ? 0.0 : found->second);
  }
}

}  // namespace

surgeries::RowFile::Key EvidenceKey::texts() const {
  return {head, std::to_string(patient), truth, std::to_string(seed)};
}

std::string data_name(int update) { return surgeries::stage_name(update); }

surgeries::Row row_of(const EvidenceFigures& figures, const io::SurgeryTruth& truth,
                      const Update& update, const surgeries::UpdateScore& score) {
  Cells cells;
  cells.add("head", figures.key.head);
  cells.add("patient", std::to_string(figures.key.patient));
  cells.add("truth", figures.key.truth);
  cells.add("seed", std::to_string(figures.key.seed));
  cells.add("boundary", figures.boundary);
  cells.add("data", figures.data);
  cells.add("status", std::string(to_string(update.estimate.status)));
  cells.add("reason", update.estimate.reason);
  cells.add("nodes", figures.nodes);
  add_errors(score, figures.shift_tumour_mm, cells);
  cells.add("direction_deg", figures.direction_deg);
  cells.add("true_direction_deg", figures.true_direction_deg);
  add_estimate(update, cells);
  add_truth(truth, cells);
  return cells.take();
}

surgeries::Row refused_row(const EvidenceFigures& figures, const std::string& reason) {
  surgeries::Row row = row_of(figures, {}, {}, {});
  const auto after =
      std::find_if(row.begin(), row.end(), [](const auto& one) { return one.first == "data"; });
  for (auto one = after + 1; one != row.end(); ++one) {
    one->second = one->first == "status"   ? "refused"
                  : one->first == "reason" ? surgeries::cell_text(reason)
                                           : "";
  }
  return row;
}

Result<surgeries::RowFile> open_evidence(const std::filesystem::path& path, bool resume) {
  return surgeries::RowFile::open(path, refused_row({}, ""), kEvidenceKey, resume);
}

}  // namespace brainshift::evidence
