// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/reason.hpp"

#include <cstdio>
#include <string_view>

#include "common/configuration/case_config.hpp"
#include "common/inversion/condensed/load_descent.hpp"
#include "common/values/quality.hpp"

namespace brainshift::inversion {

void set_reason(EstimateStatus outcome, double deadline_ms, Estimate& estimate) {
  const ContactSummary& contact = estimate.contact;
  std::string& reason = estimate.reason;
  char text[240];
  switch (outcome) {
    case EstimateStatus::kConverged:
      std::snprintf(text, sizeof text, "loads and contact settled in %d steps", contact.iterations);
      break;
    case EstimateStatus::kDeadline:
      std::snprintf(text, sizeof text,
                    "deadline of %g ms reached after %d steps; best iterate returned, %.2g "
                    "standard deviations from its minimum",
                    deadline_ms, contact.iterations, contact.decrement);
      break;
    default:
      if (contact.decrement <= kDecrement) {
        std::snprintf(
            text, sizeof text,
            "weights or places of the data did not settle; loads and contact did, in %d steps",
            contact.iterations);
        break;
      }
      std::snprintf(text, sizeof text,
                    "loads did not settle in %d steps; best iterate returned, %.2g standard "
                    "deviations from its minimum",
                    contact.iterations, contact.decrement);
  }
  reason.assign(text);
  if (estimate.misfit_ratio > kUnexplainedMisfit) {
    std::snprintf(text, sizeof text,
                  "; the prior does not explain the data: they lie %.1f standard deviations off",
                  estimate.misfit_ratio);
    reason.append(text);
  }
  for (std::size_t part = 0; part < estimate.prior_at_bound.size(); ++part) {
    if (!estimate.prior_at_bound[part]) continue;
    const std::string_view name = to_string(static_cast<PriorPart>(part));
    std::snprintf(text, sizeof text, "; the strength of %.*s is at its bound, %g times the case's",
                  static_cast<int>(name.size()), name.data(), kLargestStrength);
    reason.append(text);
  }
}

void append_sources(Estimate& estimate) {
  for (const SourceSummary& source : estimate.sources) {
    char text[240];
    if (source.outliers > 0) {
      std::snprintf(text, sizeof text, "; %d of %d data of \"%.64s\" count less as outliers",
                    source.outliers, source.data, source.source.c_str());
      estimate.reason.append(text);
    }
    if (!source.consistent) {
      std::snprintf(
          text, sizeof text,
          "; \"%.64s\" contradicts the other sources: chi-square %.0f for %.0f degrees of freedom",
          source.source.c_str(), source.chi_square, source.degrees_of_freedom);
      estimate.reason.append(text);
    }
  }
}

void append_outliers(int outliers, int data, std::string& reason) {
  if (outliers == 0) return;
  char text[80];
  std::snprintf(text, sizeof text, "; %d of %d data count less as outliers", outliers, data);
  reason.append(text);
}

}  // namespace brainshift::inversion
