// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/surgeries/surgery_rows.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>

#include "client/tools/replay/score.hpp"
#include "common/core/statistics.hpp"
#include "common/registration/fiducials.hpp"

namespace brainshift::surgeries {
namespace {

constexpr double kNotScored = std::numeric_limits<double>::quiet_NaN();

// Nodes of tissue, ascending.
std::vector<int> tissue_nodes(const io::SurgeryTruth& truth) {
  std::vector<char> removed(static_cast<std::size_t>(truth.displacement.cols()), 0);
  if (const auto cavity = truth.points.find("removed"); cavity != truth.points.end()) {
    for (const io::ScorePoint& point : cavity->second) {
      removed[static_cast<std::size_t>(point.nodes[0])] = 1;
    }
  }
  std::vector<int> nodes;
  for (std::size_t i = 0; i < removed.size(); ++i) {
    if (removed[i] == 0) nodes.push_back(static_cast<int>(i));
  }
  return nodes;
}

Result<FieldErrors> errors_of(const BrainModel& model, const io::SurgeryTruth& truth,
                              const std::vector<int>& nodes, const Points& displacement) {
  Estimate estimate;
  estimate.displacement = displacement;
  client::RunReport run;
  if (Status ok = client::score(model, truth, estimate, run); !ok) {
    return tl::unexpected(ok.error());
  }
  FieldErrors errors;
  errors.tumour_mm = run.error_mm.cross ? run.error_mm.cross->mean : kNotScored;
  errors.craniotomy_mm = run.error_mm.craniotomy_displacement
                             ? run.error_mm.craniotomy_displacement->mean
                             : kNotScored;
  errors.craniotomy_closest_mm =
      run.error_mm.craniotomy ? run.error_mm.craniotomy->mean : kNotScored;
  const VecX each =
      (displacement - truth.displacement)(Eigen::all, nodes).colwise().norm().transpose();
  errors.mean_mm = each.mean();
  errors.p50_mm = percentile(std::span(each.data(), static_cast<std::size_t>(each.size())), 50);
  errors.max_mm = each.maxCoeff();
  return errors;
}

// The tumour's outline as far as an instrument sees it.
std::vector<io::ScorePoint> outline(const io::SurgeryTruth& truth) {
  std::vector<io::ScorePoint> surface;
  for (const char* kind : {"sparse", "cross"}) {
    const auto found = truth.points.find(kind);
    if (found != truth.points.end()) {
      surface.insert(surface.end(), found->second.begin(), found->second.end());
    }
  }
  return surface;
}

// The displacement of every node under the best rigid motion of the tumour's surface.
Result<Points> rigid_motion(const BrainModel& model, const io::SurgeryTruth& truth) {
  const std::vector<io::ScorePoint> surface = outline(truth);
  const Points before = client::at_points(model.mesh.nodes, surface);
  const Points after = before + client::at_points(truth.displacement, surface);
  const auto fit = registration::register_fiducials(before, after);
  if (!fit) return tl::unexpected(fit.error());
  return Points((fit->T_image_measured * model.mesh.nodes) - model.mesh.nodes);
}

void score_intervals(const io::SurgeryTruth& truth, const std::vector<int>& nodes,
                     const Estimate& estimate, UpdateScore& score) {
  const bool has_sd = estimate.sd_mm.size() == estimate.displacement.cols();
  long inside = 0;
  std::array<long, kIntervals.size()> within = {};
  double sum = 0.0;
  score.worst_excess_mm = -std::numeric_limits<double>::infinity();
  for (const int node : nodes) {
    const Vec3 error = estimate.displacement.col(node) - truth.displacement.col(node);
    const double sd = has_sd ? estimate.sd_mm[node] : 0.0;
    const double excess = error.norm() - truth.displacement.col(node).norm() - kRadius90 * sd;
    score.worse_nodes += excess > 0.0 ? 1 : 0;
    score.worst_excess_mm = std::max(score.worst_excess_mm, excess);
    inside += (error.array().abs() <= kNormalQuantile95 * sd).count();
    for (std::size_t i = 0; i < within.size(); ++i) {
      within[i] += (error.array().abs() <= kIntervals[i].radius * sd).count();
    }
    sum += sd;
  }
  const double band = simultaneous_radius(static_cast<long>(nodes.size()));
  for (const int node : nodes) {
    const double error = (estimate.displacement.col(node) - truth.displacement.col(node)).norm();
    const double sd = has_sd ? estimate.sd_mm[node] : 0.0;
    score.beyond_band += error - truth.displacement.col(node).norm() > band * sd ? 1 : 0;
  }
  const auto count = static_cast<double>(nodes.size());
  score.coverage_90 = has_sd ? static_cast<double>(inside) / (3.0 * count) : kNotScored;
  for (std::size_t i = 0; i < within.size(); ++i) {
    score.coverage[i] = has_sd ? static_cast<double>(within[i]) / (3.0 * count) : kNotScored;
  }
  score.mean_sd_mm = has_sd ? sum / count : kNotScored;
}

void score_known(const io::SurgeryTruth& truth, const Estimate& estimate,
                 const std::vector<int>& near, const std::vector<int>& far, UpdateScore& score) {
  score.near_known = score.far_known = score.far_unmarked_mm = kNotScored;
  const VecX& known = estimate.known;
  if (known.size() != estimate.displacement.cols()) return;
  if (!near.empty()) score.near_known = known(near).mean();
  if (!far.empty()) score.far_known = known(far).mean();
  double squares = 0.0, count = 0.0;
  for (const int node : far) {
    if (known[node] < kLeastKnown) continue;
    squares += (estimate.displacement.col(node) - truth.displacement.col(node)).squaredNorm();
    ++count;
  }
  score.far_unmarked_mm = count > 0.0 ? std::sqrt(squares / count) : 0.0;
}

void score_regions(const BrainModel& model, const io::SurgeryTruth& truth,
                   const std::vector<int>& nodes, const Estimate& estimate, int stage,
                   UpdateScore& score) {
  Points places = client::at_points(model.mesh.nodes, outline(truth));
  if (stage > 0) {
    Points both(3, places.cols() + static_cast<Eigen::Index>(model.craniotomy.size()));
    both << places, model.mesh.nodes(Eigen::all, model.craniotomy);
    places = std::move(both);
  }
  const std::vector<int> near = nodes_near(model.mesh.nodes, nodes, places, kNear_mm);
  std::vector<int> far, opened = model.craniotomy, cortex;
  std::set_difference(nodes.begin(), nodes.end(), near.begin(), near.end(),
                      std::back_inserter(far));
  std::sort(opened.begin(), opened.end());
  std::set_intersection(nodes.begin(), nodes.end(), opened.begin(), opened.end(),
                        std::back_inserter(cortex));
  const auto of = [&](const std::vector<int>& some) {
    return score_region(estimate.displacement, truth.displacement, estimate.sd_mm, some);
  };
  score.all = of(nodes);
  score.near = of(near);
  score.far = of(far);
  score.cortex = of(cortex);
  score_known(truth, estimate, near, far, score);
}

constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

void add_errors(const std::string& prefix, const FieldErrors& errors, Cells& cells) {
  cells.add(prefix + "tumour_mm", errors.tumour_mm);
  cells.add(prefix + "craniotomy_mm", errors.craniotomy_mm);
  cells.add(prefix + "craniotomy_closest_mm", errors.craniotomy_closest_mm);
  cells.add(prefix + "field_mean_mm", errors.mean_mm);
  cells.add(prefix + "field_p50_mm", errors.p50_mm);
  cells.add(prefix + "field_max_mm", errors.max_mm);
}

void add_region(const std::string& prefix, const RegionScore& score, Cells& cells) {
  cells.add(prefix + "nodes", score.nodes);
  cells.add(prefix + "error_mm", score.error_mm);
  cells.add(prefix + "none_mm", score.none_mm);
  cells.add(prefix + "coverage_90", score.coverage_90);
  cells.add(prefix + "interval_mm", score.interval_mm);
  cells.add(prefix + "crps_mm", score.crps_mm);
  cells.add(prefix + "rms_sd_mm", score.rms_sd_mm);
  cells.add(prefix + "rms_error_mm", score.rms_error_mm);
  for (std::size_t i = 0; i < kIntervals.size(); ++i) {
    if (kIntervals[i].percent == 90) continue;
    cells.add(prefix + "coverage_" + std::to_string(kIntervals[i].percent), score.coverage[i]);
  }
}

void add_key(const SurgeryFacts& facts, int stage, Cells& cells) {
  cells.add("head", facts.key.head);
  cells.add("place", facts.key.place);
  cells.add("patient_seed", std::to_string(facts.patient_seed));
  cells.add("seed", std::to_string(facts.key.seed));
  cells.add("scenario", facts.key.scenario);
  cells.add("stage", stage_name(stage));
}

void add_truth(const SurgeryFacts& facts, const client::Scenario& scenario,
               const io::SurgeryTruth& truth, Cells& cells) {
  const auto scalar = [&](const char* name) {
    const auto found = truth.scalars.find(name);
    return found == truth.scalars.end() ? 0.0 : found->second;
  };
  cells.add("nodes", facts.nodes);
  cells.add("slaves", facts.slaves);
  cells.add("fluid_level_mm", scalar("fluid_level_mm"));
  cells.add("gravity_turn_deg", scenario.gravity_turn_deg.norm());
  cells.add("swelling_strain", scenario.swelling.volume_strain);
  cells.add("volume_strain", scenario.volume.strain);
  cells.add("one_hemisphere", scenario.volume.one_hemisphere ? 1.0 : 0.0);
  cells.add("resected_fraction", scalar("resected_fraction"));
  cells.add("removed_nodes", scalar("removed_nodes"));
  cells.add("true_active", scalar("active_slaves"));
  cells.add("true_max_mm", scalar("max_displacement_mm"));
  for (const char* name : {"outside", "load_scale", "volume_loss"}) cells.add(name, scalar(name));
}

void add_score(const UpdateScore& score, Cells& cells) {
  cells.add("recovered_pct", score.recovered_pct);
  add_errors("", score.estimate, cells);
  add_errors("none_", score.none, cells);
  add_errors("rigid_", score.rigid, cells);
  cells.add("worse_nodes", score.worse_nodes);
  cells.add("worst_excess_mm", score.worst_excess_mm);
  cells.add("coverage_90", score.coverage_90);
  cells.add("mean_sd_mm", score.mean_sd_mm);
  cells.add("beyond_band", score.beyond_band);
  add_region("all_", score.all, cells);
  add_region("near_", score.near, cells);
  add_region("far_", score.far, cells);
  add_region("cortex_", score.cortex, cells);
  cells.add("near_known", score.near_known);
  cells.add("far_known", score.far_known);
  cells.add("far_unmarked_mm", score.far_unmarked_mm);
}

std::string flag_names(const QualityFlags& flags) {
  std::string names;
  for (const QualityFlag flag : kAllQualityFlags) {
    if (flags.has(flag)) names.append(names.empty() ? "" : ";").append(to_string(flag));
  }
  return names;
}

void add_quality(const Estimate& estimate, Cells& cells) {
  double contradictions = 0.0, outliers = 0.0, data = 0.0, least_p = 1.0;
  for (const SourceSummary& source : estimate.sources) {
    contradictions += source.consistent ? 0.0 : 1.0;
    outliers += source.outliers;
    data += source.data;
    if (source.p_value < least_p) least_p = source.p_value;
  }
  cells.add("quality", std::string(to_string(estimate.quality.quality)));
  cells.add("flags", flag_names(estimate.quality.flags));
  cells.add("quality_reason", estimate.quality.reason);
  cells.add("inverted", estimate.inverted_elements);
  cells.add("min_volume_ratio", estimate.min_volume_ratio);
  cells.add("sources", static_cast<double>(estimate.sources.size()));
  cells.add("contradictions", contradictions);
  cells.add("least_p_value", least_p);
  cells.add("data", data);
  cells.add("outliers", outliers);
  cells.add("outside_region", estimate.data_outside_region);
  cells.add("misfit_mm", estimate.misfit_mm.mean);
  cells.add("misfit_ratio", estimate.misfit_ratio);
  cells.add("active", estimate.contact.active);
  cells.add("contact_sets", estimate.contact.iterations);
  cells.add("contact_decrement", estimate.contact.decrement);
  cells.add("contact_violation_mm", estimate.contact.max_violation_mm);
}

void add_prior(const Estimate& estimate, Cells& cells) {
  cells.add("hypotheses", static_cast<double>(estimate.hypotheses.size()));
  for (int i = 0; i < kPriorParts; ++i) {
    const auto part = static_cast<std::size_t>(i);
    const std::string name(to_string(static_cast<PriorPart>(i)));
    cells.add("scale_" + name, estimate.prior_scales[part]);
    cells.add("absent_" + name, estimate.prior_absent[part]);
    cells.add("at_bound_" + name, estimate.prior_at_bound[part] ? 1.0 : 0.0);
  }
}

}  // namespace

Result<UpdateScore> score_update(const BrainModel& model, const io::SurgeryTruth& truth,
                                 const Estimate& estimate, int stage) {
  const std::vector<int> nodes = tissue_nodes(truth);
  const auto rigid_field = rigid_motion(model, truth);
  if (!rigid_field) return tl::unexpected(rigid_field.error());
  const auto of_estimate = errors_of(model, truth, nodes, estimate.displacement);
  if (!of_estimate) return tl::unexpected(of_estimate.error());
  const auto none = errors_of(model, truth, nodes, Points::Zero(3, truth.displacement.cols()));
  if (!none) return tl::unexpected(none.error());
  const auto rigid = errors_of(model, truth, nodes, *rigid_field);
  if (!rigid) return tl::unexpected(rigid.error());
  UpdateScore score;
  score.estimate = *of_estimate;
  score.none = *none;
  score.rigid = *rigid;
  score.recovered_pct = 100.0 * (1.0 - of_estimate->tumour_mm / none->tumour_mm);
  score_intervals(truth, nodes, estimate, score);
  score_regions(model, truth, nodes, estimate, stage, score);
  return score;
}

RowFile::Key SurgeryKey::texts() const {
  return {head, std::to_string(place), std::to_string(seed), scenario};
}

std::string stage_name(int update) {
  return update == 0 ? "tumour" : update == 1 ? "tumour+cortex" : "tumour+cortex+tracks";
}

Row row_of(const SurgeryFacts& facts, const client::Scenario& scenario,
           const io::SurgeryTruth& truth, int stage, const Update& update, const UpdateScore& score,
           double warm_cold_mm) {
  const StageTimings& time = update.timings;
  Cells cells;
  add_key(facts, stage, cells);
  cells.add("status", std::string(to_string(update.estimate.status)));
  cells.add("reason", update.estimate.reason);
  add_score(score, cells);
  add_quality(update.estimate, cells);
  add_prior(update.estimate, cells);
  cells.add("update_ms", time.register_ms + time.invert_ms + time.rebuild_ms);
  cells.add("t_solve_ms", facts.full_solve_ms);
  cells.add("warm_cold_mm", warm_cold_mm);
  add_truth(facts, scenario, truth, cells);
  return cells.take();
}

Row refused_row(const SurgeryFacts& facts, int stage, const std::string& reason) {
  Row row = row_of(facts, {}, {}, stage, {}, {}, kNotMeasured);
  for (auto& [name, text] : row) {
    if (name == "status") text = "refused";
    if (name == "reason") text = cell_text(reason);
  }
  const auto after =
      std::find_if(row.begin(), row.end(), [](const auto& one) { return one.first == "reason"; });
  for (auto one = after + 1; one != row.end(); ++one) one->second.clear();
  return row;
}

Result<RowFile> open_surgeries(const std::filesystem::path& path, bool resume) {
  return RowFile::open(path, refused_row({}, 0, ""), kSurgeryKey, resume);
}

}  // namespace brainshift::surgeries
