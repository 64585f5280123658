// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/replay/score.hpp"

#include <cmath>
#include <numbers>
#include <span>
#include <string>

#include "common/core/small_matrices.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/geometry/surface.hpp"
#include "common/registration/surface_distances.hpp"

namespace brainshift::client {
namespace {

constexpr double kFieldErrorLimitPct = 5.0;  // "the majority (>99 %) were less than 5 %", paper 3.1

const std::vector<io::ScorePoint>* points_of_kind(const io::SurgeryTruth& truth, const char* kind) {
  const auto found = truth.points.find(kind);
  if (found == truth.points.end() || found->second.empty()) return nullptr;
  return &found->second;
}

Status check_point(const io::ScorePoint& point, int nodes, const std::string& where) {
  if (point.nodes.minCoeff() < 0 || point.nodes.maxCoeff() >= nodes) {
    return fail(ErrorCode::kUnreadable,
                where + ": node " +
                    std::to_string(point.nodes.minCoeff() < 0 ? point.nodes.minCoeff()
                                                              : point.nodes.maxCoeff()) +
                    " is outside the mesh of " + std::to_string(nodes) + " nodes");
  }
  if (!(std::abs(point.weights.sum() - 1.0) < 1e-6)) {
    return fail(ErrorCode::kUnreadable,
                where + ": weights sum to " + std::to_string(point.weights.sum()) + ", not 1");
  }
  return {};
}

std::optional<double> recovery(const std::optional<MeanStd>& before,
                               const std::optional<MeanStd>& after) {
  if (!before || !after || !(before->mean > 0.0)) return std::nullopt;
  return 100.0 * (1.0 - after->mean / before->mean);
}

Status score_craniotomy(const BrainModel& model, const io::SurgeryTruth& truth,
                        const Points& displacement, RunErrors& error) {
  const auto* points = points_of_kind(truth, "craniotomy");
  if (points == nullptr) return {};
  const Points moved_truly = at_points(truth.displacement, *points);
  const Points moved = at_points(displacement, *points);
  error.craniotomy_displacement_initial = mean_std_of_norms(moved_truly);
  error.craniotomy_displacement = mean_std_of_norms(moved - moved_truly);

  std::vector<NodeIndex> node_of_vertex;
  TriangleSurface deformed =
      geometry::surface_of(model.mesh.nodes, model.boundary_triangles, &node_of_vertex);
  deformed.vertices += truth.displacement(Eigen::all, node_of_vertex);
  const auto surface = geometry::ClosestPointIndex::build(deformed);
  if (!surface) return tl::unexpected(surface.error());
  const Points undeformed = at_points(model.mesh.nodes, *points);
  using registration::mismatch;
  using registration::signed_projection_distance;
  error.craniotomy_initial = mismatch(signed_projection_distance(undeformed, *surface));
  error.craniotomy = mismatch(signed_projection_distance(undeformed + moved, *surface));
  return {};
}

void score_field(const Points& truth, const Points& displacement, RunReport& run) {
  const double largest = truth.cols() == 0 ? 0.0 : truth.colwise().norm().maxCoeff();
  run.largest_true_displacement_mm = largest;
  if (!(largest > 0.0)) return;
  const VecX error_pct = 100.0 / largest * (displacement - truth).colwise().norm().transpose();
  const std::span<const double> values(error_pct.data(),
                                       static_cast<std::size_t>(error_pct.size()));
  run.field_error_pct =
      FieldError{percentile(values, 50), percentile(values, 99), error_pct.maxCoeff()};
  run.share_below_5_pct = 100.0 *
                          static_cast<double>((error_pct.array() < kFieldErrorLimitPct).count()) /
                          static_cast<double>(error_pct.size());
}

std::optional<double> coverage_90(const Points& error, const VecX& sd_mm) {
  if (sd_mm.size() != error.cols() || error.cols() == 0) return std::nullopt;
  Eigen::Index inside = 0;
  for (Eigen::Index i = 0; i < error.cols(); ++i) {
    inside += (error.col(i).array().abs() <= kNormalQuantile90 * sd_mm(i)).count();
  }
  return static_cast<double>(inside) / static_cast<double>(error.size());
}

void describe_prior(const Estimate& estimate, RunReport& run) {
  run.prior_strengths.clear();
  for (std::size_t part = 0; part < kPriorParts; ++part) {
    run.prior_strengths.push_back({std::string(to_string(static_cast<PriorPart>(part))),
                                   estimate.prior_scales[part], estimate.prior_absent[part],
                                   estimate.prior_at_bound[part]});
  }
  run.hypotheses.clear();
  for (const Hypothesis& hypothesis : estimate.hypotheses) {
    WeightedStrengths& entry = run.hypotheses.emplace_back();
    entry.weight = hypothesis.weight;
    for (std::size_t part = 0; part < kPriorParts; ++part) {
      entry.scales[run.prior_strengths[part].part] = hypothesis.scales[part];
    }
  }
}

std::optional<double> angle_to_gravity(const Points& displacement, const Vec3& gravity) {
  const Vec3 direction = principal_direction(displacement);
  if (direction.isZero() || gravity.isZero()) return std::nullopt;
  return angle_deg(direction, gravity);
}

}  // namespace

Status check_truth(const io::SurgeryTruth& truth, int nodes) {
  if (truth.displacement.cols() != nodes) {
    return fail(ErrorCode::kUnreadable, "truth_field: holds " +
                                            std::to_string(truth.displacement.cols()) +
                                            " nodes, the model has " + std::to_string(nodes));
  }
  if (!truth.displacement.allFinite()) {
    return fail(ErrorCode::kUnreadable, "truth_field: holds a value that is not finite");
  }
  for (const auto& [kind, points] : truth.points) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::string where = "truth_point: " + kind + " " + std::to_string(i);
      if (Status ok = check_point(points[i], nodes, where); !ok) return ok;
    }
  }
  return {};
}

Result<std::optional<io::SurgeryTruth>> read_truth(const io::SurgeryFile& surgery,
                                                   std::uint64_t observation_sequence,
                                                   const BrainModel& model) {
  Result<io::SurgeryTruth> truth = surgery.read_truth(observation_sequence);
  if (!truth && truth.error().code == ErrorCode::kNotFound)
    return std::optional<io::SurgeryTruth>();
  if (!truth) return tl::unexpected(truth.error());
  if (Status ok = check_truth(*truth, model.mesh.num_nodes()); !ok) {
    return tl::unexpected(ok.error());
  }
  return std::optional<io::SurgeryTruth>(std::move(*truth));
}

Points at_points(const Points& nodal, const std::vector<io::ScorePoint>& points) {
  Points values(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    Vec3 value = Vec3::Zero();
    for (int k = 0; k < 4; ++k) value += points[i].weights(k) * nodal.col(points[i].nodes(k));
    values.col(static_cast<Eigen::Index>(i)) = value;
  }
  return values;
}

std::optional<MeanStd> cross_error(const io::SurgeryTruth& truth, const Points& displacement) {
  const auto* points = points_of_kind(truth, "cross");
  if (points == nullptr || displacement.cols() != truth.displacement.cols()) return std::nullopt;
  return mean_std_of_norms(at_points(displacement - truth.displacement, *points));
}

void describe(const BrainModel& model, const Estimate& estimate, RunReport& run) {
  run.status = to_string(estimate.status);
  run.reason = estimate.reason;
  run.contact = estimate.contact;
  if (!std::isnan(estimate.region_known)) run.region_known = estimate.region_known;
  if (!std::isnan(estimate.ventricle_change_mm3)) {
    run.ventricle_change_cc = estimate.ventricle_change_mm3 / 1000.0;
  }
  run.error_mm.sparse_initial = estimate.initial_misfit_mm;
  run.error_mm.sparse = estimate.misfit_mm;
  run.principal_direction_deg = angle_to_gravity(estimate.displacement, model.gravity_direction);
  describe_prior(estimate, run);
}

Status score(const BrainModel& model, const io::SurgeryTruth& truth, const Estimate& estimate,
             RunReport& run) {
  const Points& displacement = estimate.displacement;
  if (displacement.cols() != truth.displacement.cols()) {
    return fail(ErrorCode::kProtocol,
                "update: displacement holds " + std::to_string(displacement.cols()) +
                    " nodes, the model has " + std::to_string(truth.displacement.cols()));
  }
  if (const auto* cross = points_of_kind(truth, "cross"); cross != nullptr) {
    run.error_mm.initial = mean_std_of_norms(at_points(truth.displacement, *cross));
    run.error_mm.cross = cross_error(truth, displacement);
  }
  if (Status ok = score_craniotomy(model, truth, displacement, run.error_mm); !ok) return ok;
  run.recovery_pct = recovery(run.error_mm.initial, run.error_mm.cross);
  run.craniotomy_recovery_pct = recovery(run.error_mm.craniotomy_initial, run.error_mm.craniotomy);
  run.craniotomy_displacement_recovery_pct =
      recovery(run.error_mm.craniotomy_displacement_initial, run.error_mm.craniotomy_displacement);
  score_field(truth.displacement, displacement, run);
  run.coverage_90 = coverage_90(displacement - truth.displacement, estimate.sd_mm);
  run.principal_direction_true_deg = angle_to_gravity(truth.displacement, model.gravity_direction);
  run.truth_scalars = truth.scalars;
  return {};
}

Vec3 principal_direction(const Points& displacements) {
  if (displacements.cols() == 0) return Vec3::Zero();
  const Vec3 mean = displacements.rowwise().mean();
  const Points centred = displacements.colwise() - mean;
  const Mat3 covariance = centred * centred.transpose() / static_cast<double>(centred.cols());
  // Rounding alone spreads equal vectors by about (1e-16 |mean|)^2.
  if (!(covariance.trace() > 1e-24 * mean.squaredNorm())) return Vec3::Zero();
  const SymmetricEigen<3> eigen = symmetric_eigen(covariance);
  const Vec3 direction = eigen.vectors.col(2);  // eigenvalues ascend
  return direction.dot(mean) < 0.0 ? Vec3(-direction) : direction;
}

double angle_deg(const Vec3& a, const Vec3& b) {
  // atan2 keeps its accuracy near 0 and 180 degrees, where acos loses half of the digits.
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / std::numbers::pi;
}

}  // namespace brainshift::client
