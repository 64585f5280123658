// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/contract/estimate_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/fem/elasticity.hpp"

namespace brainshift::inversion {

Status check_equilibrium(const CondensedOperators& operators, const std::vector<int>& slaves,
                         const VecX& penetration, const Points& displacement) {
  double worst = 0.0, largest = 0.0, there = 0.0;
  int worst_slave = -1;
  for (const int slave : slaves) {
    const NodeIndex node = operators.slaves[static_cast<std::size_t>(slave)];
    const double along = operators.slave_normals.col(slave).dot(displacement.col(node));
    const double field = operators.initial_penetration_mm[slave] - along;
    const double apart = std::abs(field - penetration[slave]);
    largest = std::max(largest, std::abs(along));
    if (apart <= worst) continue;
    worst = apart;
    worst_slave = slave;
    there = field;
  }
  if (worst <= kEquilibriumTolerance_mm + kEquilibriumRelative * largest) return {};
  char text[200];
  std::snprintf(text, sizeof text,
                "inversion: contact is not in equilibrium: node %d penetrates %g mm in the field, "
                "%g mm by its contact force",
                operators.slaves[static_cast<std::size_t>(worst_slave)], there,
                penetration[worst_slave]);
  return fail(ErrorCode::kNotConverged, text);
}

Status check_deformation(const fem::Deformation& deformation, Estimate& estimate) {
  if (std::isnan(deformation.min_volume_ratio)) {
    return fail(ErrorCode::kNotFinite, "inversion: the displacement is not finite");
  }
  estimate.min_volume_ratio = deformation.min_volume_ratio;
  estimate.min_nodal_volume_ratio = deformation.min_nodal_volume_ratio;
  estimate.inverted_elements = deformation.inverted;
  return {};
}

void append_warnings(const Estimate& estimate, double poisson_ratio, std::string& reason) {
  char text[160];
  if (estimate.inverted_elements > 0) {
    std::snprintf(text, sizeof text,
                  "; %d elements inverted (smallest volume ratio %.3g): no deformation of tissue",
                  estimate.inverted_elements, estimate.min_volume_ratio);
    reason.append(text);
  }
  if (poisson_ratio > fem::kLockingPoissonRatio) {
    std::snprintf(text, sizeof text,
                  "; linear elements lock at Poisson\'s ratio %g, above %g: displacement too small",
                  poisson_ratio, fem::kLockingPoissonRatio);
    reason.append(text);
  }
}

Status check_estimate(const TetMesh& mesh, const Material& material, Estimate& estimate) {
  const auto deformation = fem::measure_deformation(mesh, estimate.displacement);
  if (auto status = check_deformation(deformation, estimate); !status) return status;
  append_warnings(estimate, largest_poisson_ratio(material), estimate.reason);
  return {};
}

namespace {

// Sets flags and appends a clause for each.
class Judge {
 public:
  explicit Judge(QualityVerdict& verdict) : verdict_(verdict) {
    verdict_.flags = {};
    verdict_.reason.clear();
  }

  void set(QualityFlag flag) {
    verdict_.flags.set(flag);
    if (!verdict_.reason.empty()) verdict_.reason.append("; ");
    verdict_.reason.append(sentence(flag));
  }
  // figures: printf format and values, written in brackets behind the sentence.
  template <typename... Values>
  void set(QualityFlag flag, const char* figures, Values... values) {
    set(flag);
    char text[120];
    std::snprintf(text, sizeof text, figures, values...);
    verdict_.reason.append(" (").append(text).append(")");
  }

 private:
  QualityVerdict& verdict_;
};

bool finite(const MeanStd& value) { return std::isfinite(value.mean) && std::isfinite(value.std); }
// NaN: not computed.
bool finite_or_absent(double value) { return !std::isinf(value); }

bool finite(const PriorScaleValues& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

bool all_finite(const Estimate& estimate) {
  const ContactSummary& contact = estimate.contact;
  return estimate.displacement.allFinite() && estimate.sd_mm.allFinite() &&
         estimate.known.allFinite() && finite_or_absent(estimate.region_known) &&
         estimate.contact_force_n.allFinite() && std::isfinite(contact.max_penetration_mm) &&
         finite_or_absent(contact.decrement) && finite_or_absent(contact.max_violation_mm) &&
         finite(estimate.initial_misfit_mm) && finite(estimate.misfit_mm) &&
         finite_or_absent(estimate.misfit_ratio) && finite_or_absent(estimate.min_volume_ratio) &&
         finite_or_absent(estimate.min_nodal_volume_ratio) && finite(estimate.prior_scales) &&
         finite(estimate.prior_absent) &&
         std::all_of(
             estimate.hypotheses.begin(), estimate.hypotheses.end(),
             [](const Hypothesis& one) { return finite(one.scales) && std::isfinite(one.weight); });
}

void judge_algorithm(const Estimate& estimate, Judge& judge) {
  if (estimate.status == EstimateStatus::kDeadline) judge.set(QualityFlag::kDeadline);
  if (estimate.status == EstimateStatus::kIterationLimit) judge.set(QualityFlag::kIterationLimit);
  const ContactSummary& contact = estimate.contact;
  if (contact.decrement > kMaxContactDecrement ||
      contact.max_violation_mm > kMaxContactViolation_mm) {
    judge.set(QualityFlag::kContactNotCertified,
              "decrement %.2g, at most %g; violation %.2g mm, at most %g mm", contact.decrement,
              kMaxContactDecrement, contact.max_violation_mm, kMaxContactViolation_mm);
  }
}

void judge_data(const Estimate& estimate, Judge& judge) {
  if (estimate.region_known < kLeastKnown) {
    judge.set(QualityFlag::kMostlyPrior,
              "%.0f %% of its standard deviation before the data, at least %.0f %%",
              100.0 * estimate.region_known, 100.0 * kLeastKnown);
  }
  if (estimate.misfit_ratio > kUnexplainedMisfit) {
    judge.set(QualityFlag::kMisfitUnexplained, "%.2g standard deviations, at most %g",
              estimate.misfit_ratio, kUnexplainedMisfit);
  }
  const auto bound =
      std::find(estimate.prior_at_bound.begin(), estimate.prior_at_bound.end(), true);
  if (bound != estimate.prior_at_bound.end()) {
    const auto part = static_cast<PriorPart>(bound - estimate.prior_at_bound.begin());
    judge.set(QualityFlag::kStrengthAtBound, "%.40s", to_string(part).data());
  }
  const auto contradicts = std::find_if(estimate.sources.begin(), estimate.sources.end(),
                                        [](const SourceSummary& s) { return !s.consistent; });
  if (contradicts != estimate.sources.end()) {
    judge.set(QualityFlag::kSourcesContradict, "\"%.64s\"", contradicts->source.c_str());
  }
  if (estimate.data_outside_region > 0) {
    judge.set(QualityFlag::kDataOutsideRegion, "%d", estimate.data_outside_region);
  }
}

void judge_field(const Estimate& estimate, Judge& judge) {
  if (estimate.inverted_elements > 0) {
    judge.set(QualityFlag::kInvertedElements, "%d, smallest volume ratio %.2g",
              estimate.inverted_elements, estimate.min_volume_ratio);
  } else if (estimate.min_nodal_volume_ratio < kMinVolumeRatio) {
    judge.set(QualityFlag::kVolumeLost, "smallest volume ratio about a node %.2g, at least %g",
              estimate.min_nodal_volume_ratio, kMinVolumeRatio);
  }
  const Points& u = estimate.displacement;
  const double motion_mm = u.cols() > 0 ? std::sqrt(u.colwise().squaredNorm().maxCoeff()) : 0.0;
  const double depth_mm = estimate.contact.max_penetration_mm;
  if (motion_mm > kMaxMotion_mm || depth_mm > kDeepestInSkull_mm) {
    judge.set(QualityFlag::kBeyondSkull,
              "motion %.3g mm, at most %g mm; %.2g mm deep in the skull, at most %g mm", motion_mm,
              kMaxMotion_mm, depth_mm, kDeepestInSkull_mm);
  }
}

}  // namespace

void judge(const Estimate& estimate, QualityVerdict& verdict) {
  Judge judge(verdict);
  // What makes a field unusable comes first in the reason. Of numbers that are not finite, the
  // other rules would say nothing that holds.
  if (!all_finite(estimate)) {
    judge.set(QualityFlag::kNotFinite);
  } else {
    judge_field(estimate, judge);
    judge_data(estimate, judge);
    judge_algorithm(estimate, judge);
  }
  verdict.quality = verdict.flags.quality();
}

}  // namespace brainshift::inversion
