// SPDX-License-Identifier: Apache-2.0
#include "common/core/estimate.hpp"

namespace brainshift {

std::string_view to_string(Boundary boundary) {
  return boundary == Boundary::kContact ? "contact" : "fixed";
}

std::string_view to_string(Method method) {
  switch (method) {
    case Method::kPaper: return "paper";
  }
  return "paper";
}

std::string_view to_string(EstimateStatus status) {
  switch (status) {
    case EstimateStatus::kNotRun: return "not_run";
    case EstimateStatus::kIterating: return "iterating";
    case EstimateStatus::kConverged: return "converged";
    case EstimateStatus::kIterationLimit: return "iteration_limit";
  }
  return "not_run";
}

}  // namespace brainshift
