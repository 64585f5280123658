// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/surgeries/surgery_score.hpp"

#include <limits>
#include <span>
#include <vector>

#include "client/tools/replay/score.hpp"
#include "common/core/statistics.hpp"
#include "common/registration/fiducials.hpp"

namespace brainshift::surgeries {
namespace {

constexpr double kNotScored = std::numeric_limits<double>::quiet_NaN();
constexpr double kNormalQuantile90 = 1.6448536269514722;

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

// The displacement of every node under the best rigid motion of the tumour's surface.
Result<Points> rigid_motion(const BrainModel& model, const io::SurgeryTruth& truth) {
  std::vector<io::ScorePoint> surface;
  for (const char* kind : {"sparse", "cross"}) {
    const auto found = truth.points.find(kind);
    if (found != truth.points.end()) {
      surface.insert(surface.end(), found->second.begin(), found->second.end());
    }
  }
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
    inside += (error.array().abs() <= kNormalQuantile90 * sd).count();
    for (std::size_t i = 0; i < within.size(); ++i) {
      within[i] += (error.array().abs() <= kIntervals[i].radius * sd).count();
    }
    sum += sd;
  }
  const auto count = static_cast<double>(nodes.size());
  score.coverage_90 = has_sd ? static_cast<double>(inside) / (3.0 * count) : kNotScored;
  for (std::size_t i = 0; i < within.size(); ++i) {
    score.coverage[i] = has_sd ? static_cast<double>(within[i]) / (3.0 * count) : kNotScored;
  }
  score.mean_sd_mm = has_sd ? sum / count : kNotScored;
}

}  // namespace

Result<UpdateScore> score_update(const BrainModel& model, const io::SurgeryTruth& truth,
                                 const Estimate& estimate) {
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
  return score;
}

}  // namespace brainshift::surgeries
