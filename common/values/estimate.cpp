// SPDX-License-Identifier: Apache-2.0
#include "common/values/estimate.hpp"

#include <cstdio>

namespace brainshift {

std::string_view to_string(Boundary boundary) {
  return boundary == Boundary::kContact ? "contact" : "fixed";
}

std::string_view to_string(Method method) {
  switch (method) {
    case Method::kCondensed: return "condensed";
    case Method::kPaper: return "paper";
    case Method::kPaperWoodbury: return "paper-woodbury";
    case Method::kIterativeSolver: return "pcg";
  }
  return "condensed";
}

std::string_view to_string(PriorPart part) {
  switch (part) {
    case PriorPart::kAlongGravity: return "along_gravity";
    case PriorPart::kAcrossGravity: return "across_gravity";
    case PriorPart::kTumourVolume: return "tumour_volume";
    case PriorPart::kBrainVolume: return "brain_volume";
    case PriorPart::kResection: return "resection";
    case PriorPart::kOpening: return "opening";
    case PriorPart::kFine: return "fine";
    case PriorPart::kMedium: return "medium";
    case PriorPart::kCoarse: return "coarse";
  }
  return "fine";
}

std::string_view to_string(EstimateStatus status) {
  switch (status) {
    case EstimateStatus::kNotRun: return "not_run";
    case EstimateStatus::kIterating: return "iterating";
    case EstimateStatus::kConverged: return "converged";
    case EstimateStatus::kIterationLimit: return "iteration_limit";
    case EstimateStatus::kDeadline: return "deadline";
  }
  return "not_run";
}

std::string sentence(const AnswerTime& time) {
  char text[96];
  std::snprintf(text, sizeof text, "answered %.4g ms after its observation came, usually %.3g ms",
                time.ms, time.usual_ms);
  return text;
}

}  // namespace brainshift
